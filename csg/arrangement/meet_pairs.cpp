#include <algorithm>
#include <array>

#include "csg/arrangement/cut_lines.h"
#include "exact/directions.h"

namespace strata::csg {
namespace {

using exact::EdgePoint;
using exact::Int128;
using exact::LatticePoint;
using exact::Plane;
using Recipe = BoundaryPoints::Recipe;

constexpr int kNowhere = -1;

// What of a triangle a point lies on: a corner, a side, or neither.
struct Place {
  int corner = kNowhere, side = kNowhere;
};

int next(int k) { return k == 2 ? 0 : k + 1; }

// One end of the piece of a line that lies in a triangle.
struct End {
  Place place;
  EdgePoint at;  // on an edge that crosses the other plane
};

struct Ends {
  End low, high;
  int side = kNowhere;  // along which the piece lies
};

class PairMeeter {
 public:
  PairMeeter(const ArrangementInput& input, const BoundaryPoints& points, CutLinesPart& lines)
      : input_(input), points_(points), lines_(lines) {}

  void meet(const BoxPair& pair) {
    const Side a = side_of(pair.first), b = side_of(pair.second);
    const std::array<Int128, 3> a_heights = heights(a, b.plane), b_heights = heights(b, a.plane);
    if (one_side(a_heights) || one_side(b_heights)) return;
    if (a_heights == std::array<Int128, 3>{}) {
      meet_flat(a, b);
      meet_flat(b, a);
    } else {
      meet_across(a, b, ends_of(a, a_heights, false), ends_of(b, b_heights, true));
    }
  }

 private:
  struct Side {
    std::uint32_t triangle;
    glm::uvec3 corners;
    Plane plane;
  };

  const LatticePoint& at(std::uint32_t vertex) const { return input_.vertices[vertex]; }
  Side side_of(std::uint32_t triangle) const {
    return {triangle, input_.triangles[triangle], input_.plane_of(triangle)};
  }
  std::array<Int128, 3> heights(const Side& of, const Plane& plane) const {
    return {height(plane, at(of.corners.x)), height(plane, at(of.corners.y)),
            height(plane, at(of.corners.z))};
  }
  static bool one_side(const std::array<Int128, 3>& h) {
    return (h[0] > 0 && h[1] > 0 && h[2] > 0) || (h[0] < 0 && h[1] < 0 && h[2] < 0);
  }
  std::uint32_t edge(const Side& t, int side) const {
    return input_.edges.edge_of[3 * t.triangle + static_cast<std::uint32_t>(side)];
  }

  Ends ends_of(const Side& t, const std::array<Int128, 3>& heights, bool second) const;
  void meet_across(const Side& a, const Side& b, const Ends& ends_a, const Ends& ends_b);
  std::uint32_t point_of(const Side& a, const Place& on_a, const Side& b, const Place& on_b);
  bool wanted(std::uint32_t from, std::uint32_t to) const;
  void put(const Side& t, const Place& place, std::uint32_t point, bool end_of_cut);
  void put_on_edge(std::uint32_t edge, std::uint32_t point);
  void meet_flat(const Side& a, const Side& b);
  void clip_edge(const Side& a, int side, const Side& b);

