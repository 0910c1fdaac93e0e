#include "mesh/polygons/triangulate.h"

// Ear clipping that adds and drops no vertex. Bridges join holes to the contours around them, as in
// D. Eberly, "Triangulation by ear clipping", 2002. After every step the triangles so far and the
// rest of the loop together still equal the region. The boundary of the result is therefore that of
// the outline, whatever the outline is like. Only outlines that cross themselves get some reversed
// triangles.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <glm/common.hpp>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "mesh/polygons/plane_predicates.h"

namespace strata {
namespace {

using Index = std::uint32_t;
constexpr Index kNone = 0xffffffffu;

struct Node {
  glm::dvec2 p{0};
  Index vertex = 0;  ///< index into the points of all contours
  Index next = 0, prev = 0;
  bool alive = true;
  bool waits = false;    ///< in the queue for clipping
  bool touched = false;  ///< a neighbour was clipped since it entered the queue
};

/// Loops of nodes, which are bridged and clipped.
class Clipping {
 public:
  /// @param turns  quarter turns of the plane, which change the direction of the bridges
  Clipping(std::span<const std::vector<glm::dvec2>> contours, int turns) {
    std::size_t total = 0;
    for (const auto& contour : contours) total += contour.size();
    nodes_.reserve(total + 2 * contours.size());
    Index vertex = 0;
    for (const auto& contour : contours) {
      if (contour.size() < 3) {
        vertex += static_cast<Index>(contour.size());
        continue;
      }
      const auto first = static_cast<Index>(nodes_.size());
      const auto count = static_cast<Index>(contour.size());
      for (Index i = 0; i < count; ++i) {
        glm::dvec2 p = contour[i];
        for (int t = 0; t < turns; ++t) p = {-p.y, p.x};
        nodes_.push_back({p, vertex++, first + (i + 1) % count, first + (i + count - 1) % count});
      }
    }
    triangles_.reserve(nodes_.capacity());
    if (nodes_.empty()) return;
    part_touching_points();
    find_loops();
    low_ = high_ = nodes_[0].p;
    for (const Node& n : nodes_) low_ = glm::min(low_, n.p), high_ = glm::max(high_, n.p);
  }

  void run() {
    if (nodes_.empty()) return;
    join_holes();
    for (const Index loop : loops_) clip(loop);
  }

  const std::vector<glm::uvec3>& triangles() const { return triangles_; }
  /// The total area of reversed triangles.
  double turned_area() const { return turned_area_; }
  /// Whether the search for ears was given up because the outline crosses itself too often.
  bool gave_up() const { return looks_ > most_looks(); }

 private:
  int turn(Index a, Index b, Index c) const {
    return orient(nodes_[a].p, nodes_[b].p, nodes_[c].p);
  }
  bool convex(Index i) const { return turn(nodes_[i].prev, i, nodes_[i].next) > 0; }

  // --- loops ------------------------------------------------------------------------------------

  /// Reconnects the edges where several nodes are in one place, so that each node has one sector of
  /// the region. Contours that touch there are separated or merged into one loop.
  void part_touching_points() {
    std::vector<Index> order(nodes_.size());
    std::iota(order.begin(), order.end(), Index{0});
    std::sort(order.begin(), order.end(), [&](Index a, Index b) {
      const glm::dvec2 &p = nodes_[a].p, &q = nodes_[b].p;
      return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : a < b;
    });
    for (std::size_t i = 0; i < order.size();) {
      std::size_t j = i + 1;
      while (j < order.size() && nodes_[order[j]].p == nodes_[order[i]].p) ++j;
      if (j - i > 1) part(std::span(order).subspan(i, j - i));
      i = j;
    }
  }

