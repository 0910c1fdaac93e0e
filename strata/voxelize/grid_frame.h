#pragma once

#include <glm/mat3x3.hpp>
#include <string>

namespace strata {

/// How a grid lies in the world beyond VoxelGrid: a point p of VoxelGrid's space is at
/// direction * p.
struct GridFrame {
  glm::dmat3 direction{1.0};  ///< orthonormal; a reflection is allowed
  std::string space{};       ///< NRRD's name of the world's axes, such as "left-posterior-superior"
  double unit_metres = 0.0;  ///< length of the world's unit in metres; 0: unknown
};

}  // namespace strata
