#pragma once

// Determinants of planes: what three-plane points are made of.

#include <array>

#include "exact/lattice_plane.h"

namespace strata::exact {

using Cross = std::array<Int128, 3>;

/// m x n, the direction of the line of two planes. At most 2 S^4 a component: 4b + 2 bits; 118 for
/// b = 29.
constexpr Cross cross(const Normal& m, const Normal& n) {
  return {Int128{m.y} * n.z - Int128{m.z} * n.y, Int128{m.z} * n.x - Int128{m.x} * n.z,
          Int128{m.x} * n.y - Int128{m.y} * n.x};
}

/// m . n: at most 3 S^4, 4b + 2 bits; 118 for b = 29.
constexpr Int128 dot(const Normal& m, const Normal& n) {
  return Int128{m.x} * n.x + Int128{m.y} * n.y + Int128{m.z} * n.z;
}

/// c . v for the cross product v of two normals: a determinant of three rows up to S^2, at most
/// 4 S^6 (Hadamard; attained): 6b + 3 bits; 177 for b = 29.
constexpr Int192 dot(const Normal& c, const Cross& v) {
  return product<Int192>(c.x, v[0]) + product<Int192>(c.y, v[1]) + product<Int192>(c.z, v[2]);
}

/// The determinant of three normals, c . (a x b): 6b + 3 bits; 177 for b = 29.
constexpr Int192 det3(const Normal& a, const Normal& b, const Normal& c) {
  return dot(c, cross(a, b));
}

/// How far the point of the planes a, b, c lies above d, times |n_d|, and the determinant that both
/// were multiplied by.
struct PlaneQuad {
  Int320 height;  ///< at most 4 * 2 S^3 * 4 S^6 = 32 S^9: 9b + 6 bits; 267 for b = 29
  Int192 weight;  ///< det3(a, b, c)
};

/// Offsets are about the base of a, so that one of the four terms vanishes. By Cramer's rule the
/// point is (d_b (c x a) + d_c (a x b)) / det3(a, b, c); in n_d . point - d_d all triple products
/// are turned round until they share a x d and a x b.
constexpr PlaneQuad det4(const Plane& a, const Plane& b, const Plane& c, const Plane& d) {
  const Cross ad = cross(a.normal, d.normal), ab = cross(a.normal, b.normal);
  PlaneQuad result;
  result.weight = dot(c.normal, ab);
  result.height = product<Int320>(b.offset(a.base), dot(c.normal, ad)) -
                  product<Int320>(c.offset(a.base), dot(b.normal, ad)) -
                  product<Int320>(d.offset(a.base), result.weight);
  return result;
}

namespace filters {

/// A number in double and the sum of its terms' magnitudes: see filtered_sign().
struct Bounded {
  double value, permanent;

  int sign() const { return filtered_sign(value, permanent); }
};

struct BoundedCross {
  Bounded x, y, z;
};

using RealNormal = glm::vec<3, double, glm::defaultp>;

/// One rounding a component; none for b <= 26.
inline RealNormal real(const Normal& n) { return RealNormal(n); }

/// Four roundings: of the two components, of their product, of the difference.
inline Bounded minor(double a, double b, double c, double d) {
  const double first = a * d, second = b * c;
  return {first - second, std::abs(first) + std::abs(second)};
}

inline BoundedCross cross(const RealNormal& m, const RealNormal& n) {
  return {minor(m.y, m.z, n.y, n.z), minor(m.z, m.x, n.z, n.x), minor(m.x, m.y, n.x, n.y)};
}

/// Eight roundings: four of the cross product, of c's component, of the product, of two sums.
inline Bounded dot(const RealNormal& c, const BoundedCross& v) {
  return {c.x * v.x.value + c.y * v.y.value + c.z * v.z.value, std::abs(c.x) * v.x.permanent +
                                                                   std::abs(c.y) * v.y.permanent +
                                                                   std::abs(c.z) * v.z.permanent};
}

/// Four roundings: of n's component, of the product, of two sums. Differences of lattice points are
/// exact.
inline Bounded offset(const RealNormal& n, const LatticePoint& v) {
  const RealNormal w(v);
  const double x = n.x * w.x, y = n.y * w.y, z = n.z * w.z;
  return {x + y + z, std::abs(x) + std::abs(y) + std::abs(z)};
}

struct QuadSigns {
  int height, weight;  ///< 0: undecided
};

/// Fifteen roundings for the height: eight of det3, four of the offset, of their product, of two
/// sums. Eight for the weight.
inline QuadSigns det4(const Plane& a, const Plane& b, const Plane& c, const Plane& d) {
  const RealNormal na = real(a.normal), nb = real(b.normal), nc = real(c.normal),
                   nd = real(d.normal);
  const BoundedCross ad = cross(na, nd);
  const Bounded abc = dot(nc, cross(na, nb)), cad = dot(nc, ad), bad = dot(nb, ad);
  const Bounded ob = offset(nb, b.base - a.base), oc = offset(nc, c.base - a.base),
                od = offset(nd, d.base - a.base);
  const Bounded height{
      ob.value * cad.value - oc.value * bad.value - od.value * abc.value,
      ob.permanent * cad.permanent + oc.permanent * bad.permanent + od.permanent * abc.permanent};
  return {height.sign(), abc.sign()};
}

inline int det3_sign(const Normal& a, const Normal& b, const Normal& c) {
  return dot(real(c), cross(real(a), real(b))).sign();
}

}  // namespace filters

/// The sign of det3(a, b, c): 0 when the normals are in one plane, so that the three planes have no
/// single point.
inline int det3_sign(const Normal& a, const Normal& b, const Normal& c) {
  if constexpr (kFilters) {
    if (const int sign = filters::det3_sign(a, b, c); sign != 0) return sign;
  }
  return sign_of(det3(a, b, c));
}

/// Where the point of the planes a, b, c lies: 1 above d, 0 on it, -1 below it.
/// @pre det3(a, b, c) is not 0
inline int side_of_plane(const Plane& a, const Plane& b, const Plane& c, const Plane& d) {
  if constexpr (kFilters) {
    const filters::QuadSigns signs = filters::det4(a, b, c, d);
    if (signs.height * signs.weight != 0) return signs.height * signs.weight;
  }
  const PlaneQuad quad = det4(a, b, c, d);
  return sign_of(quad.height) * sign_of(quad.weight);
}

/// The order of the points (a, b, c) and (a, b, d) of the line of the planes a and b: -1 when the
/// first comes before the second in the direction cross(n_a, n_b), 0 when they are one point.
/// Going from the first to the second by t times that direction, the height over d rises by
/// t * det3(a, b, d) and becomes 0. @pre det3(a, b, c) and det3(a, b, d) are not 0
inline int order_on_line(const Plane& a, const Plane& b, const Plane& c, const Plane& d) {
  return side_of_plane(a, b, c, d) * det3_sign(a.normal, b.normal, d.normal);
}

/// Whether two three-plane points are one: all planes of the second pass through the first.
/// @pre det3 of each three is not 0
inline bool same_point(const std::array<Plane, 3>& p, const std::array<Plane, 3>& q) {
  return side_of_plane(p[0], p[1], p[2], q[0]) == 0 && side_of_plane(p[0], p[1], p[2], q[1]) == 0 &&
         side_of_plane(p[0], p[1], p[2], q[2]) == 0;
}

}  // namespace strata::exact
