#pragma once

#include <string>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/voxelize/grid_frame.h"

namespace strata {

/// Reads where the voxels of a file lie, and not the voxels: size, spacing, origin, direction, and
/// the unit where the file says it. Formats: all of read_voxels(), and heads of .nhdr and .mhd. A
/// .npy has no place; a file beside it, `x.npy.json`, says `origin`, `spacing` and `direction`.
/// World numbers are taken as the file has them. The grid of a .vdb is the box of its active
/// voxels; that of a .vti with cell data is its cells.
/// @return kUsage: unknown format; kInput naming file and number: no place, axes that are not at
/// right angles, a grid without voxels; kLimit: more than kMaxGridSide voxels along a side;
/// kCancelled
Result<VoxelFileGrid> read_voxel_grid(const std::string& path, const Execution& execution = {});

}  // namespace strata
