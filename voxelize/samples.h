#pragma once

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/voxelize/intervals.h"

// The filled fraction of voxels, from a set with several voxels for one. Private to voxelize/.

namespace strata {

/// The grid with `samples` voxels for one along each axis.
[[nodiscard]] VoxelGrid refined(const VoxelGrid& grid, int samples);

/// Voxels of `grid` of which at least one sample is solid; the label says how many are. Work and
/// memory grow with the intervals of the samples. Same result for any number of threads.
/// @param fine of refined(grid, samples), from a row that is a multiple of kTileSide * samples to
/// another, or to the last
[[nodiscard]] VoxelIntervals count_samples(const VoxelIntervals& fine, const VoxelGrid& grid,
                                           int samples, const Execution& execution);

}  // namespace strata
