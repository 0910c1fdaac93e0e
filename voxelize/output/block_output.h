#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/atomic_file.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/core/unfilled_allocator.h"

namespace strata {

/// The bytes of a file under construction. resize() does not clear.
using Bytes = std::vector<std::byte, UnfilledAllocator<std::byte>>;

/// A single-file output that is made of blocks by several threads (internal to voxelize/). The
/// bytes are the same on a file, where blocks are written side by side, and on a pipe, where they
/// queue.
class BlockOutput {
 public:
  /// @return kOutput, kLimit as AtomicFile::create
  static Result<BlockOutput> create(const std::string& path);
  /// A part of a file that another one creates and commits.
  using WriteAt = std::function<Result<void>(std::uint64_t, const void*, std::size_t)>;
  explicit BlockOutput(WriteAt write_at) : write_at_(std::move(write_at)) {}

  /// Makes the block of an index: sets the size and content of `out`, which arrives with the size
  /// and content that the same worker gave it before.
  using MakeBlock = std::function<void(std::size_t index, Bytes& out, int worker)>;

  /// Appends blocks 0 .. count-1 in this order; they may be of any size. Holds one block a worker.
  /// @return kOutput; kCancelled when stopped before the last block
  Result<void> append_blocks(const Execution& execution, std::size_t count, const MakeBlock& make);
  Result<void> append(const void* data, std::size_t bytes);
  Result<void> append(std::string_view text) { return append(text.data(), text.size()); }

  /// Overwrites earlier bytes. @pre !sequential()
  Result<void> patch(std::uint64_t offset, const void* data, std::size_t bytes);
  /// Standard output, a pipe or a device: what is written cannot be changed any more.
  [[nodiscard]] bool sequential() const { return sequential_; }
  [[nodiscard]] std::uint64_t position() const { return position_; }
  /// Goes on there. @pre !sequential()
  void seek(std::uint64_t position) { position_ = position; }
  Result<void> commit() { return file_ ? file_->commit() : Result<void>(); }

 private:
  explicit BlockOutput(AtomicFile file);
  Result<void> write_at(std::uint64_t offset, const void* data, std::size_t bytes);

  std::optional<AtomicFile> file_;
  WriteAt write_at_;  // of a part
  bool sequential_ = false;
  std::uint64_t position_ = 0;
  std::vector<Bytes> scratch_;  // by worker; kept, since fresh pages are dear
};

}  // namespace strata
