#pragma once

#include <cmath>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace strata::detail {

/// The diagonal of a convex quadrilateral (a, b, c, d), counter-clockwise, that Delaunay's rule
/// prefers: 1 for a-c, -1 for b-d, 0 when either will do. The ends of the right diagonal see the
/// other two corners under angles whose sum is at least pi. Sums within 0.01 of pi count as equal,
/// as in libtess2, which OpenSCAD uses to cut faces. Grids of rectangles are then cut one way,
/// however their coordinates were rounded.
[[nodiscard]] inline int delaunay_cut(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c,
                                      const glm::dvec2& d) {
  // The angles at b and d as complex numbers: the argument of their product is the sum.
  const glm::dvec2 ab = b - a, bc = c - b, cd = d - c, da = a - d;
  const double sine_b = ab.x * bc.y - ab.y * bc.x, cosine_b = -(ab.x * bc.x + ab.y * bc.y);
  const double sine_d = cd.x * da.y - cd.y * da.x, cosine_d = -(cd.x * da.x + cd.y * da.y);
  const double sine = sine_b * cosine_d + cosine_b * sine_d;
  const double cosine = cosine_b * cosine_d - sine_b * sine_d;
  constexpr double kEqual = 0.01;
  if (cosine < 0.0 && std::abs(sine) <= kEqual * -cosine) return 0;
  return sine < 0.0 ? -1 : 1;
}

/// Flips edges inside a triangulation until Delaunay's rule holds, which makes it a constrained
/// Delaunay triangulation of its outline. It stops after 64 flips per triangle; long thin outlines
/// could need more.
void refine_delaunay(std::span<const glm::dvec2> points, std::vector<glm::uvec3>& triangles);

}  // namespace strata::detail
