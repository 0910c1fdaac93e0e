#include "mesh/check/triangles_meet.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "exact/flat_predicates.h"

// Source: Guigue, Devillers: Fast and robust triangle-triangle overlap test using orientation
// predicates, 2003: two orientations order the ends of the segments that two triangles cut out of
// the line of their planes. We differ: which vertices and edges the shared points are is told too,
// and triangles without area are allowed.

namespace strata {
namespace {

using exact::FilePoint;
using exact::FlatPoint;

enum class Extent : std::uint8_t { kEmpty, kPoint, kSegment };

bool before(const FilePoint& p, const FilePoint& q) {
  return std::tie(p.x, p.y, p.z) < std::tie(q.x, q.y, q.z);
}

// As seen along an axis.
FlatPoint without(const FilePoint& p, int axis) { return {p[(axis + 1) % 3], p[(axis + 2) % 3]}; }

// The signs of the heights of a triangle's vertices over a plane.
struct Sides {
  std::array<int, 3> sign{};

  [[nodiscard]] bool above() const { return sign[0] > 0 || sign[1] > 0 || sign[2] > 0; }
  [[nodiscard]] bool below() const { return sign[0] < 0 || sign[1] < 0 || sign[2] < 0; }
  [[nodiscard]] int on() const { return (sign[0] == 0) + (sign[1] == 0) + (sign[2] == 0); }
};

// The vertices of `t` that are vertices of `other`, and how many positions these are.
struct Common {
  std::array<bool, 3> is_common{};
  int positions = 0;

  Common(const TriangleCorners& t, const TriangleCorners& other) {
    for (std::size_t i = 0; i < 3; ++i) {
      is_common[i] = t[i] == other[0] || t[i] == other[1] || t[i] == other[2];
      bool first = is_common[i];
      for (std::size_t j = 0; j < i; ++j) first = first && t[j] != t[i];
      positions += first;
    }
  }
};

// The signs that evaluation in double proves; 0 for the others. Roundings as in
// filters::orient3d().
Sides quick_sides(const TriangleCorners& t, const Common& common, const TriangleCorners& plane) {
  Sides result;
  if constexpr (!exact::kFilters) return result;
  using exact::filters::RealNormal;
  const exact::filters::BoundedCross normal =
      exact::filters::cross(RealNormal(plane[1] - plane[0]), RealNormal(plane[2] - plane[0]));
  for (std::size_t i = 0; i < 3; ++i) {
    if (common.is_common[i]) continue;
    result.sign[i] = exact::filters::dot(RealNormal(t[i] - plane[0]), normal).sign();
  }
  return result;
}

Meeting shared(int positions) {
  return positions == 0   ? Meeting::kDisjoint
         : positions == 1 ? Meeting::kSharedVertex
                          : Meeting::kSharedEdge;
}

// Most pairs: the triangle lies on one side of the plane and reaches it in common vertices only.
bool settled(const Sides& side, const Common& common) {
  if (side.above() == side.below()) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    if (side.sign[i] == 0 && !common.is_common[i]) return false;
  }
  return true;
}

// The axis along which a triangle has its largest shadow, nearly.
int widest_axis(const TriangleCorners& t) {
  using exact::filters::RealNormal;
  const exact::filters::BoundedCross n =
      exact::filters::cross(RealNormal(t[1] - t[0]), RealNormal(t[2] - t[0]));
  const double x = std::abs(n.x.value), y = std::abs(n.y.value), z = std::abs(n.z.value);
  return x >= y ? (x >= z ? 0 : 2) : (y >= z ? 1 : 2);
}

// For pairs in one plane, or nearly. Seen along an axis, the line of an edge of `t` has `t` on one
// side and `other` on the other one, but for vertices that are ends of the edge: so does a plane
// through the edge.
bool quickly_apart(const TriangleCorners& t, const TriangleCorners& other, const Common& common) {
  using Real = glm::vec<2, double, glm::defaultp>;
  const int axis = widest_axis(t);
  const auto turn = [axis](const FilePoint& p, const FilePoint& q, const FilePoint& r) {
    const Real u(without(q - p, axis)), v(without(r - p, axis));
    return exact::filters::minor(u.x, u.y, v.x, v.y).sign();
  };
  const int inside = turn(t[0], t[1], t[2]);
  if (inside == 0) return false;
  const auto apart = [&](const FilePoint& p, const FilePoint& q) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (common.is_common[k] ? other[k] != p && other[k] != q
                              : inside * turn(p, q, other[k]) >= 0) {
        return false;
      }
    }
    return common.positions < 3;
  };
  return apart(t[0], t[1]) || apart(t[1], t[2]) || apart(t[2], t[0]);
}