  /// @param group  nodes in one place
  void part(std::span<const Index> group) {
    struct Spoke {
      glm::dvec2 to;
      Index node;
      bool out;
    };
    const glm::dvec2 hub = nodes_[group[0]].p;
    std::vector<Spoke> spokes;
    for (const Index i : group) {
      const glm::dvec2 &before = nodes_[nodes_[i].prev].p, &after = nodes_[nodes_[i].next].p;
      if (before == hub || after == hub) return;  // the edge has no direction; the ears settle it
      spokes.push_back({before, i, false});
      spokes.push_back({after, i, true});
    }
    const auto upper = [&](const glm::dvec2& p) {
      return p.y > hub.y || (p.y == hub.y && p.x > hub.x);
    };
    std::stable_sort(spokes.begin(), spokes.end(), [&](const Spoke& a, const Spoke& b) {
      const bool first = upper(a.to), second = upper(b.to);
      if (first != second) return first;
      return orient(hub, a.to, b.to) > 0;
    });
    // Counter-clockwise around the place, the region lies between an outgoing edge and the next
    // incoming one. Where edges overlap or cross, they are matched like brackets, so that all of
    // them find a partner.
    std::size_t start = 0;
    int depth = 0, lowest = 0;
    for (std::size_t i = 0; i < spokes.size(); ++i) {
      depth += spokes[i].out ? 1 : -1;
      if (depth < lowest) lowest = depth, start = i + 1;
    }
    std::vector<Index> open;
    std::vector<std::pair<Index, Index>> pairs;  // the nodes of the outgoing and the incoming edge
    for (std::size_t i = 0; i < spokes.size(); ++i) {
      const Spoke& spoke = spokes[(start + i) % spokes.size()];
      if (spoke.out) {
        open.push_back(spoke.node);
      } else {
        pairs.emplace_back(open.back(), spoke.node);
        open.pop_back();
      }
    }
    // A pair becomes one node: the node of its incoming edge.
    std::vector<Index> next(pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) next[i] = nodes_[pairs[i].first].next;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      nodes_[pairs[i].second].next = next[i];
      nodes_[next[i]].prev = pairs[i].second;
    }
  }

  void find_loops() {
    hole_of_.assign(nodes_.size(), kNone);
    std::vector<bool> seen(nodes_.size(), false);
    std::vector<glm::dvec2> points;
    for (Index first = 0; first < nodes_.size(); ++first) {
      if (seen[first]) continue;
      points.clear();
      Index i = first;
      do {
        seen[i] = true;
        points.push_back(nodes_[i].p);
        i = nodes_[i].next;
      } while (i != first);
      const bool hole = signed_area(points) < 0;
      (hole ? holes_ : loops_).push_back(first);
      if (!hole) continue;
      do {
        hole_of_[i] = first;
        i = nodes_[i].next;
      } while (i != first);
    }
  }

  // --- holes ------------------------------------------------------------------------------------

  std::size_t row(double y) const {
    const double height = high_.y - low_.y;
    if (!(height > 0)) return 0;
    const double at = (y - low_.y) / height * static_cast<double>(rows_.size());
    return std::min(rows_.size() - 1, static_cast<std::size_t>(std::max(at, 0.0)));
  }
  void add_edge(Index from) {
    const auto [low, high] = std::minmax(nodes_[from].p.y, nodes_[nodes_[from].next].p.y);
    for (std::size_t r = row(low); r <= row(high); ++r) rows_[r].push_back(from);
  }

  void join_holes() {
    if (holes_.empty()) return;
    rows_.resize(std::clamp<std::size_t>(
        2 * static_cast<std::size_t>(std::sqrt(static_cast<double>(nodes_.size()))), 1, 2048));
    const auto edges = static_cast<Index>(nodes_.size());
    for (Index i = 0; i < edges; ++i) add_edge(i);
    // A ray from a hole's leftmost point to the left meets the contour around the hole, or another
    // hole further left, which has been joined already.
    std::vector<Index> leftmost;
    for (const Index hole : holes_) {
      Index best = hole;
      for (Index i = nodes_[hole].next; i != hole; i = nodes_[i].next) {
        const glm::dvec2 &p = nodes_[i].p, &q = nodes_[best].p;
        if (p.x < q.x || (p.x == q.x && p.y < q.y)) best = i;
      }
      leftmost.push_back(best);
    }
    std::sort(leftmost.begin(), leftmost.end(), [&](Index a, Index b) {
      const glm::dvec2 &p = nodes_[a].p, &q = nodes_[b].p;
      if (p.x != q.x) return p.x < q.x;
      return p.y != q.y ? p.y < q.y : a < b;
    });
    for (const Index hole : leftmost) {
      const Index bridge = find_bridge(hole);
      if (bridge == kNone) {
        loops_.push_back(hole);  // no contour is around it: it becomes a loop of its own, reversed
        continue;
      }
      join(bridge, hole);
    }
  }

