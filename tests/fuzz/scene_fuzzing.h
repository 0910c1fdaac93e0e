#pragma once

#include <cmath>
#include <string_view>

#include "csg/outline/extrude.h"
#include "csg/outline/outline.h"
#include "strata/mesh/triangle_soup.h"
#include "tests/fuzz/mesh_fuzzing.h"

namespace strata {

/// A refusal of a reader says whose fault it is, and names the input.
inline void check_refusal(const Error& error, std::string_view name) {
  must(error.code == ErrorCode::kInput || error.code == ErrorCode::kLimit,
       "a refusal is kInput or kLimit");
  must(error.message.find(name) != std::string::npos, "a refusal names the file");
}

inline void check_soup(const TriangleSoup& soup) {
  for (const glm::uvec3& t : soup.triangles) {
    must(t.x < soup.positions.size() && t.y < soup.positions.size() && t.z < soup.positions.size(),
         "indices are in range");
  }
  for (const glm::dvec3& p : soup.positions) {
    must(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z), "positions are finite");
  }
}

/// What a reader of outlines gives: finite contours, of which a slab can be made.
inline void check_outline(const csg::Outline& outline) {
  std::size_t points = 0;
  for (const auto& contour : outline.contours) {
    must(contour.size() >= 3, "a contour has three points");
    points += contour.size();
    for (const glm::dvec2& p : contour) {
      must(std::isfinite(p.x) && std::isfinite(p.y), "points are finite");
    }
  }
  constexpr std::size_t kMost = 3000;
  if (points < kMost) check_soup(csg::make_slab(outline, 0.0, 1.0));
}

}  // namespace strata
