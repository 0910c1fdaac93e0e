#pragma once

#include <functional>

#include "voxelize/solid.h"

// Open meshes: the three axes decide each voxel. Private to voxelize/.

namespace strata {

/// Hands out the majority of the three axes' solids, slab by slab along options.axis. Where exactly
/// one of a voxel's three columns is balanced (entered as often as left), that one decides alone.
/// Memory: the intervals of all three axes; time: a 64th of the voxels in the mesh's box.
Result<void> vote_slabs(const LatticeMesh& mesh, const VoxelGrid& grid,
                        const VoxelizeOptions& options, const Execution& execution, int slab_rows,
                        VoxelizeReport& report,
                        const std::function<Result<void>(VoxelIntervals&&)>& sink);

}  // namespace strata