void complete(const TriangleCorners& t, const Common& common, const TriangleCorners& plane,
              Sides& sides) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (common.is_common[i] || sides.sign[i] != 0) continue;
    sides.sign[i] = exact::sign_of(exact::orient3d_value(plane[0], plane[1], plane[2], t[i]));
  }
}

// The shared points are known to be a point or a segment, and a segment that has two common
// vertices is known to end there. A common vertex is a shared point.
Meeting by_extent(Extent extent, int common) {
  if (extent == Extent::kEmpty) return Meeting::kDisjoint;
  const int all = extent == Extent::kPoint ? 1 : 2;
  return common == all ? shared(all) : Meeting::kTouch;
}

// --- two planes ------------------------------------------------------------------------------

// An edge on which the height over the plane falls, or rises. All edges that fall have the same
// point of the plane, likewise all that rise.
std::pair<FilePoint, FilePoint> sloping(const TriangleCorners& t, const Sides& side, bool falls) {
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t next = (i + 1) % 3;
    if (falls ? side.sign[i] > side.sign[next] : side.sign[i] < side.sign[next]) {
      return {t[i], t[next]};
    }
  }
  return {t[0], t[1]};
}

// Both triangles reach the plane of the other, which is another plane. Each cuts a segment out of
// the common line. With the direction n_a x n_b, that of `a` begins where its height over b's plane
// rises as one goes round, and ends where it falls; that of `b` the other way round. order_on_line
// of exact/cut_points.h: an orientation tells the order of two such points.
Meeting in_two_planes(const TriangleCorners& a, const Sides& side_a, const TriangleCorners& b,
                      const Sides& side_b, int common) {
  const auto order = [&](bool falls) {
    const auto [p, q] = sloping(a, side_a, falls);
    const auto [r, s] = sloping(b, side_b, falls);
    return exact::orient3d(p, q, r, s);
  };
  const int last_a_first_b = order(true);  // -1: the end of a comes after the beginning of b
  if (last_a_first_b > 0) return Meeting::kDisjoint;
  const int first_a_last_b = order(false);  // 1: the beginning of a comes before the end of b
  if (first_a_last_b < 0) return Meeting::kDisjoint;
  const auto is_point = [](const Sides& side) {
    return side.on() == 1 && side.above() != side.below();
  };
  if (last_a_first_b == 0 || first_a_last_b == 0 || is_point(side_a) || is_point(side_b)) {
    return by_extent(Extent::kPoint, common);
  }
  const auto passes = [](const Sides& side) { return side.above() && side.below(); };
  if (passes(side_a) && passes(side_b)) return Meeting::kCross;
  return by_extent(Extent::kSegment, common);
}

// --- one plane -------------------------------------------------------------------------------

// An axis along which three points are seen with an area, -1 if they are on one line.
int axis_of(const FilePoint& a, const FilePoint& b, const FilePoint& c) {
  for (int axis = 0; axis < 3; ++axis) {
    if (exact::orient2d(without(a, axis), without(b, axis), without(c, axis)) != 0) return axis;
  }
  return -1;
}

struct Segment {
  FilePoint p, q;
};

// Of points on one line.
Segment hull(const FilePoint* begin, const FilePoint* end) {
  const auto [low, high] = std::minmax_element(begin, end, before);
  return {*low, *high};
}

Segment on_common_line(const Segment& s, const Segment& t) {
  const FilePoint s_low = before(s.p, s.q) ? s.p : s.q, s_high = before(s.p, s.q) ? s.q : s.p;
  const FilePoint t_low = before(t.p, t.q) ? t.p : t.q, t_high = before(t.p, t.q) ? t.q : t.p;
  return {before(s_low, t_low) ? t_low : s_low, before(s_high, t_high) ? s_high : t_high};
}

Extent extent(const Segment& ordered) {
  return ordered.p == ordered.q         ? Extent::kPoint
         : before(ordered.p, ordered.q) ? Extent::kSegment
                                        : Extent::kEmpty;
}

// Counter-clockwise as seen along an axis. @pre it has an area there
TriangleCorners turned(const TriangleCorners& t, int axis) {
  const int turn = exact::orient2d(without(t[0], axis), without(t[1], axis), without(t[2], axis));
  return turn > 0 ? t : TriangleCorners{t[0], t[2], t[1]};
}

