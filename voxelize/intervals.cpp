#include "strata/voxelize/intervals.h"

#include <algorithm>
#include <new>
#include <stdexcept>

namespace strata {

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
      tiles_(static_cast<std::size_t>(tiles_u_) * static_cast<std::size_t>(tiles_v_)) {}

void VoxelIntervals::set_tile(int tu, int tv, std::span<const std::uint32_t> offsets,
                              std::span<const Interval> items,
                              std::span<const std::uint32_t> labels) {
  Tile& tile = tiles_[static_cast<std::size_t>(tv) * static_cast<std::size_t>(tiles_u_) +
                      static_cast<std::size_t>(tu)];
  tile.offsets = std::make_unique_for_overwrite<std::uint32_t[]>(offsets.size());
  tile.items = std::make_unique_for_overwrite<Interval[]>(items.size());
  std::copy(offsets.begin(), offsets.end(), tile.offsets.get());
  std::copy(items.begin(), items.end(), tile.items.get());
  tile.labels.reset();
  if (labels.empty()) return;
  tile.labels = std::make_unique_for_overwrite<std::uint32_t[]>(labels.size());
  std::copy(labels.begin(), labels.end(), tile.labels.get());
}

std::uint64_t VoxelIntervals::interval_count() const {
  std::uint64_t count = 0;
  for (const Tile& tile : tiles_) {
    if (!tile.offsets) continue;
    count += tile.offsets[kTileColumns];
    if (!tile.labels) continue;
    for (std::size_t local = 0; local < kTileColumns; ++local) {
      const std::uint32_t begin = tile.offsets[local], size = tile.offsets[local + 1] - begin;
      count -= size - run_count({tile.items.get() + begin, size});
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
    if (tile.offsets)
      bytes += (kTileColumns + 1) * sizeof(std::uint32_t) +
               tile.offsets[kTileColumns] *
                   (sizeof(Interval) + (tile.labels ? sizeof(std::uint32_t) : 0));
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
