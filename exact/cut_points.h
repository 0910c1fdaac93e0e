#pragma once

// Points where triangles cut each other: of an edge and a plane (or of two edges of one plane), and
// of three planes.

#include <array>

#include "exact/determinants.h"

namespace strata::exact {

/// The point p + (q - p) * s_p / (s_p - s_q) of the line through p and q. For the point where a
/// plane cuts the edge, s_p and s_q are the heights of p and q over it: at most 2 S^3, 3b + 2 bits.
/// For the point where another edge cuts it in a common plane, they are orient2d() about that edge
/// in a projection. Any s_p and s_q of these sizes do, so names and meaning are the caller's.
/// Needs no filters: the heights are there as integers, and a conversion to double takes as long as
/// the products.
struct EdgePoint {
  LatticePoint p, q;
  Int128 s_p, s_q;  ///< s_p != s_q; signs differ when the point lies between p and q

  /// s_p - s_q = n . (p - q): at most 4 S^3, 3b + 3 bits; 90 for b = 29.
  constexpr Int128 weight() const { return s_p - s_q; }
};

/// @pre the plane does not contain p and q, and is not parallel to the line
constexpr EdgePoint edge_plane_point(const LatticePoint& p, const LatticePoint& q,
                                     const Plane& plane) {
  return {p, q, height(plane, p), height(plane, q)};
}

/// s_p r_q - s_q r_p: at most 2 (2 S^3)^2 = 8 S^6: 6b + 4 bits; 178 for b = 29.
constexpr Int192 det2(Int128 s_p, Int128 s_q, Int128 r_p, Int128 r_q) {
  return product<Int192>(s_p, r_q) - product<Int192>(s_q, r_p);
}

/// Where an edge point lies: 1 above the plane, 0 on it, -1 below it. The height over the plane
/// goes from r_p to r_q as the point goes from p to q: it is (s_p r_q - s_q r_p) / (s_p - s_q).
constexpr int side_of_plane(const EdgePoint& point, const Plane& plane) {
  const Int128 r_p = height(plane, point.p), r_q = height(plane, point.q);
  return sign_of(det2(point.s_p, point.s_q, r_p, r_q)) * sign_of(point.weight());
}

/// The order of two points of one edge: -1 when the first is nearer to p, 0 when they are one
/// point. s_p / (s_p - s_q) - r_p / (r_p - r_q) has the numerator s_q r_p - s_p r_q.
/// @pre both have the same p and q
constexpr int order_on_edge(const EdgePoint& first, const EdgePoint& second) {
  assert(first.p == second.p && first.q == second.q);
  return -sign_of(det2(first.s_p, first.s_q, second.s_p, second.s_q)) * sign_of(first.weight()) *
         sign_of(second.weight());
}

/// The order of two edge points on the line that two planes a and b share: -1 when the first comes
/// before the second in the direction cross(n_a, n_b), 0 when they are one point. Lattice points
/// alone decide: with u and w along the edges and second - first = t * cross(n_a, n_b),
/// orient3d(p, q, p', q') = det(u, second - first, w) = t (w . n_a) (u . n_b), where (q - p) . n_b
/// is -weight() of the first.
/// @param first   an edge of plane a, cut by b: its heights are over b
/// @param second  an edge of plane b, cut by a: its heights are over a
constexpr int order_on_common_line(const EdgePoint& first, const EdgePoint& second) {
  return -orient3d(first.p, first.q, second.p, second.q) * sign_of(first.weight()) *
         sign_of(second.weight());
}

/// A point (x, y, z) / w about the origin, w > 0: the form that all points share. For three planes,
/// w = |det3|: at most 4 S^6, and numerators at most 3 * 2 S^3 * 2 S^4 = 12 S^7: 7b + 4 bits; 207
/// for b = 29. For an edge point w <= 4 S^3 and numerators of a point between p and q are at most
/// S / 2 * w.
struct RationalPoint {
  Int256 x, y, z;
  Int192 w;
};

/// The numerator along an axis, 0 to 2.
constexpr const Int256& numerator(const RationalPoint& point, int axis) {
  return axis == 0 ? point.x : axis == 1 ? point.y : point.z;
}

/// The order of a / a_weight and b / b_weight: -1, 0, 1. Products of an Int256 and an Int192 wrap
/// beyond 448 bits; those of numerators and weights have 7b + 4 + 6b + 3 bits, 384 for b = 29.
/// @pre the weights are above 0
constexpr int compare_fractions(const Int256& a, const Int192& a_weight, const Int256& b,
                                const Int192& b_weight) {
  return sign_of(product<Wide<7>>(a, b_weight) - product<Wide<7>>(b, a_weight));
}

RationalPoint rational(const LatticePoint& p);
RationalPoint rational(const EdgePoint& point);
/// @pre det3 of the normals is not 0
RationalPoint rational(const Plane& a, const Plane& b, const Plane& c);

/// Where a point lies: 1 above the plane, 0 on it, -1 below it. n . numerators - w * offset: 32 S^9
/// as det4, 9b + 6 bits; 267 for b = 29. For a three-plane point that is tested against several
/// planes this is faster than side_of_plane() of four planes, and it serves mixed points. A filter
/// was slower: the conversions to double cost more than the products.
int side_of_plane(const RationalPoint& point, const Plane& plane);

/// The point is rounded to whole multiples of 2^-24 step, ties up: b + 24 bits, 53 for b = 29, so
/// that a double holds it. Numerators have 7b + 4 + 24 bits; 231 for b = 29.
/// Depends on the point alone, not on the planes that name it; moves along with whole steps.
/// @pre the point lies in the cube
inline constexpr int kFileBits = 24;
using FilePoint = glm::vec<3, std::int64_t, glm::defaultp>;  ///< in 2^-24 step
FilePoint round_for_file(const RationalPoint& point);
/// The same, faster. @param moved  whether rounding moved the point
/// @pre the point lies between p and q
FilePoint round_for_file(const EdgePoint& point, bool& moved);
/// Whether rounding did not move the point. Both sides of the comparison have at most 231 bits.
/// @param rounded  round_for_file() of the point
bool is_file_point(const RationalPoint& point, const FilePoint& rounded);
constexpr FilePoint file_point(const LatticePoint& p) {
  return FilePoint(p) << FilePoint(kFileBits);
}

/// The point rounded to whole multiples of 2^-64 step, ties up, for integrals: b + 64 bits, 93 for
/// b = 29. Numerators have 7b + 4 + 64 bits; 271 for b = 29.
inline constexpr int kFineBits = 64;
using FinePoint = std::array<Int128, 3>;  ///< in 2^-64 step
FinePoint round_fine(const RationalPoint& point);
constexpr FinePoint fine_point(const LatticePoint& p) {
  return {Int128{p.x} * (Int128{1} << kFineBits), Int128{p.y} * (Int128{1} << kFineBits),
          Int128{p.z} * (Int128{1} << kFineBits)};
}

}  // namespace strata::exact
