#include "strata/voxelize/intervals.h"

#include <algorithm>
#include <cstring>

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

}  // namespace strata