  /// Whether the segment from node `at` to p begins inside the region.
  bool opens_to(Index at, const glm::dvec2& p) const {
    const glm::dvec2& b = nodes_[at].p;
    // A bridge between points in one place has no direction, so the next point in another place
    // counts.
    Index before = nodes_[at].prev, after = nodes_[at].next;
    while (nodes_[before].p == b && before != at) before = nodes_[before].prev;
    while (nodes_[after].p == b && after != at) after = nodes_[after].next;
    const glm::dvec2 &a = nodes_[before].p, &c = nodes_[after].p;
    if (orient(a, b, c) > 0) return orient(b, c, p) >= 0 && orient(a, b, p) >= 0;
    return orient(b, c, p) > 0 || orient(a, b, p) > 0;
  }

  /// The node to which the bridge leads from `hole`, the leftmost node of a hole.
  Index find_bridge(Index hole) const {
    const glm::dvec2 h = nodes_[hole].p;
    double best_x = -std::numeric_limits<double>::infinity();
    Index edge = kNone;
    for (const Index i : rows_[row(h.y)]) {
      const glm::dvec2 &p = nodes_[i].p, &q = nodes_[nodes_[i].next].p;
      // Only edges that run down have the region on their right.
      if (!(p.y >= h.y && h.y >= q.y && p.y > q.y)) continue;
      if (orient(q, p, h) > 0 || !joined(i)) continue;
      const double x = std::min(p.x + (h.y - p.y) * (q.x - p.x) / (q.y - p.y), h.x);
      if (x > best_x) best_x = x, edge = i;
    }
    if (edge == kNone) return kNone;
    // The end of the edge that is further left is visible unless points lie in the triangle
    // between. Then the first such point is visible that the ray meets when it turns towards that
    // end.
    const Index start = edge, end = nodes_[edge].next;
    Index best = nodes_[start].p.x < nodes_[end].p.x ? start : end;
    if (nodes_[end].p.y == h.y) best = end;
    if (nodes_[start].p.y == h.y) best = start;
    const glm::dvec2 m = nodes_[best].p, hit(best_x, h.y);
    const bool below = m.y < h.y;
    const glm::dvec2 &a = below ? h : hit, &b = below ? hit : h;
    double best_slope = std::numeric_limits<double>::infinity(), best_distance = best_slope;
    Index visible = kNone;
    const auto [low, high] = std::minmax(m.y, h.y);
    for (std::size_t r = row(low); r <= row(high); ++r) {
      for (const Index i : rows_[r]) {
        const glm::dvec2& p = nodes_[i].p;
        if (p.x > h.x || p.y < low || p.y > high) continue;
        if (orient(a, b, p) < 0 || orient(b, m, p) < 0 || orient(m, a, p) < 0) continue;
        if (!joined(i) || !opens_to(i, h)) continue;
        const double distance = h.x - p.x;
        const double slope = p == h ? 0.0 : std::abs(p.y - h.y) / distance;
        if (slope < best_slope || (slope == best_slope && distance < best_distance)) {
          best_slope = slope, best_distance = distance, visible = i;
        }
      }
    }
    return visible != kNone ? visible : best;
  }

  /// Whether node `i` belongs to a loop already: to an outer contour, a bridge or a joined hole.
  bool joined(Index i) const { return i >= hole_of_.size() || hole_of_[i] == kNone; }

  void join(Index bridge, Index hole) {
    // The new loop is: bridge, hole, ..., hole again, bridge again, the bridge's old successor.
    const Index hole_again = static_cast<Index>(nodes_.size()), bridge_again = hole_again + 1;
    nodes_.push_back(nodes_[hole]);
    nodes_.push_back(nodes_[bridge]);
    Index i = hole;
    do {
      if (i < hole_of_.size()) hole_of_[i] = kNone;
      i = nodes_[i].next;
    } while (i != hole);
    Node &h = nodes_[hole], &h2 = nodes_[hole_again], &b = nodes_[bridge],
         &b2 = nodes_[bridge_again];
    nodes_[h.prev].next = hole_again;
    h2.next = bridge_again;
    b2.prev = hole_again;
    nodes_[b2.next].prev = bridge_again;
    b.next = hole;
    h.prev = bridge;
    add_edge(bridge);
    add_edge(hole_again);
    add_edge(bridge_again);
  }

  // --- ears -------------------------------------------------------------------------------------

