#pragma once

#include <glm/mat3x3.hpp>
#include <string>

#include "strata/core/grid.h"
#include "strata/mesh/soup_tools.h"

namespace strata {

/// How a grid lies in the world beyond VoxelGrid: a point p of VoxelGrid's space is at
/// direction * p.
struct GridFrame {
  glm::dmat3 direction{1.0};  ///< columns: where x, y, z of the grid point; of length 1 and at
                              ///< right angles; a reflection is allowed
  std::string space{};       ///< NRRD's name of the world's axes, such as "left-posterior-superior"
  double unit_metres = 0.0;  ///< length of the world's unit in metres; 0: unknown

  /// Whether the axes of the grid are not those of the world.
  [[nodiscard]] bool turned() const { return direction != glm::dmat3(1.0); }
  /// A point of the grid's space, in the world.
  [[nodiscard]] glm::dvec3 world(const glm::dvec3& p) const { return turned() ? direction * p : p; }
  /// The box in the world around a box of the grid's space.
  [[nodiscard]] Bounds world_box(const Bounds& box) const;
  /// Columns: from a voxel to the next along x, y, z, in the world.
  [[nodiscard]] glm::dmat3 steps(const glm::dvec3& voxel_size) const {
    return {direction[0] * voxel_size.x, direction[1] * voxel_size.y, direction[2] * voxel_size.z};
  }
};

/// The grid of a file, as the file states it: voxel (i, j, k) is the file's, and the world is the
/// file's, without a change between LPS and RAS.
struct VoxelFileGrid {
  VoxelGrid grid;   ///< in the space that `frame` turns
  GridFrame frame;  ///< its direction, space and unit
};

}  // namespace strata
