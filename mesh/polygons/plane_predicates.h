#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <glm/vec2.hpp>

namespace strata {

/// The exact sign of twice the area of the triangle (a, b, c): 1 for a left turn, -1 for a right
/// turn, 0 when the points are on a line. A floating-point filter decides most cases; the others
/// are computed as an expansion (J. R. Shewchuk, "Adaptive precision floating-point arithmetic and
/// fast robust geometric predicates", 1997). @pre finite, no product overflows
[[nodiscard]] inline int orient(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  const double acx = a.x - c.x, bcy = b.y - c.y, acy = a.y - c.y, bcx = b.x - c.x;
  const double left = acx * bcy, right = acy * bcx;
  const double det = left - right;
  const double bound = 3.3306690738754716e-16 * (std::abs(left) + std::abs(right));
  if (det > bound) return 1;
  if (-det > bound) return -1;
  // Points on a line along an axis are common. Their differences are exact zeros.
  if ((acx == 0 || bcy == 0) && (acy == 0 || bcx == 0)) return 0;
  if (det == 0 && acx + c.x == a.x && bcy + c.y == b.y && acy + c.y == a.y && bcx + c.x == b.x &&
      a.x - acx == c.x && b.y - bcy == c.y && a.y - acy == c.y && b.x - bcx == c.x) {
    const double left_rest = std::fma(acx, bcy, -left), right_rest = std::fma(acy, bcx, -right);
    return left_rest > right_rest ? 1 : left_rest < right_rest ? -1 : 0;
  }
  // The determinant's six products as an expansion: parts that do not overlap, smallest first.
  const std::array<std::array<double, 2>, 6> factors{
      {{a.x, b.y}, {-a.x, c.y}, {-c.x, b.y}, {-a.y, b.x}, {a.y, c.x}, {c.y, b.x}}};
  std::array<double, 12> sum{};
  std::size_t parts = 0;
  for (const auto& [x, y] : factors) {
    const double product = x * y;
    for (const double term : {std::fma(x, y, -product), product}) {
      double carry = term;
      for (std::size_t i = 0; i < parts; ++i) {
        const double whole = carry + sum[i], other = whole - carry;
        const double rest = (carry - (whole - other)) + (sum[i] - other);
        sum[i] = rest;
        carry = whole;
      }
      sum[parts++] = carry;
    }
  }
  // The largest non-zero part decides the sign.
  for (std::size_t i = parts; i-- > 0;) {
    if (sum[i] != 0) return sum[i] > 0 ? 1 : -1;
  }
  return 0;
}

/// Signed area of a closed contour; positive counter-clockwise.
template <class Points>
[[nodiscard]] double signed_area(const Points& points) {
  if (points.size() < 3) return 0.0;
  const glm::dvec2 origin = points[0];
  double twice = 0.0;
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    const glm::dvec2 p = points[i] - origin, q = points[i + 1] - origin;
    twice += p.x * q.y - p.y * q.x;
  }
  return twice / 2.0;
}

}  // namespace strata
