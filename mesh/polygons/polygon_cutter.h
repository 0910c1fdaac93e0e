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

/// How far a polygon is from flat.
struct Bend {
  double height = 0.0;  ///< how far its corners lie apart, along its mean normal
  double size = 0.0;    ///< its diagonal
  /// More than 1/1000 of the size: the bound is wide enough for coordinates of four digits. Such a
  /// polygon could mean several surfaces.
  [[nodiscard]] bool large() const;
  /// "its corners lie 3.99 out of one plane, and it is 14.7 long"
  [[nodiscard]] std::string text() const;
};

/// Cuts polygons in space into triangles. Of a thread; room is kept from one to the next.
///
/// A polygon that is flat and convex becomes a fan from its first corner. Any other is seen along
/// the longest axis of its normal, where it keeps its shape up to an affine map, and cut into
/// triangles that cover it there. The ones of a polygon that is not flat are Delaunay triangles in
/// that view, as in OpenSCAD, and do not depend on which corner is the first.
class PolygonCutter {
 public:
  /// The triangles of a polygon, as indices of its corners; empty for the fan from the first
  /// corner. At most n - 2, fewer where the polygon touches itself. Valid until the next call.
  /// @param corners  at least 3; a corner may be given again
  [[nodiscard]] std::span<const glm::uvec3> cut(std::span<const glm::dvec3> corners);
  /// Of the polygon that was cut last.
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
  std::vector<std::uint32_t> corner_;  ///< which corner each point is
  std::vector<std::uint32_t> place_;   ///< of each point; one for those in one place in space
  std::vector<glm::uvec3> triangles_;
  detail::PolygonSweep sweep_;
};

/// The same of a quadrilateral, without memory.
struct QuadCut {
  bool fan = true;  ///< cut from the first corner to the third, else from the second to the fourth
  Bend bend;        ///< if large
};
[[nodiscard]] QuadCut cut_quad(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                               const glm::dvec3& d);

}  // namespace strata
