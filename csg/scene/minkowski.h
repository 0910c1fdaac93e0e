#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/execution.h"
#include "core/result.h"
#include "mesh/triangle_soup.h"

/// Minkowski sums of solids as unions that overlap: no Boolean is computed. With A and B closed
/// sets, x is in A + B where A meets x - B. Either their boundaries meet there, or one holds a
/// component of the other; so A + B is the union of bd(A) + bd(B), of A moved by one point of each
/// component of B, and of B moved by one point of each component of A. The boundary sums are sums
/// of triangles, which are convex. Where B is convex, A's triangles with B itself and A moved by
/// one point of B are enough.
namespace strata::csg {

/// One of the sets whose union is an operand or a sum.
struct MinkowskiPart {
  /// Of a convex part its vertices, and all else is empty.
  std::vector<glm::dvec3> hull;
  /// Of any other part: its boundary, three points to a triangle, ...
  std::vector<glm::dvec3> triangles;
  std::vector<glm::dvec3> anchors;  ///< ... a point in each component at least, ...
  std::uint32_t source = 0;         ///< ... and that it is this operand's solid ...
  glm::dvec3 offset{0.0};           ///< ... moved by this.

  [[nodiscard]] bool convex() const { return triangles.empty(); }
};

/// A part for a closed outward mesh: convex if its volume is that of its hull to 1e-9. Empty
/// (convex without vertices) for a mesh without triangles.
[[nodiscard]] MinkowskiPart make_part(const TriangleSoup& mesh, std::uint32_t source);

/// Parts of the sum of two unions of parts. Sums without volume are left out.
/// @param approximate  set when vertices of very large convex sums were left out
/// @return kLimit with numbers when there would be too many parts; kCancelled
Result<std::vector<MinkowskiPart>> minkowski_sum(std::span<const MinkowskiPart> a,
                                                 std::span<const MinkowskiPart> b,
                                                 bool& approximate, const Execution& execution);

}  // namespace strata::csg
