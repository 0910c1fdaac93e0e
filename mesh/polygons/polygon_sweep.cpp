#include "mesh/polygons/polygon_sweep.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <numeric>
#include <set>

#include "mesh/polygons/plane_predicates.h"

// This work is based on: M. de Berg, O. Cheong, M. van Kreveld, M. Overmars, "Computational
// Geometry", 3rd edition, 2008, chapter 3. A sweep divides the polygon by diagonals into pieces
// that are monotone in x. A stack cuts each piece into triangles.
//
// We differ: the sweep orders points by (x, y), so that no two points are equal in it. Pieces are
// cut from the right to the left, like in libtess2, so that convex polygons are cut as there.

namespace strata::detail {

bool PolygonSweep::before(Index a, Index b) const {
  const glm::dvec2 &p = points_[a], &q = points_[b];
  return p.x < q.x || (p.x == q.x && p.y < q.y);
}
PolygonSweep::Index PolygonSweep::next(Index i) const {
  return i + 1 == points_.size() ? 0 : i + 1;
}
PolygonSweep::Index PolygonSweep::previous(Index i) const {
  return i == 0 ? static_cast<Index>(points_.size()) - 1 : i - 1;
}

/// Orders, from below, the edges that run to the right and meet the sweep line. An edge is named by
/// its start vertex. It also tells which edges are below a point.
struct PolygonSweep::Below {
  using is_transparent = void;
  struct Point {
    Index vertex;
  };
  const PolygonSweep* sweep;

  int side(Index edge, Index vertex) const {
    const auto& p = sweep->points_;
    return orient(p[edge], p[sweep->next(edge)], p[vertex]);
  }
  bool operator()(Index a, Index b) const {
    if (a == b) return false;
    if (sweep->before(a, b)) {
      const int s = side(a, b);
      return (s != 0 ? s : side(a, sweep->next(b))) > 0;
    }
    const int s = side(b, a);
    return (s != 0 ? s : side(b, sweep->next(a))) < 0;
  }
  bool operator()(Index edge, Point point) const { return side(edge, point.vertex) > 0; }
};

bool PolygonSweep::find_diagonals() {
  const auto count = static_cast<Index>(points_.size());
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), Index{0});
  std::sort(order_.begin(), order_.end(), [this](Index a, Index b) { return before(a, b); });
  for (Index i = 1; i < count; ++i) {
    if (points_[order_[i - 1]] == points_[order_[i]]) return false;
  }
  std::set<Index, Below> status(Below{this});
  std::vector<std::set<Index, Below>::iterator> place(count, status.end());
  std::vector<Index> helper(count, 0);
  std::vector<std::uint8_t> is_merge(count, 0);
  const auto join_merge = [&](Index vertex, Index edge) {
    if (is_merge[helper[edge]] != 0) diagonals_.emplace_back(vertex, helper[edge]);
  };
  for (const Index v : order_) {
    const Index in = previous(v);  // the edge that ends at v
    const bool from_left = before(in, v), to_right = before(v, next(v));
    const int turn = orient(points_[in], points_[v], points_[next(v)]);
    if (from_left != to_right && turn == 0) return false;  // a spike
    if (from_left) {
      // An edge from the left ends here. Edges in `place` have the region above them.
      if (place[in] == status.end()) return false;
      join_merge(v, in);
      status.erase(place[in]);
      place[in] = status.end();
    }
    const bool above_region = from_left != to_right ? turn < 0 : !from_left;
    if (above_region) {  // a split, a merge, or a vertex of the upper side
      auto edge = status.lower_bound(Below::Point{v});
      if (edge == status.begin()) return false;
      const Index below = *--edge;
      if (to_right) {
        diagonals_.emplace_back(v, helper[below]);
      } else {
        join_merge(v, below);
        is_merge[v] = from_left ? 1 : 0;
      }
      helper[below] = v;
    }
    if (!to_right) continue;
    const auto [at, entered] = status.insert(v);
    if (!entered) return false;  // two edges coincide
    place[v] = at;
    helper[v] = v;
  }
  return true;
}

