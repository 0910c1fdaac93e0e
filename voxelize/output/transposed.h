#pragma once

#include "strata/core/execution.h"
#include "strata/voxelize/intervals.h"

namespace strata {

/// The same voxels, and labels, as intervals along another axis. Work and memory grow with the
/// surface: with the intervals of both and with the voxel faces across `axis`, never with the solid
/// voxels. Same result for any number of threads. Asks for a stop; what comes out after one is not
/// complete.
/// @pre `set` has all rows of its grid
[[nodiscard]] VoxelIntervals transposed(const VoxelIntervals& set, Axis axis,
                                        const Execution& execution = {});

}  // namespace strata
