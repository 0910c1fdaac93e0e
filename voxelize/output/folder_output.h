#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "core/atomic_file.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "voxelize/output/block_output.h"

namespace strata {

/// An output folder whose files are written by several threads (internal to voxelize/).
class FolderOutput {
 public:
  /// @return kOutput, kLimit as AtomicFolder::create
  static Result<FolderOutput> create(const std::string& path);
  /// A folder that is there, and that others write into too. @return kOutput
  static Result<FolderOutput> join(const std::string& path);
  FolderOutput(FolderOutput&& other) noexcept;
  FolderOutput& operator=(FolderOutput&&) = delete;
  ~FolderOutput();

  /// Makes a folder in it, in folders that are there; where others write too, it may be there.
  /// @return kOutput naming it
  Result<void> make_folder(const std::string& name) const;
  /// Writes one file of the folder. Several threads may call it. @return kOutput naming the file
  Result<void> write(const std::string& name, const void* data, std::size_t bytes) const;
  /// Calls body for every index of [0, count) on several threads. @return the first failure met;
  /// after one, the remaining indices are skipped; kCancelled when stopped before the last index.
  static Result<void> for_each(const Execution& execution, std::size_t count,
                               const std::function<Result<void>(std::size_t, int worker)>& body);
  Result<void> commit() { return folder_ ? folder_->commit() : Result<void>(); }

 private:
  FolderOutput(std::string path, std::optional<AtomicFolder> folder)
      : path_(std::move(path)), folder_(std::move(folder)) {}
  Result<void> open_folder(const std::string& path);

  std::string path_;
  std::optional<AtomicFolder> folder_;  // none: another one gives it its name
  int descriptor_ = -1;  // of the folder: opening relative to it is a fourth of the work
};

}  // namespace strata