/// Sorts the edges and diagonals around each vertex.
void PolygonSweep::sort_slots() {
  const auto count = static_cast<Index>(points_.size());
  first_slot_.assign(count + 1, 1);
  first_slot_[count] = 0;
  for (const auto& [a, b] : diagonals_) ++first_slot_[a], ++first_slot_[b];
  Index slots = 0;
  for (Index& first : first_slot_) slots += std::exchange(first, slots);
  slot_target_.resize(slots);
  slot_diagonal_.resize(slots);
  slot_twin_.assign(slots, 0);
  std::vector<Index> filled(first_slot_.begin(), first_slot_.end() - 1);
  for (Index v = 0; v < count; ++v) slot_target_[filled[v]++] = next(v);
  for (Index d = 0; d < diagonals_.size(); ++d) {
    const auto [a, b] = diagonals_[d];
    slot_diagonal_[filled[a]++] = d;
    slot_diagonal_[filled[b]++] = d;
  }
  std::vector<Index> other(diagonals_.size(), slots);
  for (Index v = 0; v < count; ++v) {
    const auto target = [&](Index d) {
      return diagonals_[d].first == v ? diagonals_[d].second : diagonals_[d].first;
    };
    const glm::dvec2 &at = points_[v], &start = points_[next(v)];
    // The direction relative to the outgoing edge, counter-clockwise: less than half a turn, half,
    // more than half, or along the edge itself, where the polygon touches itself.
    const auto part = [&](const glm::dvec2& p) {
      const int side = orient(at, start, p);
      if (side != 0) return side > 0 ? 0 : 2;
      return glm::dot(start - at, p - at) < 0.0 ? 1 : 3;
    };
    const auto begin = slot_diagonal_.begin() + first_slot_[v] + 1;
    const auto end = slot_diagonal_.begin() + first_slot_[v + 1];
    std::sort(begin, end, [&](Index a, Index b) {
      const glm::dvec2 &p = points_[target(a)], &q = points_[target(b)];
      const int p_part = part(p), q_part = part(q);
      if (p_part != q_part) return p_part < q_part;
      const int side = p_part % 2 == 0 ? orient(at, p, q) : 0;
      return side != 0 ? side > 0 : a < b;
    });
    for (Index s = first_slot_[v] + 1; s < first_slot_[v + 1]; ++s) {
      const Index d = slot_diagonal_[s];
      slot_target_[s] = target(d);
      if (other[d] == slots) {
        other[d] = s;
      } else {
        slot_twin_[s] = other[d];
        slot_twin_[other[d]] = s;
      }
    }
  }
}

void PolygonSweep::cut_along_diagonals(std::vector<glm::uvec3>& triangles) {
  sort_slots();
  std::vector<std::uint8_t> used(slot_target_.size(), 0);
  for (Index vertex = 0; vertex < points_.size(); ++vertex) {
    for (Index start = first_slot_[vertex]; start < first_slot_[vertex + 1]; ++start) {
      if (used[start] != 0) continue;
      face_.clear();
      Index v = vertex;
      for (Index slot = start; used[slot] == 0;) {
        used[slot] = 1;
        face_.push_back(v);
        const bool edge = slot == first_slot_[v];
        v = slot_target_[slot];
        // The region is on the left, so the next edge is the one clockwise before the edge of
        // arrival.
        slot = (edge ? first_slot_[v + 1] : slot_twin_[slot]) - 1;
      }
      if (face_.size() >= 3) cut_monotone(face_, triangles);
    }
  }
}

/// @param face  counter-clockwise and monotone in (x, y)
void PolygonSweep::cut_monotone(std::span<const Index> face, std::vector<glm::uvec3>& triangles) {
  const std::size_t count = face.size();
  std::size_t right = 0;
  for (std::size_t i = 1; i < count; ++i) {
    if (before(face[right], face[i])) right = i;
  }
  // From the right to the left. The upper side continues counter-clockwise.
  merged_.assign(1, face[right]);
  upper_.assign(1, 1);
  std::size_t up = (right + 1) % count, low = (right + count - 1) % count;
  while (merged_.size() < count) {
    const bool takes_upper = up == low || before(face[low], face[up]);
    merged_.push_back(face[takes_upper ? up : low]);
    upper_.push_back(takes_upper ? 1 : 0);
    takes_upper ? up = (up + 1) % count : low = (low + count - 1) % count;
  }
  const auto add = [&](bool upper, Index older, Index newer, Index v) {
    upper ? triangles.emplace_back(older, newer, v) : triangles.emplace_back(newer, older, v);
  };
  stack_.assign({merged_[0], merged_[1]});
  bool upper = upper_[1] != 0;  // the side of the vertices on the stack
  for (std::size_t k = 2; k < count; ++k) {
    const Index v = merged_[k];
    if (k + 1 == count || (upper_[k] != 0) != upper) {
      for (std::size_t i = 1; i < stack_.size(); ++i) add(upper, stack_[i - 1], stack_[i], v);
      stack_.assign({merged_[k - 1], v});
      upper = upper_[k] != 0;
      continue;
    }
    Index last = stack_.back();
    stack_.pop_back();
    while (!stack_.empty()) {
      const int turn = orient(points_[stack_.back()], points_[last], points_[v]);
      if (upper ? turn <= 0 : turn >= 0) break;
      add(upper, stack_.back(), last, v);
      last = stack_.back();
      stack_.pop_back();
    }
    stack_.push_back(last);
    stack_.push_back(v);
  }
}

bool PolygonSweep::cut(std::span<const glm::dvec2> polygon, std::vector<glm::uvec3>& triangles) {
  points_ = polygon;
  triangles.clear();
  diagonals_.clear();
  const auto count = static_cast<Index>(polygon.size());
  if (count < 3) return false;
  Index turns_back = 0;
  for (Index i = 0; i < count; ++i) {
    if (before(i, previous(i)) && before(i, next(i))) ++turns_back;
  }
  if (turns_back == 1) {
    face_.resize(count);
    std::iota(face_.begin(), face_.end(), Index{0});
    cut_monotone(face_, triangles);
  } else {
    if (!find_diagonals()) return false;
    cut_along_diagonals(triangles);
  }
  // A polygon that crosses itself fails here.
  return triangles.size() == count - 2 &&
         std::all_of(triangles.begin(), triangles.end(), [this](const glm::uvec3& t) {
           return orient(points_[t.x], points_[t.y], points_[t.z]) >= 0;
         });
}

}  // namespace strata::detail
