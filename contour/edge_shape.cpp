#include "contour/edge_shape.h"

#include <cstdint>
#include <cstdlib>

// After: T. Ju, T. Udeshi: Intersection-free contouring on an octree grid, 2006.
//
// In a cell all is seen from its vertex. The faces of the cell are divided among its edges: the
// line between the vertices of two cells meets the face between them in a point, and the triangles
// of that point and the face's edges fill the face. So each edge has a part of space of its own,
// the envelope: the tetrahedra of the edge and two cells that follow each other around it. What
// lies in its envelope meets nothing of other edges.

namespace strata::contouring {
namespace {

constexpr int kLength = 256;
/// Two triangles may miss the point where the edge is cut by this many steps, 1/32 voxel.
constexpr int kMostOver = 8;

/// Coordinates are below 2^8, so this is below 2^17, and no sum below exceeds 2^28.
int turn(const glm::ivec3& a, const glm::ivec3& b) { return a.x * b.y - a.y * b.x; }

/// A length in steps, as a fraction.
struct Fraction {
  int over = 0, under = 0;  ///< under 0: none
};
bool is_less(const Fraction& a, const Fraction& b) {
  return std::int64_t{a.over} * b.under < std::int64_t{b.over} * a.under;
}

/// How far from the cut the triangles (a, b, c) and (a, c, d) meet the edge; nothing if they leave
/// the envelope.
Fraction miss(const glm::ivec3& a, const glm::ivec3& b, const glm::ivec3& c, const glm::ivec3& d,
              int cut) {
  // The diagonal from a to c passes the edge on b's side or d's, or meets it.
  const int side = turn(a, c);
  const glm::ivec3& near = side >= 0 ? b : d;  // the corner on that side
  const glm::ivec3& far = side >= 0 ? d : b;
  // near_a a + near_c c lies on the half plane of the edge and the near corner, over their sum.
  const int near_c = std::abs(turn(a, near)), near_a = std::abs(turn(near, c));
  const int sum = near_a + near_c, beyond = std::abs(side);
  // The diagonal must pass between the edge and the corner, within their triangle.
  const int height = near_a * a.z + near_c * c.z - beyond * near.z;
  if (beyond >= sum || height <= 0 || height >= kLength * (sum - beyond)) return {};
  // The other triangle meets the edge.
  const int far_c = std::abs(turn(a, far)), far_a = std::abs(turn(far, c));
  const int all = far_a + far_c + beyond;
  return {std::abs(far_a * a.z + far_c * c.z + beyond * far.z - cut * all), all};
}

}  // namespace

EdgeShape edge_shape(const std::array<glm::ivec3, 4>& v, int cut) {
  const Fraction even = miss(v[0], v[1], v[2], v[3], cut);
  if (even.under != 0 && even.over == 0) return EdgeShape::kDiagonal02;
  const Fraction odd = miss(v[1], v[2], v[3], v[0], cut);
  const bool first = even.under != 0 && (odd.under == 0 || !is_less(odd, even));
  const Fraction& least = first ? even : odd;
  if (least.under == 0 || least.over > kMostOver * least.under) return EdgeShape::kFan;
  return first ? EdgeShape::kDiagonal02 : EdgeShape::kDiagonal13;
}

}  // namespace strata::contouring
