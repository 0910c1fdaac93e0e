#pragma once

#include <glm/vec3.hpp>

namespace strata {

/// What the distance of a point to a triangle is found from, in units of the longest side of a
/// voxel (internal to voxelize/).
struct TriangleFrame {
  glm::dvec3 corners[3];  ///< edge i goes from corner i to the next; edge 0 is the longest
  glm::dvec3 normal;      ///< a unit
  glm::dvec3 beside[3];   ///< across edge i within the plane, outwards; units
  glm::dvec3 along[3];    ///< along edge i; units
  bool is_line = false;   ///< the triangle has no area: edge 0 is all of it
};

/// The frame of a triangle on the lattice. The normal is that of the exact plane, however thin the
/// triangle is.
/// @param corners  three, |coordinates| <= kMaxLatticeCoordinate
/// @param scale    sides of a voxel in units of the longest one
/// @param origin   lattice point that the frame is relative to
TriangleFrame triangle_frame(const glm::ivec3* corners, const glm::dvec3& scale,
                             const glm::ivec3& origin);

}  // namespace strata
