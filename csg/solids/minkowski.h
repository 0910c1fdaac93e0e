#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "csg/solids/hull.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"

/// Minkowski sums of solids as unions that overlap: no Boolean is computed. With A and B closed
/// sets, x is in A + B where A meets x - B. Either their boundaries meet there, or one holds a
/// component of the other; so A + B is the union of bd(A) + bd(B), of A moved by one point of each
/// component of B, and of B moved by one point of each component of A. The boundary sums are sums
/// of flat convex facets, which are convex. Where B is convex, A's facets with B itself and A moved
/// by one point of B are enough. The points that move lie inside: what is moved has no face in the
/// boundary of the sum, and no seam with the other pieces.
namespace strata::csg {

/// Flat convex polygons, counter-clockwise seen from outside.
struct Facets {
  std::vector<glm::dvec3> corners;  ///< one facet after another
  std::vector<std::uint32_t> ends;  ///< of each facet, into `corners`

  [[nodiscard]] std::size_t size() const { return ends.size(); }
  [[nodiscard]] std::span<const glm::dvec3> operator[](std::size_t i) const {
    const std::uint32_t first = i == 0 ? 0 : ends[i - 1];
    return std::span(corners).subspan(first, ends[i] - first);
  }
};

/// Triangles that lie in one plane to 1e-10 of the mesh's size, and share edges, become facets.
/// Triangles without area are left out.
[[nodiscard]] Facets merge_facets(const TriangleSoup& mesh);

/// One of the sets whose union is an operand or a sum.
struct MinkowskiPart {
  /// Of a convex part its hull, and all else is empty.
  ConvexHull hull;
  /// Of any other part: its boundary, ...
  Facets facets;
  std::vector<glm::dvec3> anchors;  ///< ... a point in each component at least, ...
  std::uint32_t source = 0;         ///< ... and that it is this operand's solid ...
  glm::dvec3 offset{0.0};           ///< ... moved by this.

  [[nodiscard]] bool convex() const { return facets.size() == 0; }
  [[nodiscard]] bool empty() const { return convex() && hull.mesh.triangles.empty(); }
};

/// A part for a closed outward mesh: convex if its volume is that of its hull to 1e-9. Empty for a
/// mesh without triangles. @return kCancelled
Result<MinkowskiPart> make_part(const TriangleSoup& mesh, std::uint32_t source,
                                const Execution& execution);

/// Parts of the sum of two unions of parts. Sums without volume are left out.
/// @param goes_on  the sum will be an operand of another: its pieces need edges
/// @return kLimit with numbers, before the work, when the pieces would be too many or would not fit
/// the memory limit; kCancelled
Result<std::vector<MinkowskiPart>> minkowski_sum(std::span<const MinkowskiPart> a,
                                                 std::span<const MinkowskiPart> b, bool goes_on,
                                                 const Execution& execution);

}  // namespace strata::csg
