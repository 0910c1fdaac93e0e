#include "voxelize/output/block_output.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <utility>

namespace strata {

BlockOutput::BlockOutput(AtomicFile file) : file_(std::move(file)) {
  // AtomicFile writes directly only what it cannot rename: pipes and devices.
  sequential_ = file_->temporary_path() == file_->path();
}

Result<BlockOutput> BlockOutput::create(const std::string& path) {
  return AtomicFile::create(path).map(
      [](AtomicFile&& file) { return BlockOutput(std::move(file)); });
}

Result<void> BlockOutput::append(const void* data, std::size_t bytes) {
  const std::uint64_t offset = std::exchange(position_, position_ + bytes);
  return sequential_ ? file_->write(data, bytes) : write_at(offset, data, bytes);
}

Result<void> BlockOutput::write_at(std::uint64_t offset, const void* data, std::size_t bytes) {
  return file_ ? file_->write_at(offset, data, bytes) : write_at_(offset, data, bytes);
}

Result<void> BlockOutput::patch(std::uint64_t offset, const void* data, std::size_t bytes) {
  return write_at(offset, data, bytes);
}

Result<void> BlockOutput::append_blocks(const Execution& execution, std::size_t count,
                                        const MakeBlock& make) {
  scratch_.resize(std::max(scratch_.size(), static_cast<std::size_t>(execution.thread_count())));
  std::mutex mutex;
  std::condition_variable turn_passed;
  std::size_t turn = 0;  // the block whose offset is given out next
  Result<void> outcome;  // the first failure
  std::atomic<bool> failed{false};

  parallel_for(execution, count, [&](std::size_t index, int worker) {
    Bytes& block = scratch_[static_cast<std::size_t>(worker)];
    std::exception_ptr failure;
    try {
      if (!failed.load(std::memory_order_relaxed)) make(index, block, worker);
    } catch (...) {
      failed = true;
      failure = std::current_exception();  // the others must still get their turn
    }
    // Indices are begun in order, so all earlier blocks are on their way: this wait ends.
    std::unique_lock lock(mutex);
    turn_passed.wait(lock, [&] { return turn == index; });
    const std::uint64_t offset = position_;
    Result<void> written;
    if (!failure && outcome) {
      if (sequential_) {
        written = append(block.data(), block.size());
      } else {
        position_ += block.size();
      }
    }
    const bool write_beside = !failure && outcome && !sequential_;
    ++turn;
    lock.unlock();
    turn_passed.notify_all();
    if (failure) std::rethrow_exception(failure);
    if (write_beside) written = write_at(offset, block.data(), block.size());
    if (!written) {
      failed = true;
      lock.lock();
      if (outcome) outcome = std::move(written);
    }
  });
  if (outcome && turn < count) return fail(ErrorCode::kCancelled, "cancelled");
  return outcome;
}

}  // namespace strata
