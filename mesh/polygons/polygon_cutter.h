#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "mesh/polygons/polygon_sweep.h"

namespace strata {

/// The deviation of a polygon from a plane.
struct Bend {
  double height = 0.0;  ///< extent of its corners along its mean normal
  double size = 0.0;    ///< diagonal of its box
  /// Whether the height exceeds 1/1000 of the size: such a polygon could mean several surfaces. The
  /// bound leaves room for coordinates of four digits.
  [[nodiscard]] bool large() const;
  /// "its corners lie 3.99 out of one plane, and it is 14.7 long"
  [[nodiscard]] std::string text() const;
};

/// Cuts polygons in space into triangles. One object serves one thread; it keeps its memory between
/// calls.
///
/// A polygon that is flat and convex becomes a fan from its first corner. Any other polygon is
/// projected along the longest axis of its normal, which keeps its shape up to an affine map, and
/// is triangulated there. A polygon that is not flat gets Delaunay triangles in that view, as in
/// OpenSCAD. They do not depend on which corner is the first.
class PolygonCutter {
 public:
  /// The triangles of a polygon as indices of its corners, or an empty span for the fan from the
  /// first corner. There are at most n - 2, and fewer where the polygon touches itself. The span is
  /// valid until the next call.
  /// @param corners  at least 3; corners may be repeated
  [[nodiscard]] std::span<const glm::uvec3> cut(std::span<const glm::dvec3> corners);
  /// The bend of the last polygon.
  [[nodiscard]] const Bend& bend() const { return bend_; }

 private:
  [[nodiscard]] bool measure(std::span<const glm::dvec3> corners);
  [[nodiscard]] bool convex() const;
  void begin_at_least_corner(std::span<const glm::dvec3> corners);
  void number_places(std::span<const glm::dvec3> corners);
  [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> edge(std::uint32_t a,
                                                             std::uint32_t b) const;
  [[nodiscard]] std::vector<std::uint32_t> without_bridges() const;
  [[nodiscard]] bool keeps_outline() const;
  [[nodiscard]] bool cut_by_ears(std::span<const glm::dvec3> corners);

  Bend bend_;
  glm::dvec3 normal_{0.0};
  bool flat_ = true;
  std::vector<glm::dvec2> points_;     ///< in the view, counter-clockwise as a whole
  std::vector<std::uint32_t> corner_;  ///< the corner of each point
  std::vector<std::uint32_t> place_;   ///< number of the position in space
  std::vector<glm::uvec3> triangles_;
  detail::PolygonSweep sweep_;
};

/// The cut of a quadrilateral, computed without memory allocation.
struct QuadCut {
  bool fan = true;  ///< the diagonal starts at the first corner, else at the second
                    ///< to the fourth
  Bend bend;        ///< set if large
};
[[nodiscard]] QuadCut cut_quad(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                               const glm::dvec3& d);

}  // namespace strata