// Whether all points lie to the right of the line of a segment, or on it. Then `result` is how far
// those on the line and the segment meet.
bool separates(const Segment& edge, const FilePoint* begin, const FilePoint* end, int axis,
               Extent& result) {
  std::array<FilePoint, 3> on;
  std::size_t count = 0;
  for (const FilePoint* point = begin; point != end; ++point) {
    const int turn =
        exact::orient2d(without(edge.p, axis), without(edge.q, axis), without(*point, axis));
    if (turn > 0) return false;
    if (turn == 0) on[count++] = *point;
  }
  result = Extent::kEmpty;
  if (count > 0) result = extent(on_common_line(edge, hull(on.data(), on.data() + count)));
  return true;
}

// Two convex sets have no inner point in common if and only if the line of an edge has them on
// different sides.
Meeting in_one_plane(TriangleCorners a, TriangleCorners b, int axis, int common) {
  a = turned(a, axis);
  b = turned(b, axis);
  Extent extent = Extent::kEmpty;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t next = (i + 1) % 3;
    if (separates({a[i], a[next]}, b.data(), b.data() + 3, axis, extent) ||
        separates({b[i], b[next]}, a.data(), a.data() + 3, axis, extent)) {
      return by_extent(extent, common);
    }
  }
  return Meeting::kOverlap;
}

// --- triangles without area ------------------------------------------------------------------

// A segment in the plane of a triangle.
Extent segment_in_plane(const Segment& segment, TriangleCorners t, int axis) {
  t = turned(t, axis);
  const FilePoint ends[2] = {segment.p, segment.q};
  Extent result = Extent::kEmpty;
  for (std::size_t i = 0; i < 3; ++i) {
    if (separates({t[i], t[(i + 1) % 3]}, ends, ends + 2, axis, result)) return result;
  }
  if (segment.p == segment.q) return Extent::kPoint;
  if (separates(segment, t.data(), t.data() + 3, axis, result) ||
      separates({segment.q, segment.p}, t.data(), t.data() + 3, axis, result)) {
    return result;
  }
  return Extent::kSegment;
}

// A segment or point, and a triangle that has an area along `axis`.
Extent segment_and_triangle(const Segment& segment, const TriangleCorners& t, int axis) {
  const int p = exact::orient3d(t[0], t[1], t[2], segment.p);
  const int q = exact::orient3d(t[0], t[1], t[2], segment.q);
  if (p == 0 && q == 0) return segment_in_plane(segment, t, axis);
  if (p * q > 0) return Extent::kEmpty;
  bool left = false, right = false;  // of the line of the segment
  for (std::size_t i = 0; i < 3; ++i) {
    const int turn = exact::orient3d(segment.p, segment.q, t[i], t[(i + 1) % 3]);
    left = left || turn > 0;
    right = right || turn < 0;
  }
  return left && right ? Extent::kEmpty : Extent::kPoint;
}

Meeting two_segments(const Segment& s, const Segment& t, const TriangleCorners& a,
                     const TriangleCorners& b, int common) {
  const int first = axis_of(s.p, s.q, t.p), axis = first >= 0 ? first : axis_of(s.p, s.q, t.q);
  const bool s_is_point = s.p == s.q;
  if (axis < 0 && !(s_is_point && axis_of(s.p, t.p, t.q) >= 0)) {  // all on one line
    const Segment both = on_common_line(s, t);
    const auto is_common = [&](const FilePoint& p) {
      return std::ranges::find(a, p) != a.end() && std::ranges::find(b, p) != b.end();
    };
    if (extent(both) != Extent::kSegment) return by_extent(extent(both), common);
    return is_common(both.p) && is_common(both.q) ? Meeting::kSharedEdge : Meeting::kTouch;
  }
  if (axis < 0 || t.p == t.q || exact::orient3d(s.p, s.q, t.p, t.q) != 0) {
    return Meeting::kDisjoint;
  }
  const auto turn = [axis](const Segment& line, const FilePoint& point) {
    return exact::orient2d(without(line.p, axis), without(line.q, axis), without(point, axis));
  };
  if (turn(s, t.p) * turn(s, t.q) > 0 || turn(t, s.p) * turn(t, s.q) > 0) return Meeting::kDisjoint;
  return by_extent(Extent::kPoint, common);
}

