#pragma once

#include <memory>
#include <vector>

#include "raster/tile_bins.h"
#include "strata/hashbuffer/tile_lists.h"
#include "strata/voxelize/intervals.h"
#include "strata/voxelize/voxelize.h"

// Private to voxelize/.

namespace strata {

/// The voxels that the surface of a Boolean tree passes through, slab by slab. A voxel counts when
/// faces of solids do, by the test of voxelize_shell(), and the tree depends on those solids, all
/// others being as they are at its centre. Where the faces in a voxel are of one solid that is the
/// tree's surface; where several solids have faces in it, none of the surface is lost, and a voxel
/// may be kept that it misses.
class TreeShell {
 public:
  /// Keeps references to `mesh` and `grid`. @pre options.filter is set
  static Result<TreeShell> create(const LatticeMesh& mesh, const VoxelGrid& grid,
                                  const VoxelizeOptions& options, const Execution& execution);

  /// Rows [v_begin, v_end), as voxelize_shell() has them.
  Result<VoxelIntervals> slab(int v_begin, int v_end, const Execution& execution);

 private:
  struct Worker;

  const LatticeMesh* mesh_ = nullptr;
  const VoxelGrid* grid_ = nullptr;
  VoxelizeOptions options_;
  RasterTarget target_;
  TileBins bins_;  ///< of the rays
  std::vector<std::shared_ptr<Worker>> workers_;
};

}  // namespace strata
