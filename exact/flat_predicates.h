#pragma once

// Signs in a projection and of rounded points: for triangulations of faces and the check of what is
// written.

#include <glm/vec2.hpp>

#include "exact/cut_points.h"

namespace strata::exact {

/// A rounded point in a projection. Coordinates differ by at most T = 2^53, the side of the cube in
/// 2^-24 step for b = 29 (T = 2^50 for b = 26), and such differences are exact in a double.
using FlatPoint = glm::vec<2, std::int64_t, glm::defaultp>;

/// Twice the area of (a, b, c): at most T^2, 2b + 49 bits; 107 for b = 29.
constexpr Int128 twice_area(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c) {
  const FlatPoint u = b - a, v = c - a;
  return Int128{u.x} * v.y - Int128{u.y} * v.x;
}

/// 1 when (a, b, c) turns left, -1 when it turns right, 0 when the points are on one line. Two
/// multiplications: no filter is faster.
constexpr int orient2d(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c) {
  return sign_of(twice_area(a, b, c));
}

/// The determinant of (x, y, x^2 + y^2) for a, b and c about d. The squares are at most 2 T^2 and
/// the areas beside them at most T^2, so it is at most 6 T^4: 4 (b + 24) + 3 bits; 203 for b = 26,
/// 215 for b = 29.
constexpr Int256 incircle_value(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c,
                                const FlatPoint& d) {
  const FlatPoint u = a - d, v = b - d, w = c - d;
  const auto lift = [](const FlatPoint& p) { return Int128{p.x} * p.x + Int128{p.y} * p.y; };
  const auto area = [](const FlatPoint& p, const FlatPoint& q) {
    return Int128{p.x} * q.y - Int128{p.y} * q.x;
  };
  return product<Int256>(lift(u), area(v, w)) + product<Int256>(lift(v), area(w, u)) +
         product<Int256>(lift(w), area(u, v));
}

namespace filters {

using RealFlat = glm::vec<2, double, glm::defaultp>;

/// For the differences of a, b and c from d. Seven roundings: two of the square, two of the area,
/// of their product, of two sums.
inline int incircle(const RealFlat& u, const RealFlat& v, const RealFlat& w) {
  const auto lift = [](const RealFlat& p) { return p.x * p.x + p.y * p.y; };
  const Bounded vw = minor(v.x, v.y, w.x, w.y), wu = minor(w.x, w.y, u.x, u.y),
                uv = minor(u.x, u.y, v.x, v.y);
  const double up = lift(u), vp = lift(v), wp = lift(w);
  return filtered_sign(up * vw.value + vp * wu.value + wp * uv.value,
                       up * vw.permanent + vp * wu.permanent + wp * uv.permanent);
}

/// Five roundings: two of a minor, of a product, of two sums.
inline int orient3d(const FilePoint& a, const FilePoint& b, const FilePoint& c,
                    const FilePoint& d) {
  return dot(RealNormal(d - a), cross(RealNormal(b - a), RealNormal(c - a))).sign();
}

}  // namespace filters

/// 1 when d lies inside of the circle through a, b and c, -1 when outside, 0 when on it.
/// @pre (a, b, c) turns left
inline int incircle(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c,
                    const FlatPoint& d) {
  if constexpr (kFilters) {
    using filters::RealFlat;
    const int sign = filters::incircle(RealFlat(a - d), RealFlat(b - d), RealFlat(c - d));
    if (sign != 0) return sign;
  }
  return sign_of(incircle_value(a, b, c, d));
}

/// ((b - a) x (c - a)) . (d - a) of rounded points: at most 2 T^3, 3 (b + 24) + 2 bits; 152 for
/// b = 26, 161 for b = 29.
constexpr Int192 orient3d_value(const FilePoint& a, const FilePoint& b, const FilePoint& c,
                                const FilePoint& d) {
  return dot(d - a, cross(b - a, c - a));
}

/// As orient3d() of lattice points.
inline int orient3d(const FilePoint& a, const FilePoint& b, const FilePoint& c,
                    const FilePoint& d) {
  if constexpr (kFilters) {
    if (const int sign = filters::orient3d(a, b, c, d); sign != 0) return sign;
  }
  return sign_of(orient3d_value(a, b, c, d));
}

/// The determinant of the rows (u, v, w) of three exact points in the projection along u and v,
/// axes 0 to 2. Each row is at most (12 S^7, 12 S^7, 4 S^6), the determinant at most 6 times the
/// product: 3456 S^20, 20b + 12 bits; 592 for b = 29.
Int640 orient2d_value(const RationalPoint& a, const RationalPoint& b, const RationalPoint& c, int u,
                      int v);

/// As orient2d(), of exact points: for faces that are not simple polygons once they are rounded.
int orient2d(const RationalPoint& a, const RationalPoint& b, const RationalPoint& c, int u, int v);

}  // namespace strata::exact
