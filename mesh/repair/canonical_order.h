#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "exact/cut_points.h"

namespace strata {

/// A mesh whose order depends on its geometry alone.
struct OrderedMesh {
  std::vector<exact::FilePoint> points;
  std::vector<glm::uvec3> triangles;
  std::vector<std::uint32_t> labels;  ///< of the triangles
};

/// Sorts vertices by (x, y, z), and those of equal positions by the least of their triangles; turns
/// each triangle until its least vertex is the first; sorts the triangles. Vertices without
/// triangles are left out.
/// @param positions  of the vertices
/// @pre no two triangles have the same positions in the same order
OrderedMesh canonical_order(const std::vector<exact::FilePoint>& positions,
                            const std::vector<glm::uvec3>& triangles,
                            const std::vector<std::uint32_t>& labels);

}  // namespace strata
