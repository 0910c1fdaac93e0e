#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace strata {

/// Triangles in world space, counter-clockwise seen from outside. Nothing is required of their
/// connectivity: rays need none, and users' meshes are often bad.
struct TriangleSoup {
  std::vector<glm::dvec3> positions;  ///< world space; finite
  std::vector<glm::uvec3> triangles;  ///< indices into positions, each < positions.size()
  /// For messages: the 0-based face element of the file that triangle t comes from. Empty when
  /// triangle t is element t.
  std::vector<std::uint32_t> face_elements;
};

}  // namespace strata
