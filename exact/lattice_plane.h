#pragma once

// Bounds in this room: S = 2^b is the side of a cube that holds all lattice points and the origin
// (0, 0, 0). The types suffice for b = kMostSideBits: |coordinate| <= 2^28, which is what
// strata::LatticeMesh allows. "n bits" is of the magnitude, the sign comes on top. Every quantity
// is linear in each coordinate, so it is largest when all points are corners of the cube.

#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>

#include "exact/wide.h"

namespace strata::exact {

inline constexpr int kMostSideBits = 29;

using LatticePoint = glm::ivec3;
using Normal = glm::vec<3, std::int64_t, glm::defaultp>;

#ifdef STRATA_EXACT_NO_FILTERS
inline constexpr bool kFilters =
    false;  ///< every sign comes from integers; results must not change
#else
inline constexpr bool kFilters = true;
#endif

/// The sign of an exact number when its evaluation in double proves it, else 0: undecided.
///
/// `value` is a sum of products. With u = 2^-53, each rounding multiplies what it rounds by at most
/// 1 + u, so when no term meets more than 15 roundings the error is at most
/// ((1 + u)^15 - 1) * P, where P is the sum of the exact terms' magnitudes. `permanent`, computed
/// by the same operations on magnitudes, is at least (1 - u)^15 * P. So the error is below 15.01 u
/// * permanent, and 16 u * permanent = 2^-49 * permanent, a shift of the exponent, is more. Nothing
/// underflows, since all leaves are whole numbers, and nothing overflows: 32 S^9 < 2^270.
inline int filtered_sign(double value, double permanent) {
  const double bound = 0x1p-49 * permanent;
  return (value > bound) - (value < -bound);
}

/// Twice the area vector of (a, b, c): (b - a) x (c - a). Each component is twice the area of a
/// triangle's shadow in a square, at most S^2: 2b + 1 bits; 59 for b = 29. For b = 26 it is a whole
/// number up to 2^52 and exact in a double.
constexpr Normal normal_of(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
  const Normal u(b - a), v(c - a);  // differences up to S: b + 1 bits
  return {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
}

/// n . v for a normal and a difference of lattice points. At most 4 S^3, which the largest
/// determinant of three rows of +-1 attains: 3b + 3 bits; 90 for b = 29.
constexpr Int128 dot(const Normal& n, const LatticePoint& v) {
  return Int128{n.x} * v.x + Int128{n.y} * v.y + Int128{n.z} * v.z;
}

/// The plane through three lattice points, counter-clockwise as seen from its upper side.
struct Plane {
  Normal normal;
  LatticePoint base;  ///< a point of it

  /// n . (base - origin). At most 2 S^3, six times the largest tetrahedron in a cube: 3b + 2 bits;
  /// 89 for b = 29. @pre the origin lies in the cube
  constexpr Int128 offset(const LatticePoint& origin = LatticePoint(0)) const {
    return dot(normal, base - origin);
  }
};

constexpr Plane plane_through(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
  return {normal_of(a, b, c), a};
}

/// n . (p - base): how far p lies above the plane, times |n|. At most 2 S^3 as orient3d: 3b + 2
/// bits; 89 for b = 29.
constexpr Int128 height(const Plane& plane, const LatticePoint& p) {
  return dot(plane.normal, p - plane.base);
}

/// The sign of ((b - a) x (c - a)) . (d - a): 1 when d sees (a, b, c) counter-clockwise, 0 when the
/// four points are in one plane. Needs no filter: it takes a few nanoseconds.
constexpr int orient3d(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c,
                       const LatticePoint& d) {
  return sign_of(height(plane_through(a, b, c), d));
}

/// Extent in steps up to which orient3d_in_double() is exact.
inline constexpr std::int32_t kDoubleExtent = 1 << 17;

/// The same sign by plain doubles, without a filter, for SIMD over small triangles.
/// @pre (a, b, c) spans at most L = 2^17 steps along each axis and d lies at most 2 L steps from a
/// along each axis, as the vertices of two triangles of this size do whose boxes meet.
/// Why it is exact: components of the normal are at most L^2 = 2^34, their products with d - a at
/// most 2^34 * 2^18 = 2^52, a sum of two at most 2^53: all exact. The last sum is rounded once, and
/// rounding keeps signs and zeros.
inline int orient3d_in_double(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c,
                              const LatticePoint& d) {
  using Vec = glm::vec<3, double, glm::defaultp>;
  const Vec u(b - a), v(c - a), w(d - a);
  const double x = u.y * v.z - u.z * v.y, y = u.z * v.x - u.x * v.z, z = u.x * v.y - u.y * v.x;
  const double value = (x * w.x + y * w.y) + z * w.z;
  return (value > 0) - (value < 0);
}

}  // namespace strata::exact