// All vertices of one lie in the plane of the other, or have none.
Meeting flat(const TriangleCorners& a, const TriangleCorners& b, int common) {
  const int axis_a = axis_of(a[0], a[1], a[2]), axis_b = axis_of(b[0], b[1], b[2]);
  if (axis_a >= 0 && axis_b >= 0) return in_one_plane(a, b, axis_a, common);
  const Segment hull_a = hull(a.data(), a.data() + 3), hull_b = hull(b.data(), b.data() + 3);
  if (axis_b >= 0) return by_extent(segment_and_triangle(hull_a, b, axis_b), common);
  if (axis_a >= 0) return by_extent(segment_and_triangle(hull_b, a, axis_a), common);
  return two_segments(hull_a, hull_b, a, b, common);
}

// --- where ---------------------------------------------------------------------------------------

// Points that two triangles share, as seen from an origin; their mean.
struct Mean {
  FilePoint origin;
  glm::dvec3 sum{0.0};
  int count = 0;

  void add(const FilePoint& p) { add(glm::dvec3(p - origin)); }
  void add(const glm::dvec3& p) {
    sum += p;
    ++count;
  }
  // The point of an edge whose ends have distances of these proportions from it.
  void add(const FilePoint& p, const FilePoint& q, double at_p, double at_q) {
    const glm::dvec3 from(p - origin), to(q - origin);
    add(from + (to - from) * (at_p / (at_p - at_q)));
  }
};

bool opposite(int s, int t) { return s * t < 0; }

// The vertices of `t` that lie in `other`, and where edges of `t` pass through it.
void add_points(const TriangleCorners& t, const TriangleCorners& other, Mean& mean) {
  const auto height = [&](const FilePoint& p) {
    return exact::orient3d_value(other[0], other[1], other[2], p);
  };
  for (std::size_t i = 0; i < 3; ++i) {
    const FilePoint &p = t[i], &q = t[(i + 1) % 3];
    if (triangles_meet({p, p, p}, other) != Meeting::kDisjoint) mean.add(p);
    const exact::Int192 at_p = height(p), at_q = height(q);
    if (!opposite(exact::sign_of(at_p), exact::sign_of(at_q))) continue;
    if (triangles_meet({p, q, q}, other) == Meeting::kDisjoint) continue;
    mean.add(p, q, exact::to_double(at_p), exact::to_double(at_q));
  }
}

// Where edges of both cross each other in a plane.
void add_crossings(const Segment& s, const Segment& t, Mean& mean) {
  const int first = axis_of(s.p, s.q, t.p), axis = first >= 0 ? first : axis_of(s.p, s.q, t.q);
  if (axis < 0 || exact::orient3d(s.p, s.q, t.p, t.q) != 0) return;
  const auto area = [axis](const Segment& line, const FilePoint& p) {
    return exact::twice_area(without(line.p, axis), without(line.q, axis), without(p, axis));
  };
  const exact::Int128 p = area(t, s.p), q = area(t, s.q);
  if (!opposite(exact::sign_of(p), exact::sign_of(q))) return;
  if (!opposite(exact::sign_of(area(s, t.p)), exact::sign_of(area(s, t.q)))) return;
  mean.add(s.p, s.q, static_cast<double>(p), static_cast<double>(q));
}

}  // namespace

Meeting triangles_meet(const TriangleCorners& a, const TriangleCorners& b) {
  const Common common_a(a, b), common_b(b, a);
  Sides side_a = quick_sides(a, common_a, b);
  if (settled(side_a, common_a)) return shared(common_a.positions);
  Sides side_b = quick_sides(b, common_b, a);
  if (settled(side_b, common_b)) return shared(common_b.positions);
  if (exact::kFilters && side_a.on() == 3 &&
      (quickly_apart(a, b, common_b) || quickly_apart(b, a, common_a))) {
    return shared(common_a.positions);
  }
  complete(a, common_a, b, side_a);
  if (settled(side_a, common_a)) return shared(common_a.positions);
  complete(b, common_b, a, side_b);
  if (settled(side_b, common_b)) return shared(common_b.positions);
  if (side_a.on() == 3 || side_b.on() == 3) return flat(a, b, common_a.positions);
  return in_two_planes(a, side_a, b, side_b, common_a.positions);
}

glm::dvec3 meeting_place(const TriangleCorners& a, const TriangleCorners& b) {
  Mean mean{a[0]};
  add_points(a, b, mean);
  add_points(b, a, mean);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      add_crossings({a[i], a[(i + 1) % 3]}, {b[j], b[(j + 1) % 3]}, mean);
    }
  }
  return glm::dvec3(mean.origin) + mean.sum / static_cast<double>(std::max(mean.count, 1));
}

}  // namespace strata
