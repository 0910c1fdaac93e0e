#pragma once

#include <cstdint>
#include <utility>

#include "strata/voxelize/intervals.h"
#include "voxelize/output/dense_values.h"

namespace strata {

/// Slabs of x intervals as one value a voxel, 0 outside, x fastest, then y, then z: the order of
/// .npy, .nrrd and .vti. A layer is one z. (Internal to voxelize/.)

/// Where the values of a layer begin, in bytes after those of layer 0.
inline std::uint64_t place_of_layer(const glm::ivec3& dims, const DenseValues& values, int z) {
  return static_cast<std::uint64_t>(dims.x) * static_cast<std::uint64_t>(dims.y) * values.bytes *
         static_cast<std::uint64_t>(z);
}

/// Gives the values of rows y_begin to y_end - 1 of layer z of a slab as runs: run(value, length).
template <class Run>
void emit_rows(const VoxelIntervals& slab, const DenseValues& values, int z, int y_begin, int y_end,
               Run&& run) {
  const int length = slab.grid().dims.x;
  for (int y = y_begin; y < y_end; ++y) {
    int done = 0;
    for_each_value(slab, values, y, z, [&](const Interval& interval, std::uint32_t value) {
      if (interval.begin() > done) run(std::uint32_t{0}, interval.begin() - done);
      run(value, interval.length());
      done = interval.end();
    });
    if (length > done) run(std::uint32_t{0}, length - done);
  }
}

/// The same of a whole layer.
template <class Run>
void emit_layer(const VoxelIntervals& slab, const DenseValues& values, int z, Run&& run) {
  emit_rows(slab, values, z, 0, slab.columns(), std::forward<Run>(run));
}

}  // namespace strata
