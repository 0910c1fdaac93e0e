#pragma once

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"
#include "strata/voxelize/voxelize.h"

namespace strata {

/// Whether rays through the voxel centres of a grid, along its three axes, meet faces of a mesh
/// that have the inside on both sides: parts overlap, or touch in a face. Distances to such a mesh
/// are those to faces within the solid; DistanceOptions::surface can be its boundary instead.
/// @param options  that the voxels inside are found with; `rule` counts
/// @pre the mesh is closed, and within the lattice of the grid
/// @return as voxelize_slabs()
Result<bool> has_inner_faces(const TriangleSoup& mesh, const VoxelGrid& grid,
                             const VoxelizeOptions& options, const Execution& execution = {});

}  // namespace strata
