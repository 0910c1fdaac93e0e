#pragma once

#include <cmath>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace strata::detail {

/// Which cut of a quadrilateral (a, b, c, d), counter-clockwise and convex, Delaunay's rule wants:
/// 1 from a to c, -1 from b to d, 0 when both will do. The ends of the right cut see the two other
/// corners under angles whose sum is at least pi. Sums within 0.01 of pi count as equal, as in
/// libtess2, by which OpenSCAD cuts faces: grids of rectangles are cut one way then, however their
/// numbers were rounded.
[[nodiscard]] inline int delaunay_cut(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c,
                                      const glm::dvec2& d) {
  // The angles at b and d as complex numbers, whose product has their sum.
  const glm::dvec2 ab = b - a, bc = c - b, cd = d - c, da = a - d;
  const double sine_b = ab.x * bc.y - ab.y * bc.x, cosine_b = -(ab.x * bc.x + ab.y * bc.y);
  const double sine_d = cd.x * da.y - cd.y * da.x, cosine_d = -(cd.x * da.x + cd.y * da.y);
  const double sine = sine_b * cosine_d + cosine_b * sine_d;
  const double cosine = cosine_b * cosine_d - sine_b * sine_d;
  constexpr double kEqual = 0.01;
  if (cosine < 0.0 && std::abs(sine) <= kEqual * -cosine) return 0;
  return sine < 0.0 ? -1 : 1;
}

/// Turns edges inside a triangulation until Delaunay's rule holds: a constrained Delaunay
/// triangulation of its outline. At most 64 turns a triangle: long thin outlines could need more.
void refine_delaunay(std::span<const glm::dvec2> points, std::vector<glm::uvec3>& triangles);

}  // namespace strata::detail
