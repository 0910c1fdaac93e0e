#include "strata/voxelize/intervals.h"

#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <mutex>
#include <new>
#include <numeric>
#include <stdexcept>

namespace strata {
namespace {

/// The offsets that tiles share whose columns have one interval each, as most tiles of large grids.
constexpr auto kOneEach = [] {
  std::array<std::uint32_t, VoxelIntervals::kTileColumns + 1> offsets{};
  std::iota(offsets.begin(), offsets.end(), 0u);
  return offsets;
}();

}  // namespace

/// Memory of many tiles, in blocks: to touch small pages for the first time costs more than to fill
/// them, so all blocks but the first are large pages where the system has them.
class VoxelIntervals::Arena {
 public:
  Arena() = default;
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;
  ~Arena() {
    for (const Block& block : blocks_) ::operator delete(block.memory, block.alignment);
  }

  /// Its blocks are filled again.
  void forget() {
    used_ = 0;
    left_ = 0;
  }
  /// A copy of `values`; null for none. May be called by several threads at once.
  template <class T>
  const T* copy(std::span<const T> values) {
    if (values.empty()) return nullptr;
    void* const memory = take(values.size_bytes());
    std::memcpy(memory, values.data(), values.size_bytes());
    return static_cast<const T*>(memory);
  }

 private:
  static constexpr std::size_t kLine = 64, kFirst = std::size_t{256} << 10;
  static constexpr std::size_t kLargePage = std::size_t{2} << 20;
  struct Block {
    void* memory;
    std::align_val_t alignment;
    std::size_t size;
  };

  void* take(std::size_t bytes) {
    bytes = (bytes + kLine - 1) / kLine * kLine;
    std::unique_lock lock(mutex_);
    while (bytes > left_) next_block(bytes);
    left_ -= bytes;
    void* const taken = std::exchange(next_, next_ + bytes);
    const std::size_t size = blocks_[used_ - 1].size;
    if (used_ == blocks_.size() && size <= kLargePage && left_ < size / 8 && bytes <= kFirst) {
      // Threads that touch a new page at once would all clear it: one has the next ready before it
      // is needed. Both are wishes. Where tiles are large, they would seldom fit.
      try {
        add_block(0);
      } catch (const std::bad_alloc&) {
        return taken;
      }
      const Block next = blocks_.back();
      lock.unlock();
      ::madvise(next.memory, next.size, MADV_POPULATE_WRITE);
    }
    return taken;
  }
  void next_block(std::size_t bytes) {
    if (used_ == blocks_.size()) add_block(bytes);
    next_ = static_cast<std::byte*>(blocks_[used_].memory);
    left_ = blocks_[used_++].size;
  }
  void add_block(std::size_t bytes) {
    const std::size_t least = blocks_.empty() ? kFirst : kLargePage;
    const std::size_t size = std::max(least, (bytes + least - 1) / least * least);
    const auto alignment = std::align_val_t{blocks_.empty() ? kLine : kLargePage};
    if (blocks_.size() == blocks_.capacity()) blocks_.reserve(2 * blocks_.size() + 8);
    void* const memory = ::operator new(size, alignment);
    if (!blocks_.empty()) ::madvise(memory, size, MADV_HUGEPAGE);  // a wish
    blocks_.push_back({memory, alignment, size});
  }

