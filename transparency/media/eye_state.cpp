#include "transparency/media/eye_state.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "strata/mesh/diagnose.h"
#include "transparency/media/pixel_rays.h"

namespace strata::transparency {
namespace {

using Corners = std::array<glm::dvec3, 3>;

/// The solid angle of a triangle seen from the origin, with a sign; A. Van Oosterom, J. Strackee,
/// "The solid angle of a plane triangle" (1983).
double solid_angle(const Corners& t) {
  const double a = glm::length(t[0]), b = glm::length(t[1]), c = glm::length(t[2]);
  const double volume = glm::dot(t[0], glm::cross(t[1], t[2]));
  const double part =
      a * b * c + glm::dot(t[0], t[1]) * c + glm::dot(t[1], t[2]) * a + glm::dot(t[2], t[0]) * b;
  return 2.0 * std::atan2(volume, part);
}

/// The square of the distance of the segment from `a` to `b` from the origin.
double square_to_segment(const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 along = b - a;
  const double square = glm::dot(along, along);
  const double part = square > 0.0 ? std::clamp(-glm::dot(a, along) / square, 0.0, 1.0) : 0.0;
  const glm::dvec3 nearest = a + part * along;
  return glm::dot(nearest, nearest);
}

/// The same of a triangle.
double square_to_triangle(const Corners& t) {
  double least = std::min({square_to_segment(t[0], t[1]), square_to_segment(t[1], t[2]),
                           square_to_segment(t[2], t[0])});
  const glm::dvec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
  const double square = glm::dot(normal, normal);
  if (!(square > 0.0)) return least;
  bool inside = true;  // the origin lies over the triangle
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3& a = t[i];
    inside = inside && glm::dot(glm::cross(t[(i + 1) % 3] - a, -a), normal) >= 0.0;
  }
  if (!inside) return least;
  const double along = glm::dot(t[0], normal);
  return std::min(least, along * along / square);
}

/// The solid around or beside the eye. @param square  of the distance of its nearest triangle
EyeSolid make_eye_solid(const std::vector<Corners>& triangles, std::uint32_t solid,
                        double& square) {
  EyeSolid found;
  found.solid = solid;
  double angle = 0.0;
  square = std::numeric_limits<double>::infinity();
  for (const Corners& t : triangles) {
    angle += solid_angle(t);
    const double of_triangle = square_to_triangle(t);
    if (of_triangle >= square) continue;
    square = of_triangle;
    found.normal = glm::cross(t[1] - t[0], t[2] - t[0]);
    found.offset = glm::dot(found.normal, t[0]);
  }
  found.eye_inside = std::abs(angle) > 2.0 * std::numbers::pi;
  return found;
}

}  // namespace

std::vector<EyeSolid> find_eye_solids(const Scene& scene, const MediaTable& table, const View& view,
                                      const Execution& execution) {
  std::vector<EyeSolid> found;
  if (!view.perspective || table.solids.empty()) return found;
  std::vector<std::vector<glm::uvec3>> triangles(table.solids.size());
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    const std::uint32_t solid = table.medium_of[scene.object_of.empty() ? 0 : scene.object_of[t]];
    if (solid != MediaTable::kNone) triangles[solid].push_back(scene.mesh.triangles[t]);
  }
  std::vector<Corners> seen;  // eye space
  // From the eye to the corners of the near plane, with a depth step or so.
  const double reach = 1.001 * view.near * PixelRays(view).ray(-1, -1).length;
  for (std::uint32_t solid = 0; solid < triangles.size(); ++solid) {
    seen.clear();
    double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
    for (const glm::uvec3& t : triangles[solid]) {
      Corners& corners = seen.emplace_back();
      for (int c = 0; c < 3; ++c) {
        const glm::dvec4 world(scene.mesh.positions[t[c]], 1.0);
        glm::dvec3& corner = corners[static_cast<std::size_t>(c)];
        corner = glm::dvec3(view.eye_from_world * world);
        nearest = std::min(nearest, -corner.z);
        farthest = std::max(farthest, -corner.z);
      }
    }
    if (!(nearest < view.near && farthest > 0.0)) continue;
    double square = 0.0;
    const EyeSolid eye = make_eye_solid(seen, solid, square);
    // No ray meets a wall before the near plane, and none begins inside.
    if (!eye.eye_inside && square > reach * reach) continue;
    if (is_closed(scene.mesh.positions, triangles[solid], execution)) found.push_back(eye);
  }
  return found;
}

}  // namespace strata::transparency