  /// The nodes of a loop that are not convex, in a grid. Only they can lie in an ear.
  class Reflex {
   public:
    void build(const std::vector<Node>& nodes, const std::vector<Index>& list) {
      for (const Index i : list_) where_[i] = kNone;
      where_.resize(nodes.size(), kNone);
      list_ = list;
      glm::dvec2 high(-std::numeric_limits<double>::infinity());
      low_ = -high;
      for (std::size_t i = 0; i < list_.size(); ++i) {
        where_[list_[i]] = static_cast<Index>(i);
        low_ = glm::min(low_, nodes[list_[i]].p);
        high = glm::max(high, nodes[list_[i]].p);
      }
      side_ =
          std::clamp(static_cast<int>(std::sqrt(static_cast<double>(list_.size()) / 2.0)), 1, 1024);
      cell_ = glm::max(high - low_, glm::dvec2(0x1p-1000)) / static_cast<double>(side_);
      cells_.assign(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_), {});
      for (const Index i : list_) cells_[cell_of(nodes[i].p)].push_back(i);
    }
    bool contains(Index i) const { return where_[i] != kNone; }
    void insert(Index i, const glm::dvec2& p) {
      where_[i] = static_cast<Index>(list_.size());
      list_.push_back(i);
      cells_[cell_of(p)].push_back(i);
    }
    void remove(Index i) {
      if (where_[i] == kNone) return;
      const Index hole = where_[i];
      list_[hole] = list_.back();
      where_[list_[hole]] = hole;
      list_.pop_back();
      where_[i] = kNone;
    }
    /// Whether `test` holds for any node in the box.
    template <class Test>
    bool any(const glm::dvec2& low, const glm::dvec2& high, Test&& test) {
      if (list_.empty()) return false;
      const glm::ivec2 first = column(low), last = column(high);
      const std::int64_t area = std::int64_t{last.x - first.x + 1} * (last.y - first.y + 1);
      if (area * 2 > static_cast<std::int64_t>(list_.size())) {
        return std::any_of(list_.begin(), list_.end(), test);
      }
      for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) {
          auto& cell = cells_[static_cast<std::size_t>(y) * static_cast<std::size_t>(side_) +
                              static_cast<std::size_t>(x)];
          std::erase_if(cell, [&](Index i) { return where_[i] == kNone; });
          if (std::any_of(cell.begin(), cell.end(), test)) return true;
        }
      }
      return false;
    }

   private:
    glm::ivec2 column(const glm::dvec2& p) const {
      const glm::dvec2 at = glm::clamp((p - low_) / cell_, glm::dvec2(0), glm::dvec2(side_ - 1));
      return {static_cast<int>(at.x), static_cast<int>(at.y)};
    }
    std::size_t cell_of(const glm::dvec2& p) const {
      const glm::ivec2 c = column(p);
      return static_cast<std::size_t>(c.y) * static_cast<std::size_t>(side_) +
             static_cast<std::size_t>(c.x);
    }
    std::vector<Index> list_, where_;
    std::vector<std::vector<Index>> cells_;
    glm::dvec2 low_{0}, cell_{1};
    int side_ = 1;
  };

  /// How strict the test for an ear is. A level is tried when the one before finds no ear.
  enum Level { kClear, kTouched, kFlat, kConvex, kAny, kLevels };

  /// A limit far above the needs of simple outlines. Outlines that cross themselves everywhere have
  /// few ears, and each search would visit all remaining nodes.
  std::uint64_t most_looks() const { return (std::uint64_t{1} << 22) + 4096 * nodes_.size(); }

  bool is_ear(Index b, Level level) {
    ++looks_;
    const Index a = nodes_[b].prev, c = nodes_[b].next;
    const glm::dvec2 &pa = nodes_[a].p, &pb = nodes_[b].p, &pc = nodes_[c].p;
    // Two points coincide: the ear has no area.
    if (pa == pb || pb == pc || pa == pc) return true;
    const int side = turn(a, b, c);
    if (level == kAny) return true;
    if (level == kConvex) return side >= 0;
    if (level == kFlat) {
      if (side != 0) return false;
    } else if (side <= 0) {
      return false;
    }
    const glm::dvec2 low = glm::min(pa, glm::min(pb, pc)), high = glm::max(pa, glm::max(pb, pc));
    if (level == kFlat) return true;
    return !reflex_.any(low, high, [&](Index i) {
      ++looks_;
      if (i == a || i == b || i == c) return false;
      const glm::dvec2& p = nodes_[i].p;
      if (p.x < low.x || p.x > high.x || p.y < low.y || p.y > high.y) return false;
      if (p == pa || p == pb || p == pc) return false;
      const int ab = orient(pa, pb, p), bc = orient(pb, pc, p), ca = orient(pc, pa, p);
      if (level == kTouched) return ab > 0 && bc > 0 && ca > 0;
      return ab >= 0 && bc >= 0 && ca >= 0;
    });
  }

  void cut(Index b) {
    const Index a = nodes_[b].prev, c = nodes_[b].next;
    triangles_.emplace_back(nodes_[a].vertex, nodes_[b].vertex, nodes_[c].vertex);
    if (turn(a, b, c) < 0) {
      const glm::dvec2 p = nodes_[b].p - nodes_[a].p, q = nodes_[c].p - nodes_[a].p;
      turned_area_ += std::abs(p.x * q.y - p.y * q.x) / 2.0;
    }
    nodes_[a].next = c;
    nodes_[c].prev = a;
    nodes_[b].alive = false;
    reflex_.remove(b);
    for (const Index i : {a, c}) {
      if (reflex_.contains(i) == convex(i)) {
        reflex_.contains(i) ? reflex_.remove(i) : reflex_.insert(i, nodes_[i].p);
      }
    }
  }

  void clip(Index start) {
    std::vector<Index> reflex;
    std::size_t left = 0;
    Index i = start;
    do {
      if (!convex(i)) reflex.push_back(i);
      ++left;
      i = nodes_[i].next;
    } while (i != start);
    reflex_.build(nodes_, reflex);
    // Nodes wait in a queue. A node whose neighbour was clipped goes back to the end once, because
    // clipping neighbours one after another makes a fan of slivers.
    std::deque<Index> line;
    int level = kClear;
    std::size_t cuts = 1;
    while (left > 3) {
      if (line.empty()) {
        if (cuts == 0) ++level;
        cuts = 0;
        i = start;
        while (!nodes_[i].alive) i = nodes_[i].next;
        start = i;
        do {
          line.push_back(i);
          nodes_[i].waits = true;
          nodes_[i].touched = false;
          i = nodes_[i].next;
        } while (i != start);
      }
      i = line.front();
      line.pop_front();
      Node& node = nodes_[i];
      if (!node.alive) continue;
      if (node.touched) {
        node.touched = false;
        line.push_back(i);
        continue;
      }
      node.waits = false;
      if (!is_ear(i, gave_up() ? kAny : static_cast<Level>(level))) continue;
      cut(i);
      --left;
      ++cuts;
      level = kClear;
      for (const Index k : {node.prev, node.next}) {
        nodes_[k].touched = true;
        if (!nodes_[k].waits) line.push_back(k);
        nodes_[k].waits = true;
      }
    }
    i = start;
    while (!nodes_[i].alive) i = nodes_[i].next;
    cut(i);
  }

  std::vector<Node> nodes_;
  std::vector<Index> loops_, holes_;
  std::vector<Index> hole_of_;  ///< the hole of each original node; kNone: no hole, or joined
  std::vector<std::vector<Index>> rows_;
  Reflex reflex_;
  glm::dvec2 low_{0}, high_{0};
  std::vector<glm::uvec3> triangles_;
  double turned_area_ = 0;
  std::uint64_t looks_ = 0;  ///< number of nodes visited in the search for ears
};

}  // namespace

std::vector<glm::uvec3> triangulate(std::span<const std::vector<glm::dvec2>> contours) {
  double area = 0;
  for (const auto& contour : contours) area += std::abs(signed_area(contour));
  std::vector<glm::uvec3> best;
  double least = std::numeric_limits<double>::infinity();
  // Outlines that touch themselves within rounding may succeed with other bridges.
  for (int turns = 0; turns < 4; ++turns) {
    Clipping clipping(contours, turns);
    clipping.run();
    if (clipping.turned_area() < least) {
      least = clipping.turned_area();
      best = clipping.triangles();
    }
    constexpr double kNothing = 1e-12;
    if (least <= kNothing * area || clipping.gave_up()) break;
  }
  return best;
}

}  // namespace strata
