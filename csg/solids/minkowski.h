#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "csg/solids/hull.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"

/// Minkowski sums of solids, as unions of overlapping parts: no Boolean is computed. Let A and B be
/// closed sets. A point x is in A + B where A meets x - B. There either their boundaries meet, or
/// one of them holds a component of the other. Therefore A + B is the union of bd(A) + bd(B), of A
/// moved to one point of each component of B, and of B moved to one point of each component of A.
/// The sum of the boundaries consists of sums of flat convex facets, which are convex. If B is
/// convex, the sums of A's facets with B itself and A moved by one point of B suffice.
/// The chosen points lie inside A and B. A moved part therefore has no face in the boundary of the
/// sum, and no seam with the other parts.
namespace strata::csg {

/// Flat convex polygons, counter-clockwise seen from outside.
struct Facets {
  std::vector<glm::dvec3> corners;  ///< the corners of all facets, one facet after another
  std::vector<std::uint32_t> ends;  ///< for each facet, the index after its last corner

  [[nodiscard]] std::size_t size() const { return ends.size(); }
  [[nodiscard]] std::span<const glm::dvec3> operator[](std::size_t i) const {
    const std::uint32_t first = i == 0 ? 0 : ends[i - 1];
    return std::span(corners).subspan(first, ends[i] - first);
  }
};

/// Merges triangles into facets where they share edges and lie in one plane to 1e-10 of the mesh's
/// size. Triangles without area are left out.
[[nodiscard]] Facets merge_facets(const TriangleSoup& mesh);

/// A set that is part of an operand or of a sum; operands and sums are unions of parts.
struct MinkowskiPart {
  /// The hull of a convex part. The other members are then empty.
  ConvexHull hull;
  /// The boundary of a part that is not convex.
  Facets facets;
  std::vector<glm::dvec3> anchors;  ///< at least one point inside each component
  std::uint32_t source = 0;         ///< the operand whose solid this part is, ...
  glm::dvec3 offset{0.0};           ///< ... moved by this vector

  [[nodiscard]] bool convex() const { return facets.size() == 0; }
  [[nodiscard]] bool empty() const { return convex() && hull.mesh.triangles.empty(); }
};

/// Makes a part of a closed mesh that faces outward. The part is convex if its volume equals that
/// of its hull to 1e-9, and empty if the mesh has no triangles. @return kCancelled
Result<MinkowskiPart> make_part(const TriangleSoup& mesh, std::uint32_t source,
                                const Execution& execution);

/// The parts of the sum of two unions of parts. Sums without volume are left out.
/// @param goes_on  the sum will be an operand of another sum, so its parts need edges
/// @return kLimit with numbers, before the work begins, when there would be too many parts or they
/// would exceed the memory limit; kCancelled
Result<std::vector<MinkowskiPart>> minkowski_sum(std::span<const MinkowskiPart> a,
                                                 std::span<const MinkowskiPart> b, bool goes_on,
                                                 const Execution& execution);

}  // namespace strata::csg
