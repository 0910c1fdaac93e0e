#pragma once

// Orders by angle: of the sheets around an edge, and of the edges around a point of a plane.

#include "exact/determinants.h"

namespace strata::exact {

/// The order of two angles in [0, 360) degrees from a direction `from`: -1 when a comes first, 0
/// when a and b point the same way.
/// `turn(x, y)` is the sign of the turn from x to y, 0 when they are parallel; `along(x, y)` is
/// then 1 when they point the same way, -1 when they are opposite.
template <class Direction, class Turn, class Along>
int order_by_angle(const Direction& from, const Direction& a, const Direction& b, Turn&& turn,
                   Along&& along) {
  const auto sector = [&](const Direction& x) {  // 0: the same way, 1: left, 2: opposite, 3: right
    const int side = turn(from, x);
    return side > 0 ? 1 : side < 0 ? 3 : along(from, x) > 0 ? 0 : 2;
  };
  const int sector_a = sector(a), sector_b = sector(b);
  if (sector_a != sector_b) return sector_a < sector_b ? -1 : 1;
  return -turn(a, b);  // less than 180 degrees apart
}

/// The axis that sheets are turned about: one coordinate of its direction that is not 0 tells all
/// multiples of the direction apart.
struct TurningAxis {
  int coordinate;
  int sign;
};

/// @pre the direction is not zero
constexpr TurningAxis turning_axis(const Cross& direction) {
  for (int k = 0; k < 3; ++k) {
    const int sign = sign_of(direction[static_cast<std::size_t>(k)]);
    if (sign != 0) return {k, sign};
  }
  return {0, 0};
}
constexpr TurningAxis turning_axis(const LatticePoint& direction) {
  return turning_axis(Cross{direction.x, direction.y, direction.z});
}

/// The sheets around an edge, ordered counter-clockwise as seen against the direction of the edge.
/// A half-plane that the edge bounds is given by a normal: the half-plane lies a quarter turn from
/// it, always in the same direction, so normals and half-planes have the same order. A triangle
/// (p, q, r) at its edge from p to q has normal_of(p, q, r); a triangle that contains the edge is
/// two half-planes, n and -n.
/// Cross and dot products of normals are at most 2 S^4 and 3 S^4: 4b + 2 bits; 118 for b = 29. Two
/// multiplications are faster than a filter.
class SheetOrder {
 public:
  /// @pre all normals are perpendicular to the axis, and not zero
  SheetOrder(TurningAxis axis, const Normal& from) : axis_(axis), from_(from) {}

  /// -1: a comes first; 0: a and b are one half-plane.
  int operator()(const Normal& a, const Normal& b) const {
    return order_by_angle(
        from_, a, b, [this](const Normal& x, const Normal& y) { return turn(x, y); },
        [](const Normal& x, const Normal& y) { return sign_of(dot(x, y)); });
  }

 private:
  int turn(const Normal& m, const Normal& n) const {
    const int i = (axis_.coordinate + 1) % 3, j = (axis_.coordinate + 2) % 3;
    return sign_of(Int128{m[i]} * n[j] - Int128{m[j]} * n[i]) * axis_.sign;
  }

  TurningAxis axis_;
  Normal from_;
};

/// A direction within a plane, as it is seen from above the plane along one coordinate axis: the
/// turn from one to another has the sign that it has in the plane. At most 2 S^4 a coordinate:
/// 4b + 2 bits; 118 for b = 29.
struct PlanarDirection {
  Int128 u, v;
};

/// The projection along the coordinate in which the normal is largest.
class PlaneView {
 public:
  explicit PlaneView(const Plane& plane) : normal_(plane.normal) {
    const auto size = [this](int k) { return normal_[k] < 0 ? -normal_[k] : normal_[k]; };
    const int k = size(0) >= size(1) ? (size(0) >= size(2) ? 0 : 2) : (size(1) >= size(2) ? 1 : 2);
    u_ = (k + 1) % 3;
    v_ = (k + 2) % 3;
    if (normal_[k] < 0) std::swap(u_, v_);
  }

  /// An edge of the plane.
  PlanarDirection of(const LatticePoint& along) const { return {along[u_], along[v_]}; }
  /// The line shared with another plane, in the direction cross(n, n_other).
  PlanarDirection of(const Plane& other) const {
    const Cross line = cross(normal_, other.normal);
    return {line[static_cast<std::size_t>(u_)], line[static_cast<std::size_t>(v_)]};
  }
  /// The axes of the projection: counter-clockwise from u to v as seen from above the plane.
  int u() const { return u_; }
  int v() const { return v_; }

 private:
  Normal normal_;
  int u_, v_;
};

/// The turn from x to y: 1 to the left, -1 to the right, 0 when they are parallel. At most
/// 2 (2 S^4)^2 = 8 S^8: 8b + 4 bits; 236 for b = 29. For the lines with planes b and c of a plane a
/// this is the sign of det3(a, b, c).
inline int turn_in_plane(const PlanarDirection& x, const PlanarDirection& y) {
  if constexpr (kFilters) {  // a leaf is rounded once: four roundings a term
    const double first = static_cast<double>(x.u) * static_cast<double>(y.v);
    const double second = static_cast<double>(x.v) * static_cast<double>(y.u);
    const int sign = filtered_sign(first - second, std::abs(first) + std::abs(second));
    if (sign != 0) return sign;
  }
  return sign_of(product<Int256>(x.u, y.v) - product<Int256>(x.v, y.u));
}

/// The order of two directions around a point of a plane, counter-clockwise from `from` as seen
/// from above: -1 when a comes first, 0 when a and b point the same way. @pre none is zero
inline int order_in_plane(const PlanarDirection& from, const PlanarDirection& a,
                          const PlanarDirection& b) {
  return order_by_angle(
      from, a, b, turn_in_plane, [](const PlanarDirection& x, const PlanarDirection& y) {
        return x.u != 0 ? sign_of(x.u) * sign_of(y.u) : sign_of(x.v) * sign_of(y.v);
      });
}

}  // namespace strata::exact
