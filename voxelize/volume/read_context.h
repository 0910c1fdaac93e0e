#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/voxelize/volume/voxel_volume.h"

namespace strata {

static_assert(std::endian::native == std::endian::little, "files are read as they are");

/// The memory that reading a file may take; any thread may take some. (This header is internal to
/// voxelize/readers.)
class MemoryBudget {
 public:
  explicit MemoryBudget(std::uint64_t limit) : limit_(limit) {}
  /// @return false if that is too much
  [[nodiscard]] bool take(std::uint64_t bytes) {
    return bytes <= limit_ && used_.fetch_add(bytes) <= limit_ - bytes;
  }
  void give_back(std::uint64_t bytes) { used_.fetch_sub(bytes); }
  [[nodiscard]] std::uint64_t limit() const { return limit_; }

 private:
  std::uint64_t limit_;
  std::atomic<std::uint64_t> used_{0};
};

/// Memory that is taken from a budget while it lives.
class MemoryLoan {
 public:
  MemoryLoan() = default;
  MemoryLoan(const MemoryLoan&) = delete;
  MemoryLoan& operator=(const MemoryLoan&) = delete;
  MemoryLoan(MemoryLoan&& other) noexcept
      : budget_(std::exchange(other.budget_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
  MemoryLoan& operator=(MemoryLoan&& other) noexcept {
    std::swap(budget_, other.budget_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~MemoryLoan() {
    if (budget_ != nullptr) budget_->give_back(bytes_);
  }

  /// Takes more. @return false if that is too much; @pre always of the same budget
  [[nodiscard]] bool take(MemoryBudget& budget, std::uint64_t bytes) {
    if (!budget.take(bytes)) return false;
    budget_ = &budget;
    bytes_ += bytes;
    return true;
  }

 private:
  MemoryBudget* budget_ = nullptr;
  std::uint64_t bytes_ = 0;
};

/// What a reader is given.
struct ReadContext {
  std::string path;        ///< for messages, and for the files of a folder
  std::string_view bytes;  ///< of the file
  const ReadVoxelsOptions& options;
  const Execution& execution;
  MemoryBudget& budget;
  bool integers_as_values = false;  ///< numbers, not ids
  /// A reader sets it: a number of 32 bits is a colour, red + 2^8 green + 2^16 blue + 2^24 alpha.
  bool colours = false;
  /// A reader sets it, and fails, when integers turn out not to be ids; it is called again.
  std::atomic<bool> wants_values{false};

  [[nodiscard]] bool stopped() const { return execution.stop.stop_requested(); }
  [[nodiscard]] tl::unexpected<Error> too_large(std::string_view what) const {
    return fail(ErrorCode::kLimit, "{}: {} would take more than the {:.3g} GB that may be used",
                path, what, static_cast<double>(budget.limit()) / 1e9);
  }
  [[nodiscard]] tl::unexpected<Error> cancelled() const {
    return fail(ErrorCode::kCancelled, "cancelled");
  }
};

/// Numbers and pieces of a file, one after the other. After its end all are zero or empty, and
/// failed() is true.
class ByteCursor {
 public:
  explicit ByteCursor(std::string_view bytes, std::uint64_t at = 0)
      : bytes_(bytes), at_(at), failed_(at > bytes.size()) {}

  template <class T>
  T get() {
    T value{};
    const std::string_view piece = take(sizeof value);
    if (!piece.empty()) std::memcpy(&value, piece.data(), sizeof value);
    return value;
  }
  std::string_view take(std::uint64_t count) {
    if (failed_ || count > bytes_.size() - at_) {
      failed_ = true;
      return {};
    }
    const std::string_view piece = bytes_.substr(at_, count);
    at_ += count;
    return piece;
  }
  void seek(std::uint64_t at) {
    at_ = at;
    failed_ = failed_ || at > bytes_.size();
  }
  [[nodiscard]] std::uint64_t at() const { return at_; }
  [[nodiscard]] std::uint64_t left() const { return failed_ ? 0 : bytes_.size() - at_; }
  [[nodiscard]] bool failed() const { return failed_; }

 private:
  std::string_view bytes_;
  std::uint64_t at_;
  bool failed_;
};

/// "12 x 0 x 5 voxels; each side must be 1 to 65536" unless each side is.
Result<void> check_dims(const ReadContext& context, std::int64_t x, std::int64_t y, std::int64_t z);
/// Whether a grid's place and voxel size are numbers that can be worked with.
Result<void> check_place(const ReadContext& context, const VoxelGrid& grid);

}  // namespace strata
