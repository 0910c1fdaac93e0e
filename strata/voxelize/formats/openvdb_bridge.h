#pragma once

#include <openvdb/openvdb.h>

#include <cstdint>
#include <string>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/voxelize/intervals.h"

/// Sets of voxels as OpenVDB grids in memory, for programs that use both: link strata::openvdb. The
/// only header that includes OpenVDB; files are written without it (write_voxels()).
namespace strata {

/// Settings of to_openvdb().
struct OpenVdbOptions {
  /// Empty: `solid` for a BoolGrid or MaskGrid, `density` for a FloatGrid, `ids` for a FloatGrid of
  /// ids.
  std::string name{};
  /// FloatGrid: the label of a full voxel. Values are labels divided by it, and the grid is a fog
  /// volume. Give samples^3 with VoxelizeOptions::samples. 0: labels are ids and become the values.
  std::uint32_t full_label = 1;
};

/// The grid that `strata voxelize -o x.vdb` would write: the solid voxels are active, a node of
/// equal voxels is a tile, and index (i, j, k) is the centre of voxel (i, j, k) in world space.
/// Work grows with the surface, and with the volume in blocks of 8 x 8 x 8 voxels. Grid is
/// openvdb::BoolGrid, MaskGrid or FloatGrid. Writing the grid needs openvdb::initialize(),
/// to_openvdb() does not.
/// @param set along any axis, all rows of its grid
/// @return kUsage: not all rows, a voxel size that OpenVDB refuses; kLimit: out of memory;
/// kCancelled
template <class Grid = openvdb::BoolGrid>
Result<typename Grid::Ptr> to_openvdb(const VoxelIntervals& set, const OpenVdbOptions& options = {},
                                      const Execution& execution = {});

// Compiled once, in strata::openvdb.
/// @cond
extern template Result<openvdb::BoolGrid::Ptr> to_openvdb<openvdb::BoolGrid>(const VoxelIntervals&,
                                                                             const OpenVdbOptions&,
                                                                             const Execution&);
extern template Result<openvdb::MaskGrid::Ptr> to_openvdb<openvdb::MaskGrid>(const VoxelIntervals&,
                                                                             const OpenVdbOptions&,
                                                                             const Execution&);
extern template Result<openvdb::FloatGrid::Ptr> to_openvdb<openvdb::FloatGrid>(
    const VoxelIntervals&, const OpenVdbOptions&, const Execution&);
/// @endcond

}  // namespace strata