  const ArrangementInput& input_;
  const BoundaryPoints& points_;
  CutLinesPart& lines_;
};

// The piece of the line of two planes that lies in the triangle t, whose corners have these heights
// over the other plane. Seen from above t, with the other plane's upper side on the right, the line
// runs up: cross(n_t, n_other). An edge that goes from right to left crosses it at the upper end,
// since triangles turn counter-clockwise. For the second triangle of a pair the line runs the other
// way round: `second`.
Ends PairMeeter::ends_of(const Side& t, const std::array<Int128, 3>& heights, bool second) const {
  Ends ends;
  bool have_low = false, have_high = false;
  const auto take = [&](const End& end, bool high) {
    (high ? ends.high : ends.low) = end;
    (high ? have_high : have_low) = true;
  };
  const auto sign = [&](int k) { return exact::sign_of(heights[static_cast<std::size_t>(k)]); };
  const auto edge_point = [&](int from, int to) {
    return EdgePoint{at(t.corners[from]), at(t.corners[to]),
                     heights[static_cast<std::size_t>(from)],
                     heights[static_cast<std::size_t>(to)]};
  };
  for (int k = 0; k < 3; ++k) {
    const int after = next(k), before = next(after);
    if (sign(k) == 0) {
      const int apart = sign(after) != 0 ? after : before;  // a corner off the plane
      const End end{{k, kNowhere}, edge_point(k, apart)};
      if (sign(after) == 0) {  // the side from k to after lies in the plane
        ends.side = k;
        take(end, sign(before) > 0);
      } else if (sign(before) == 0) {
        take(end, sign(after) < 0);
      } else if (sign(after) == sign(before)) {
        take(end, true);
        take(end, false);
      } else {
        take(end, sign(before) > 0);
      }
    } else if (sign(after) != 0 && sign(after) != sign(k)) {
      take({{kNowhere, k}, edge_point(k, after)}, sign(k) > 0);
    }
  }
  assert(have_low && have_high);
  if (second) std::swap(ends.low, ends.high);
  return ends;
}

void PairMeeter::meet_across(const Side& a, const Side& b, const Ends& ends_a, const Ends& ends_b) {
  const auto order = [](const End& of_a, const End& of_b) {
    return exact::order_on_common_line(of_a.at, of_b.at);
  };
  const int over = order(ends_a.high, ends_b.low), under = order(ends_a.low, ends_b.high);
  if (over < 0 || under > 0) return;
  const Place inside_a{kNowhere, ends_a.side}, inside_b{kNowhere, ends_b.side};
  Place low_a, low_b, high_a, high_b;
  const int low = order(ends_a.low, ends_b.low), high = order(ends_a.high, ends_b.high);
  low_a = low >= 0 ? ends_a.low.place : inside_a;
  low_b = low <= 0 ? ends_b.low.place : inside_b;
  high_a = high <= 0 ? ends_a.high.place : inside_a;
  high_b = high >= 0 ? ends_b.high.place : inside_b;
  if (over == 0) low_a = high_a = ends_a.high.place, low_b = high_b = ends_b.low.place;
  if (under == 0) low_a = high_a = ends_a.low.place, low_b = high_b = ends_b.high.place;
  const std::size_t points_before = lines_.points.size();
  const std::uint32_t from = point_of(a, low_a, b, low_b);
  const bool touch = over == 0 || under == 0;
  const std::uint32_t to = touch ? from : point_of(a, high_a, b, high_b);
  if (!wanted(from, to)) return lines_.points.resize(points_before);
  const bool is_point = from == to;
  put(a, low_a, from, !is_point);
  put(b, low_b, from, !is_point);
  if (is_point) return;
  put(a, high_a, to, true);
  put(b, high_b, to, true);
  if (ends_a.side != kNowhere) lines_.touched_edges.push_back(edge(a, ends_a.side));
  if (ends_b.side != kNowhere) lines_.touched_edges.push_back(edge(b, ends_b.side));
  if (ends_a.side != kNowhere && ends_b.side != kNowhere) return;
  if (ends_a.side != kNowhere) {
    lines_.cuts.push_back({b.triangle, edge(a, ends_a.side), from, to});
  } else if (ends_b.side != kNowhere) {
    lines_.cuts.push_back({a.triangle, edge(b, ends_b.side), from, to});
  } else {
    const auto line = CutLinesPart::kOwn + static_cast<std::uint32_t>(lines_.crossings.size());
    lines_.crossings.push_back(
        {a.triangle, b.triangle, from, to, axis_of(exact::cross(a.plane.normal, b.plane.normal))});
    lines_.cuts.push_back({a.triangle, line, from, to});
    lines_.cuts.push_back({b.triangle, line, from, to});
  }
}

bool PairMeeter::wanted(std::uint32_t from, std::uint32_t to) const {
  if (input_.zone.everywhere()) return true;
  const auto place = [&](std::uint32_t point) {
    return point < CutLinesPart::kOwn ? points_.rounded(point)
                                      : lines_.points[point - CutLinesPart::kOwn].rounded;
  };
  return input_.zone.touches(box_around(place(from), place(to)));
}

std::uint32_t PairMeeter::point_of(const Side& a, const Place& on_a, const Side& b,
                                   const Place& on_b) {
  if (on_a.corner != kNowhere) return a.corners[on_a.corner];
  if (on_b.corner != kNowhere) return b.corners[on_b.corner];
  // One of the two sides crosses the other plane. A side in the plane says nothing.
  const auto crossing = [&](const Side& t, int side, const Side& other) {
    const std::uint32_t p = t.corners[side], q = t.corners[next(side)];
    return lines_.add_point(points_, {BoundaryPoints::Kind::kEdgePlane,
                                      {std::min(p, q), std::max(p, q), other.triangle, 0}});
  };
  const auto crosses = [&](const Side& t, int side, const Side& other) {
    return side != kNowhere && height(other.plane, at(t.corners[side])) != 0;
  };
  return crosses(a, on_a.side, b) ? crossing(a, on_a.side, b) : crossing(b, on_b.side, a);
}

void PairMeeter::put_on_edge(std::uint32_t edge, std::uint32_t point) {
  if (point == input_.edge_from(edge) || point == input_.edge_to(edge)) return;
  lines_.line_points.push_back({edge, point});
  lines_.touched_edges.push_back(edge);
}

void PairMeeter::put(const Side& t, const Place& place, std::uint32_t point, bool end_of_cut) {
  if (place.corner != kNowhere) return;
  if (place.side != kNowhere) {
    put_on_edge(edge(t, place.side), point);
  } else if (!end_of_cut) {
    lines_.contacts.push_back({t.triangle, point});
  }
}

void PairMeeter::meet_flat(const Side& a, const Side& b) {
  for (int side = 0; side < 3; ++side) {
    if (std::ranges::any_of(std::array{0, 1, 2},
                            [&](int k) { return edge(b, k) == edge(a, side); })) {
      continue;
    }
    clip_edge(a, side, b);
  }
}

// The piece of a side of `a` that lies in b, which has the same plane. Along the side p + t (q -
// p), the heights over b's sides change linearly; all are areas below 2^60.
void PairMeeter::clip_edge(const Side& a, int side, const Side& b) {
  const exact::PlaneView view(b.plane);
  const std::uint32_t p = a.corners[side], q = a.corners[next(side)];
  const auto area = [&](std::uint32_t from, std::uint32_t to, std::uint32_t x) {
    const LatticePoint u = at(to) - at(from), v = at(x) - at(from);
    return std::int64_t{u[view.u()]} * v[view.v()] - std::int64_t{u[view.v()]} * v[view.u()];
  };
  struct Fraction {
    std::int64_t part = 0, whole = 1;
    Place place;  // of b
  };
  const auto less = [](const Fraction& x, const Fraction& y) {
    return Int128{x.part} * y.whole < Int128{y.part} * x.whole;
  };
  Fraction low{0, 1, {}}, high{1, 1, {}};
  std::int64_t of_p[3], of_q[3];
  int along = kNowhere;
  for (int k = 0; k < 3; ++k) {
    of_p[k] = area(b.corners[k], b.corners[next(k)], p);
    of_q[k] = area(b.corners[k], b.corners[next(k)], q);
    if (of_p[k] == 0 && of_q[k] == 0) along = k;
    if (of_p[k] < 0 && of_q[k] < 0) return;
    if (of_p[k] < 0) {  // enters at part / whole
      const Fraction enter{-of_p[k], of_q[k] - of_p[k], {kNowhere, k}};
      if (less(low, enter)) low = enter;
    } else if (of_q[k] < 0) {
      const Fraction leave{of_p[k], of_p[k] - of_q[k], {kNowhere, k}};
      if (less(leave, high)) high = leave;
    }
  }
  if (less(high, low)) return;
  // The point at a fraction: an end of the side, a corner of b, or where two sides cross.
  const auto point_at = [&](Fraction& f) {
    if (f.part == 0 || f.part == f.whole) {
      const bool end = f.part != 0;
      const std::uint32_t vertex = end ? q : p;
      f.place = {};
      for (int k = 0; k < 3; ++k) {
        if (b.corners[k] == vertex) f.place.corner = k;
        if ((end ? of_q : of_p)[k] == 0) f.place.side = k;
      }
      return vertex;
    }
    const int k = f.place.side;
    for (const int corner : {k, next(k)}) {
      if (area(p, q, b.corners[corner]) != 0) continue;
      f.place = {corner, kNowhere};
      return b.corners[corner];
    }
    const std::uint32_t r = b.corners[k], s = b.corners[next(k)];
    return lines_.add_point(points_, Recipe::of_edges({p, q}, {r, s}));
  };
  const bool is_point = !less(low, high);
  const std::uint32_t from = point_at(low), to = is_point ? from : point_at(high);
  const std::uint32_t line = edge(a, side);
  for (const auto& [point, place] : {std::pair{from, low.place}, std::pair{to, high.place}}) {
    put_on_edge(line, point);
    put(b, place, point, !is_point);
    if (is_point) return;
  }
  lines_.touched_edges.push_back(line);
  if (along != kNowhere) {
    lines_.touched_edges.push_back(edge(b, along));
  } else {
    lines_.cuts.push_back({b.triangle, line, from, to});
  }
}

}  // namespace

void join_parts(const ArrangementInput& input, std::vector<CutLinesPart> parts, PointTable& points,
                CutLines& lines) {
  std::size_t most_points = 0;
  for (const CutLinesPart& part : parts) most_points += part.points.size();
  points.reserve(most_points / 2);  // most are found twice
  std::vector<std::uint32_t> point_of;
  for (CutLinesPart& part : parts) {
    point_of.clear();
    for (const NewPoint& point : part.points) point_of.push_back(points.find_or_add(point));
    const auto lines_before =
        static_cast<std::uint32_t>(input.edges.size() + lines.crossings.size());
    const auto fix_point = [&](std::uint32_t& point) {
      if (point >= CutLinesPart::kOwn) point = point_of[point - CutLinesPart::kOwn];
    };
    const auto fix_line = [&](std::uint32_t& line) {
      if (line >= CutLinesPart::kOwn) line = line - CutLinesPart::kOwn + lines_before;
    };
    for (CrossingLine& crossing : part.crossings) {
      fix_point(crossing.from);
      fix_point(crossing.to);
      lines.crossings.push_back(crossing);
    }
    for (CutLines::Cut& cut : part.cuts) {
      fix_line(cut.line);
      fix_point(cut.from);
      fix_point(cut.to);
      lines.cuts.push_back(cut);
    }
    for (CutLines::Contact& contact : part.contacts) {
      fix_point(contact.point);
      lines.contacts.push_back(contact);
    }
    for (CutLines::LinePoint& put : part.line_points) {
      fix_line(put.line);
      fix_point(put.point);
      lines.line_points.push_back(put);
    }
    for (const std::uint32_t edge : part.touched_edges) lines.touched[edge] = true;
    part = {};
  }
}

Result<void> meet_pairs(const ArrangementInput& input, std::span<const BoxPair> pairs,
                        PointTable& points, CutLines& lines, const Execution& execution) {
  constexpr std::size_t kBlock = 1024;
  lines.touched.assign(input.edges.size(), false);
  for (const auto& [first, second] : pairs) {  // before any other point may be made there
    for (const std::uint32_t t : {first, second}) {
      for (int k = 0; k < 3; ++k) points.insert_vertex(input.triangles[t][k]);
    }
  }
  // Some blocks at a time, so that few points wait for their numbers.
  const std::size_t batch =
      kBlock * std::max<std::size_t>(16, 4 * static_cast<std::size_t>(execution.thread_count()));
  for (std::size_t first = 0; first < pairs.size(); first += batch) {
    const auto some = pairs.subspan(first, std::min(batch, pairs.size() - first));
    std::vector<CutLinesPart> parts((some.size() + kBlock - 1) / kBlock);
    parallel_for(execution, parts.size(), [&](std::size_t part, int) {
      PairMeeter meeter(input, points.points(), parts[part]);
      const std::size_t begin = part * kBlock;
      for (const BoxPair& pair : some.subspan(begin, std::min(kBlock, some.size() - begin))) {
        meeter.meet(pair);
      }
    });
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    join_parts(input, std::move(parts), points, lines);
  }
  return {};
}

}  // namespace strata::csg
