#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "strata/core/result.h"

namespace strata {

/// The file or folder that a symbolic link leads to; the path itself where it is no link, or one to
/// nothing.
[[nodiscard]] std::string follow_link(const std::string& path);

/// A file that appears under its name only when complete: bytes go to a temporary file beside it,
/// which commit() renames. Destroyed uncommitted, or on SIGINT/SIGTERM (remove_temporary_files), it
/// leaves nothing. Two kinds of target are written directly, since nothing can be renamed onto
/// them: "-", which is standard output, and devices and pipes (/dev/null). A symbolic link is
/// followed. Move-only.
class AtomicFile {
 public:
  /// @return kOutput naming the path and the system's reason; kLimit when kMaxTemporaries are live.
  static Result<AtomicFile> create(const std::string& path);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&& other) noexcept;
  ~AtomicFile();

  /// Appends bytes; short writes are continued. @return kOutput (full disk, ...)
  Result<void> write(const void* data, std::size_t bytes);
  /// Writes at a position in bytes; not for standard output, and not to be mixed with write().
  /// Several threads may call it at once.
  Result<void> write_at(std::uint64_t offset, const void* data, std::size_t bytes);
  /// Closes and renames to the final name. @return kOutput; also when an earlier write failed.
  /// There is no fsync: a power cut may lose the file, an interrupted program cannot.
  Result<void> commit();

  /// Where the bytes are until commit(), for libraries that open files by name; "-" for standard
  /// output.
  [[nodiscard]] const std::string& temporary_path() const { return temporary_; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  AtomicFile() = default;
  void discard() noexcept;
  tl::unexpected<Error> write_failure(std::size_t bytes, std::uint64_t offset, int reason);

  std::string path_;       // as the caller wrote it
  std::string target_;     // what commit() renames to; links resolved; empty: written directly
  std::string temporary_;  // beside target_
  int descriptor_ = -1;
  int slot_ = -1;              // in the table of remove_temporary_files
  std::uint64_t written_ = 0;  // bytes appended by write()
  std::atomic<bool> failed_{false};
};

/// Writes a whole file, which appears when it is complete. @return as AtomicFile
Result<void> write_file(const std::string& path, const void* data, std::size_t bytes);

/// The same for a folder of files: made beside its final name, renamed by commit(). An existing
/// empty folder is replaced; an existing folder with content is kOutput.
class AtomicFolder {
 public:
  /// A trailing slash is allowed. @return kOutput, kLimit as AtomicFile::create
  static Result<AtomicFolder> create(const std::string& path);
  AtomicFolder(AtomicFolder&& other) noexcept;
  AtomicFolder& operator=(AtomicFolder&& other) noexcept;
  ~AtomicFolder();
  Result<void> commit();
  [[nodiscard]] const std::string& temporary_path() const { return temporary_; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  AtomicFolder() = default;
  void discard() noexcept;
  std::string path_, target_, temporary_;
  int slot_ = -1;
};

/// Several outputs that appear together or not at all: while it lives, commit() of files and
/// folders on this thread only completes them, and commit() here gives all of them their names.
/// Where that fails half way, those that have theirs already are taken back, and what they replaced
/// is there again (where the file system can exchange two names; else the new file stays).
/// Destroyed uncommitted it leaves nothing. At most one lives on a thread at a time.
class OutputGroup {
 public:
  OutputGroup();
  OutputGroup(const OutputGroup&) = delete;
  OutputGroup& operator=(const OutputGroup&) = delete;
  ~OutputGroup();

  /// Whether one lives on this thread.
  [[nodiscard]] static bool lives();
  /// Renames all that was completed since the last time. @return kOutput naming the one that failed
  Result<void> commit();
  /// Where the bytes of a completed output lie now: under a temporary name, or its own.
  /// @param path  as it was created
  [[nodiscard]] std::string place_of(const std::string& path) const;

 private:
  friend class AtomicFile;
  friend class AtomicFolder;
  struct Waiting {
    std::string path, target, temporary;
    int slot = -1;
    bool folder = false;
    bool exchanged = false;  ///< the temporary name has what was there before
    bool replaced = false;   ///< what was there before is gone
  };
  int place(Waiting& output) const;
  static void take_back(Waiting& output) noexcept;
  std::vector<Waiting> waiting_;
};

/// Most AtomicFile and AtomicFolder objects that may live at once in a process.
inline constexpr int kMaxTemporaries = 256;

/// Removes the temporary files and folders of all live AtomicFile and AtomicFolder objects. Safe in
/// a signal handler: it uses a fixed table and system calls only. Meant for the way out: a commit()
/// after it fails.
void remove_temporary_files() noexcept;

}  // namespace strata
