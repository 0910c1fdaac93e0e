#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "core/result.h"

namespace strata {

/// A file that appears under its name only when complete: bytes go to a temporary file beside it,
/// which commit() renames. Destroyed uncommitted, or on SIGINT/SIGTERM (remove_temporary_files), it
/// leaves nothing. The path "-" is standard output, written directly. Move-only.
class AtomicFile {
 public:
  /// @return kOutput naming the path and the system's reason.
  static Result<AtomicFile> create(const std::string& path);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&& other) noexcept;
  ~AtomicFile();

  /// Appends bytes; short writes are continued. @return kOutput (full disk, ...)
  Result<void> write(const void* data, std::size_t bytes);
  /// Writes at a position; not for standard output. Several threads may call it at once.
  Result<void> write_at(std::uint64_t offset, const void* data, std::size_t bytes);
  /// Flushes and renames to the final name.
  Result<void> commit();

  /// Where the bytes are until commit(), for libraries that open files by name; "-" for standard
  /// output.
  [[nodiscard]] const std::string& temporary_path() const { return temporary_; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  AtomicFile() = default;
  void discard() noexcept;
  std::string path_, temporary_;
  int descriptor_ = -1;
};

/// The same for a folder of files: made beside its final name, renamed by commit(). An existing
/// empty folder is replaced; an existing folder with content is kOutput.
class AtomicFolder {
 public:
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
  std::string path_, temporary_;
};

/// Removes the temporary files and folders of all live AtomicFile and AtomicFolder objects; files
/// by unlink only, so that a signal handler may call it for files (folders are removed by their
/// owners).
void remove_temporary_files() noexcept;

}  // namespace strata
