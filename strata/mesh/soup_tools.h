#pragma once

#include <algorithm>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <limits>

#include "strata/core/execution.h"
#include "strata/mesh/triangle_soup.h"

namespace strata {

/// A box in world space; empty as made.
struct Bounds {
  glm::dvec3 low{std::numeric_limits<double>::infinity()};    ///< least corner
  glm::dvec3 high{-std::numeric_limits<double>::infinity()};  ///< largest corner

  /// True if it holds no point.
  [[nodiscard]] bool empty() const { return !(low.x <= high.x); }
  /// Below 0 when it is empty.
  [[nodiscard]] double longest_side() const {
    const glm::dvec3 size = high - low;
    return std::max({size.x, size.y, size.z});
  }
  /// Grows until it holds `point`.
  void include(const glm::dvec3& point) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
  /// An empty box changes nothing.
  void include(const Bounds& other) {
    if (other.empty()) return;
    low = glm::min(low, other.low);
    high = glm::max(high, other.high);
  }
  /// Equal corners.
  friend bool operator==(const Bounds&, const Bounds&) = default;
};

/// The least box around all triangles; vertices that no triangle uses do not count.
[[nodiscard]] Bounds bounds(const TriangleSoup& mesh, const Execution& execution = {});

/// Sum of the signed tetrahedra over the triangles, in cubic world units: the volume of a closed
/// outward mesh, negative when it is inside out. Without meaning for open meshes. The rounding of
/// the sum does not depend on the number of threads.
[[nodiscard]] double signed_volume(const TriangleSoup& mesh, const Execution& execution = {});

/// Reverses every triangle.
void reverse_orientation(TriangleSoup& mesh);

/// Adds the triangles of `other`. Its face elements follow those of `mesh`, as if both were one
/// file. @pre together fewer than 2^32 vertices
void append(TriangleSoup& mesh, const TriangleSoup& other);

}  // namespace strata
