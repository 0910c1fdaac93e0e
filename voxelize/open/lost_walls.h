#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/inside_rule.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/tile_lists.h"
#include "strata/mesh/triangle_soup.h"

namespace strata {

/// A wall thinner than a voxel that no voxel centre lies in, or parts of one.
struct LostWall {
  Axis axis = Axis::kZ;  ///< that it is thin along
  /// World space: the box of the columns along `axis` that pass through it between two centres.
  glm::dvec3 low{0.0}, high{0.0};
  double thickness = 0.0;     ///< greatest, along the axis, in voxels
  std::uint64_t columns = 0;  ///< about, where there are millions
};

struct LostWalls {
  static constexpr std::size_t kMostTold = 8;
  std::uint64_t count = 0;
  std::vector<LostWall> largest;  ///< by columns, at most kMostTold
};

struct LostWallOptions {
  InsideRule rule = InsideRule::kWinding;
  /// As VoxelizeOptions::filter, but its lists have no labels.
  const TileListFilter* filter = nullptr;
  /// Whether a triangle is of a solid that is taken away, so that it faces the other way.
  std::function<bool(std::uint32_t triangle)> taken_away = {};
  /// No edge of the mesh is longer, world units; 0: not known. Saves time with fine meshes.
  double longest_edge = 0.0;
};

/// Finds walls that solid voxels lose: where a column along x, y or z enters and leaves between two
/// voxel centres, through faces that look along it, and opposite ways within 10 degrees. So neither
/// the outline of a round body nor an edge is one. At least 2 x 2 neighbouring columns must do so
/// (fewer where the grid has fewer). Walls are one where they share a face or faces of theirs a
/// vertex.
///
/// Grids of more than 64 voxels a side are searched every n-th column, n = side / 64: a wall that
/// is smaller may go unseen. Cost: a look at each triangle, far below that of voxelizing; more only
/// where faces that look opposite ways come as near as 2 n voxels. Results do not depend on threads
/// or the order of the triangles. @pre the mesh is closed @return kGeometry, kLimit, kCancelled
Result<LostWalls> find_lost_walls(const TriangleSoup& mesh, const VoxelGrid& grid,
                                  const LostWallOptions& options, const Execution& execution = {});

}  // namespace strata
