#pragma once

#include <cstdint>
#include <vector>

#include "strata/voxelize/intervals.h"

namespace strata {

/// Builds intervals from a predicate solid(i, j, k), by brute force: for small grids.
template <class Predicate>
VoxelIntervals intervals_from_predicate(const VoxelGrid& grid, Axis axis, Predicate&& solid) {
  const AxisFrame frame(axis);
  VoxelIntervals result(grid, axis);
  constexpr int kSide = VoxelIntervals::kTileSide;
  for (int tv = 0; tv < result.tiles_v(); ++tv) {
    for (int tu = 0; tu < result.tiles_u(); ++tu) {
      std::vector<std::uint32_t> offsets(1, 0);
      std::vector<Interval> items;
      for (int local = 0; local < kSide * kSide; ++local) {
        glm::ivec3 index{0};
        index[frame.u] = tu * kSide + local % kSide;
        index[frame.v] = tv * kSide + local / kSide;
        if (index[frame.u] < grid.dims[frame.u] && index[frame.v] < grid.dims[frame.v]) {
          bool inside = false;
          for (int k = 0; k < grid.dims[frame.w]; ++k) {
            index[frame.w] = k;
            const bool now = solid(index.x, index.y, index.z);
            if (now && !inside) items.push_back({static_cast<std::uint16_t>(k), 0});
            if (now) items.back().last = static_cast<std::uint16_t>(k);
            inside = now;
          }
        }
        offsets.push_back(static_cast<std::uint32_t>(items.size()));
      }
      if (!items.empty()) result.set_tile(tu, tv, offsets, items);
    }
  }
  return result;
}

}  // namespace strata
