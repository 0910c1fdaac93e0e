#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

// Solid angles of triangles seen from voxel centres, a vector of centres at a time. Private to
// voxelize/.

namespace strata {

/// A triangle. Positions are in lattice steps, which are `scale` long along each axis.
struct WindingCap {
  glm::dvec3 corners[3], normal;  ///< the normal is scaled, and twice the area long
  glm::ivec3 lattice[3];          ///< the corners
  double doubt = 0.0;  ///< the side of a point is in doubt below this, times its distance
};

/// Triangles near each other: `count` > 0: caps [first, first + count); else nodes first, first
/// + 1.
struct WindingNode {
  glm::dvec3 middle;       ///< in lattice steps
  glm::dvec3 dipole{0.0};  ///< sum of the scaled area vectors
  double radius = 0.0, area = 0.0;
  std::uint32_t first = 0, count = 0;
};

/// The solid angle of far nodes around a point, to second order.
struct WindingSeries {
  glm::dvec3 middle{0.0};  ///< in lattice steps
  double angle = 0.0;
  glm::dvec3 gradient{0.0};          ///< by scaled positions, as are all derivatives
  glm::dvec3 pure{0.0}, mixed{0.0};  ///< second derivatives xx, yy, zz and yz, zx, xy

  /// Adds a dipole that lies `to`, scaled, from the middle.
  void add(const glm::dvec3& dipole, const glm::dvec3& to);
  void move(const glm::dvec3& to_middle, const glm::dvec3& scale);
};

/// Voxel centres, and the solid angles that are seen from them: positive from behind.
struct WindingPoints {
  static constexpr std::size_t kMost = 64, kStep = 8;
  std::size_t count = 0;  ///< a multiple of kStep
  alignas(64) double x[kMost], y[kMost], z[kMost], angle[kMost];
};

/// Writes the angle of `near` caps, of `far` nodes as dipoles, and of farther ones. Centres on a
/// triangle's plane see the side that the perturbed sample sees (raster/triangle_setup.h). The same
/// bits on any SIMD unit.
void solid_angles(std::span<const WindingCap> caps, std::span<const WindingNode> nodes,
                  std::span<const std::uint32_t> near, std::span<const std::uint32_t> far,
                  const WindingSeries& farther, const glm::dvec3& scale, WindingPoints& points);

/// 1 where the perturbed lattice point sees the cap's back, -1 where its front. Exact.
int winding_side(const WindingCap& cap, const glm::ivec3& p);

}  // namespace strata
