#pragma once

#include <functional>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"
#include "strata/voxelize/intervals.h"
#include "strata/voxelize/voxelize_options.h"

namespace strata {

/// Receives the slabs in increasing v.
using SlabSink = std::function<Result<void>(const VoxelIntervals&)>;

/// Voxelizes `mesh` on `grid`, slab by slab of bounded memory. Voxel centres decide (law 7): same
/// set for every axis, store, thread count and order of triangles. A mesh that is not closed is
/// treated as `strata voxelize` does it: VoxelizeOptions::open.
/// @return kUsage (a surface or samples of labelled lists), kGeometry (coordinates too large, open
/// mesh with OpenMode::kFail), kLimit, kCancelled, or the sink's error.
Result<VoxelizeReport> voxelize_slabs(const TriangleSoup& mesh, const VoxelGrid& grid,
                                      const VoxelizeOptions& options, const Execution& execution,
                                      const SlabSink& sink);

/// The same in one piece.
Result<VoxelIntervals> voxelize(const TriangleSoup& mesh, const VoxelGrid& grid,
                                const VoxelizeOptions& options = {},
                                const Execution& execution = {}, VoxelizeReport* report = nullptr);

}  // namespace strata
