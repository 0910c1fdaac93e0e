#include "mesh/polygons/delaunay_mesh.h"

#include <algorithm>
#include <unordered_set>

namespace strata {

void DelaunayMesh::begin(std::span<const exact::FlatPoint> points) {
  points_ = points;
  corners_.clear();
  across_.clear();
  beneath_.clear();
  waiting_.clear();
  real_.clear();
  real_.reserve(points.size());
  for (const exact::FlatPoint& point : points) real_.emplace_back(point - points.front());
}

bool DelaunayMesh::delaunay(const Quad& quad) const {
  const auto& [a, b, c, d] = quad;
  int inside = 0;
  if constexpr (exact::kFilters) {
    inside =
        exact::filters::incircle(real_[a] - real_[b], real_[c] - real_[b], real_[d] - real_[b]);
  }
  if (inside == 0) inside = exact::incircle(points_[a], points_[c], points_[d], points_[b]);
  return inside != 0 ? inside < 0 : std::min(a, c) < std::min(b, d);
}

void DelaunayMesh::flip(Side half_edge, const Quad& quad) {
  const Side other = across_[half_edge];
  const Side after = next(half_edge), other_after = next(other);
  const Side ab = across_[other_after], bc = across_[next(other_after)], cd = across_[after],
             da = across_[next(after)];
  const std::uint32_t t = half_edge / 3, o = other / 3;
  corners_[t] = {quad.a, quad.b, quad.d};
  corners_[o] = {quad.b, quad.c, quad.d};
  // An outer edge may be the other side of another one: of a slit that is not joined yet.
  join(3 * t, ab);
  join(3 * t + 2, da);
  join(3 * o, bc);
  join(3 * o + 1, cd);
  join(3 * t + 1, 3 * o + 2);
}

void DelaunayMesh::legalize() {
  while (!waiting_.empty()) {
    const Side half_edge = waiting_.back();
    waiting_.pop_back();
    if (!is_half_edge(across_[half_edge])) continue;
    const Quad around = quad(half_edge);
    // The quadrilateral of an edge that is not Delaunay is convex.
    if (delaunay(around)) continue;
    const Side t = half_edge / 3, o = across_[half_edge] / 3;
    flip(half_edge, around);
    waiting_.push_back(3 * t);
    waiting_.push_back(3 * o);
  }
}

std::size_t DelaunayMesh::straighten() {
  const auto left = [this](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    return turn(a, b, c) > 0 ? 1 : 0;
  };
  const auto key = [](std::uint32_t a, std::uint32_t b) {
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  };
  std::unordered_set<std::uint64_t> edges;  // there must not be two with the same ends
  for (Side side = 0; side < across_.size(); ++side) {
    waiting_.push_back(side);
    edges.insert(key(start(side), start(next(side))));
  }
  // Flips for more left turns end; those for Delaunay edges need a bound, since they may undo each
  // other where triangles overlap.
  std::size_t most = 64 * corners_.size();
  while (!waiting_.empty() && most > 0) {
    const Side half_edge = waiting_.back();
    waiting_.pop_back();
    if (!is_half_edge(across_[half_edge])) continue;
    const Quad around = quad(half_edge);
    const auto& [a, b, c, d] = around;
    if (b == d || edges.count(key(b, d)) != 0) continue;
    const int before = left(a, c, d) + left(a, b, c), after = left(a, b, d) + left(b, c, d);
    if (after > before || (after == 2 && before == 2 && !delaunay(around))) {
      const Side t = half_edge / 3, o = across_[half_edge] / 3;
      edges.erase(key(a, c));
      edges.insert(key(b, d));
      flip(half_edge, around);
      for (const Side side : {3 * t, 3 * t + 2, 3 * o, 3 * o + 1}) waiting_.push_back(side);
      --most;
    }
  }
  waiting_.clear();
  return static_cast<std::size_t>(
      std::count_if(corners_.begin(), corners_.end(),
                    [&](const auto& t) { return left(t[0], t[1], t[2]) == 0; }));
}

}  // namespace strata