  std::mutex mutex_;
  std::vector<Block> blocks_;
  std::size_t used_ = 0;  ///< blocks
  std::byte* next_ = nullptr;
  std::size_t left_ = 0;
};

VoxelIntervals::VoxelIntervals() = default;
VoxelIntervals::VoxelIntervals(VoxelIntervals&&) noexcept = default;
VoxelIntervals& VoxelIntervals::operator=(VoxelIntervals&&) noexcept = default;
VoxelIntervals::~VoxelIntervals() = default;

VoxelIntervals::VoxelIntervals(const VoxelGrid& grid, Axis axis)
    : VoxelIntervals(grid, axis, 0, grid.dims[AxisFrame(axis).v]) {}

VoxelIntervals::VoxelIntervals(const VoxelGrid& grid, Axis axis, int v_begin, int v_end)
    : grid_(grid),
      axis_(axis),
      columns_(grid.dims[AxisFrame(axis).u]),
      v_begin_(v_begin),
      v_end_(v_end),
      tiles_u_((columns_ + kTileSide - 1) / kTileSide),
      tiles_v_((v_end - v_begin + kTileSide - 1) / kTileSide),
      tiles_(static_cast<std::size_t>(tiles_u_) * static_cast<std::size_t>(tiles_v_)),
      arena_(std::make_unique<Arena>()) {}

VoxelIntervals::VoxelIntervals(const VoxelGrid& grid, Axis axis, int v_begin, int v_end,
                               VoxelIntervals&& spent)
    : VoxelIntervals(grid, axis, v_begin, v_end) {
  if (!spent.arena_) return;
  arena_ = std::move(spent.arena_);
  arena_->forget();
  spent = {};
}

void VoxelIntervals::set_tile(int tu, int tv, std::span<const std::uint32_t> offsets,
                              std::span<const Interval> items,
                              std::span<const std::uint32_t> labels) {
  Tile& tile = tiles_[static_cast<std::size_t>(tv) * static_cast<std::size_t>(tiles_u_) +
                      static_cast<std::size_t>(tu)];
  const bool one_each = !offsets.empty() && offsets.back() == kTileColumns &&
                        std::equal(offsets.begin(), offsets.end(), kOneEach.begin());
  tile.offsets = one_each ? kOneEach.data() : arena_->copy(offsets);
  tile.items = arena_->copy(items);
  tile.labels = arena_->copy(labels);
}

std::uint64_t VoxelIntervals::interval_count() const {
  std::uint64_t count = 0;
  for (const Tile& tile : tiles_) {
    if (!tile.offsets) continue;
    count += tile.offsets[kTileColumns];
    if (!tile.labels) continue;
    for (std::size_t local = 0; local < kTileColumns; ++local) {
      const std::uint32_t begin = tile.offsets[local], size = tile.offsets[local + 1] - begin;
      count -= size - run_count({tile.items + begin, size});
    }
  }
  return count;
}

std::uint64_t VoxelIntervals::solid_voxels() const {
  std::uint64_t count = 0;
  for (const Tile& tile : tiles_) {
    if (!tile.offsets) continue;
    for (std::uint32_t i = 0; i < tile.offsets[kTileColumns]; ++i) {
      count += static_cast<std::uint64_t>(tile.items[i].length());
    }
  }
  return count;
}

bool VoxelIntervals::has_labels() const {
  return std::any_of(tiles_.begin(), tiles_.end(),
                     [](const Tile& tile) { return tile.labels != nullptr; });
}

std::uint64_t VoxelIntervals::memory_bytes() const {
  std::uint64_t bytes = tiles_.size() * sizeof(Tile);
  for (const Tile& tile : tiles_) {
    if (!tile.offsets) continue;
    if (tile.offsets != kOneEach.data()) bytes += sizeof kOneEach;
    bytes +=
        tile.offsets[kTileColumns] * (sizeof(Interval) + (tile.labels ? sizeof(std::uint32_t) : 0));
  }
  return bytes;
}

std::optional<std::uint32_t> VoxelIntervals::label(int i, int j, int k) const {
  const glm::ivec3 at(i, j, k);
  const AxisFrame frame(axis_);
  const int u = at[frame.u], v = at[frame.v], w = at[frame.w];
  if (u < 0 || u >= columns_ || v < v_begin_ || v >= v_end_) return std::nullopt;
  const auto runs = column(u, v);
  const auto after = std::upper_bound(runs.begin(), runs.end(), w,
                                      [](int place, Interval run) { return place < run.begin(); });
  if (after == runs.begin() || w >= std::prev(after)->end()) return std::nullopt;
  const auto labels = column_labels(u, v);
  return labels.empty() ? 1 : labels[static_cast<std::size_t>(after - runs.begin()) - 1];
}

namespace {

/// value(label) for each solid voxel, 0 for the others.
template <class T, class Value>
Result<std::vector<T>> dense(const VoxelIntervals& set, const Execution& execution, Value&& value) {
  const glm::ivec3 dims = set.grid().dims;
  const auto x = static_cast<std::size_t>(dims.x), y = static_cast<std::size_t>(dims.y);
  const std::size_t voxels = x * y * static_cast<std::size_t>(dims.z);  // below 2^48
  const auto too_large = [&] {
    return fail(ErrorCode::kLimit, "no memory for an array of {} x {} x {} voxels of {} bytes",
                dims.x, dims.y, dims.z, sizeof(T));
  };
  if (execution.memory_limit != 0 && voxels * sizeof(T) > execution.memory_limit) {
    return too_large();
  }
  try {
    std::vector<T> result(voxels);
    const std::size_t steps[3] = {1, x, x * y};
    const std::size_t step = steps[AxisFrame(set.axis()).w];
    for_each_run(set, [&](const glm::ivec3& first, const glm::ivec3& last, std::uint32_t label) {
      std::size_t at = 0, end = 0;
      for (int axis = 0; axis < 3; ++axis) {
        at += steps[axis] * static_cast<std::size_t>(first[axis]);
        end += steps[axis] * static_cast<std::size_t>(last[axis]);
      }
      for (; at <= end; at += step) result[at] = value(label);
    });
    return result;
  } catch (const std::bad_alloc&) {
    return too_large();
  } catch (const std::length_error&) {
    return too_large();
  }
}

}  // namespace

Result<std::vector<std::uint8_t>> to_dense(const VoxelIntervals& set, const Execution& execution) {
  return dense<std::uint8_t>(set, execution, [](std::uint32_t) { return std::uint8_t{1}; });
}

Result<std::vector<std::uint32_t>> to_dense_labels(const VoxelIntervals& set,
                                                   const Execution& execution) {
  return dense<std::uint32_t>(set, execution, [](std::uint32_t label) { return label; });
}

}  // namespace strata
