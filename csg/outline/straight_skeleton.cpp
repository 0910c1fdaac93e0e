#include "csg/outline/straight_skeleton.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <random>

#include "mesh/polygons/plane_predicates.h"

namespace strata::csg {
namespace {

using Index = std::uint32_t;
constexpr Index kNone = 0xffffffffu;
constexpr double kNever = std::numeric_limits<double>::infinity();

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

/// The wavefront: loops of vertices. The lines of the edges between them move inwards.
class Wavefront {
 public:
  Result<StraightSkeleton> run(const Outline& outline, int corner_steps, const Jitter& jitter) {
    begin(outline, corner_steps, jitter);
    const std::size_t points = vertices_.size();
    std::size_t reflex = 1;
    for (const Vertex& v : vertices_) reflex += v.reflex ? 1 : 0;
    constexpr double kMostWork = 3e9;
    if (static_cast<double>(points) * static_cast<double>(points) * static_cast<double>(reflex) >
        kMostWork) {
      return fail(ErrorCode::kGeometry, "roof: one piece has {} points, which are too many",
                  points);
    }
    const std::size_t most_events = 40 * points + 100;
    for (std::size_t event = 0; !active_.empty(); ++event) {
      if (event > most_events) {
        return fail(ErrorCode::kGeometry, "roof: the edges of the outline do not meet");
      }
      if (!step()) break;
    }
    // No further event is left. Loops can remain because of rounding only; they become level.
    while (!active_.empty()) end_loop(active_[0]);
    return std::move(result_);
  }

 private:
  struct Edge {
    glm::dvec2 normal{0};  ///< inwards
    glm::dvec2 along{0};
    double offset = 0;  ///< normal . p = offset + time
  };
  struct Vertex {
    Index before = 0, after = 0;  ///< indices of edges
    Index prev = 0, next = 0;     ///< indices of vertices
    glm::dvec2 p{0}, velocity{0};
    Index born = 0;   ///< the node where it began
    Index place = 0;  ///< index in active_
    bool reflex = false;
    bool spike = false;  ///< its two edges face each other
    bool alive = true;
  };

  void begin(const Outline& outline, int corner_steps, const Jitter& jitter) {
    glm::dvec2 low(kNever), high(-kNever);
    for (const auto& contour : outline.contours) {
      for (const glm::dvec2& p : contour) low = glm::min(low, p), high = glm::max(high, p);
    }
    tolerance_ = 1e-9 * std::max(high.x - low.x, high.y - low.y);
    std::mt19937 random(jitter.seed);
    std::uniform_real_distribution<double> noise(-jitter.distance, jitter.distance);
    for (const auto& exact : outline.contours) {
      auto contour = exact;
      if (jitter.distance > 0) {
        for (glm::dvec2& p : contour) {
          // Two calls as arguments of one constructor would be evaluated in an order that differs
          // between compilers.
          const double y = noise(random), x = noise(random);
          p += glm::dvec2(x, y);
        }
      }
      const auto first = static_cast<Index>(vertices_.size());
      const std::size_t n = contour.size();
      std::vector<Index> edge(n);
      for (std::size_t i = 0; i < n; ++i) {
        edge[i] = add_edge(contour[i], glm::normalize(contour[(i + 1) % n] - contour[i]));
      }
      for (std::size_t i = 0; i < n; ++i) {
        const Index before = edge[(i + n - 1) % n], after = edge[i];
        const Index node = add_node(exact[i]);
        // The face of the previous edge ends at this node; the face of the next edge begins here.
        if (i > 0) link(before, node - 1, node);
        if (i + 1 == n) link(after, node, node - static_cast<Index>(n) + 1);
        Index last = before;
        const glm::dvec2 u = edges_[before].along, v = edges_[after].along;
        const double turn = std::atan2(cross(u, v), glm::dot(u, v));
        if (corner_steps > 0 && turn < 0) {
          const int parts =
              static_cast<int>(std::ceil(corner_steps * -turn / (2 * std::numbers::pi)));
          for (int k = 1; k < parts; ++k) {
            const double c = std::cos(turn * k / parts), s = std::sin(turn * k / parts);
            const Index hidden = add_edge(contour[i], {c * u.x - s * u.y, s * u.x + c * u.y});
            add_vertex(last, hidden, contour[i], node);
            last = hidden;
          }
        }
        add_vertex(last, after, contour[i], node);
      }
      const auto count = static_cast<Index>(vertices_.size()) - first;
      for (Index i = 0; i < count; ++i) {
        vertices_[first + i].next = first + (i + 1) % count;
        vertices_[first + i].prev = first + (i + count - 1) % count;
      }
    }
  }

  Index add_edge(const glm::dvec2& p, const glm::dvec2& along) {
    const glm::dvec2 normal(-along.y, along.x);
    edges_.push_back({normal, along, glm::dot(normal, p)});
    result_.faces.emplace_back();
    return static_cast<Index>(edges_.size() - 1);
  }
  Index add_node(const glm::dvec2& p) {
    result_.nodes.emplace_back(p, time_);
    return static_cast<Index>(result_.nodes.size() - 1);
  }
  void link(Index edge, Index from, Index to) {
    if (from != to) result_.faces[edge].emplace_back(from, to);
  }

  Index add_vertex(Index before, Index after, const glm::dvec2& p, Index node) {
    Vertex v;
    v.before = before, v.after = after;
    v.p = p;
    v.born = node;
    const glm::dvec2 &a = edges_[before].normal, &b = edges_[after].normal;
    const double sum = 1 + glm::dot(a, b);
    constexpr double kFacing = 1e-10;
    v.spike = sum < kFacing;
    if (!v.spike) v.velocity = (a + b) / sum;
    v.reflex = cross(edges_[before].along, edges_[after].along) < 0;
    v.place = static_cast<Index>(active_.size());
    active_.push_back(static_cast<Index>(vertices_.size()));
    vertices_.push_back(v);
    return active_.back();
  }

  /// Ends the path of vertex i at `node`. The path bounds the faces of the two edges at the vertex.
  void end_vertex(Index i, Index node) {
    Vertex& v = vertices_[i];
    link(v.before, v.born, node);
    link(v.after, node, v.born);
    v.alive = false;
    active_[v.place] = active_.back();
    vertices_[active_[v.place]].place = v.place;
    active_.pop_back();
  }

  void connect(Index i, Index j) {
    vertices_[i].next = j;
    vertices_[j].prev = i;
  }

  /// Closes what is left of a loop by level triangles. Often it is only a line or a point.
  void end_loop(Index start) {
    std::vector<Index> loop;
    for (Index i = start; loop.empty() || i != start; i = vertices_[i].next) loop.push_back(i);
    std::vector<Index> nodes;
    for (const Index i : loop) nodes.push_back(add_node(vertices_[i].p));
    for (std::size_t k = 0; k < loop.size(); ++k) {
      link(vertices_[loop[k]].after, nodes[(k + 1) % loop.size()], nodes[k]);
    }
    for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
      result_.flats.emplace_back(nodes[0], nodes[k], nodes[k + 1]);
    }
    for (std::size_t k = 0; k < loop.size(); ++k) end_vertex(loop[k], nodes[k]);
  }

  std::size_t loop_size(Index start) const {
    std::size_t size = 0;
    Index i = start;
    do {
      ++size;
      i = vertices_[i].next;
    } while (i != start && size < 3);
    return size;
  }

  /// Removes the edge from vertex i to the next one, which has no length left.
  void collapse(Index i) {
    const Index j = vertices_[i].next;
    if (loop_size(i) < 3) return end_loop(i);
    const glm::dvec2 p = (vertices_[i].p + vertices_[j].p) / 2.0;
    const Index node = add_node(p), before = vertices_[i].prev, after = vertices_[j].next;
    const Index left = vertices_[i].before, right = vertices_[j].after;
    end_vertex(i, node);
    end_vertex(j, node);
    const Index made = add_vertex(left, right, p, node);
    connect(before, made);
    connect(made, after);
  }

  /// Splits the loop where vertex i has run into the edge from j to the vertex after j.
  void split(Index i, Index j) {
    const Index k = vertices_[j].next;
    const glm::dvec2 p = vertices_[i].p;
    const Index node = add_node(p), edge = vertices_[j].after;
    const Index before = vertices_[i].prev, after = vertices_[i].next;
    const Index left = vertices_[i].before, right = vertices_[i].after;
    end_vertex(i, node);
    const Index to_k = add_vertex(left, edge, p, node), from_j = add_vertex(edge, right, p, node);
    connect(before, to_k);
    connect(to_k, k);
    connect(j, from_j);
    connect(from_j, after);
  }

  /// Removes the shorter of the two edges at vertex i, which lie on each other.
  void shorten_spike(Index i) {
    if (loop_size(i) < 3) return end_loop(i);
    const Index u = vertices_[i].prev, w = vertices_[i].next;
    const Index a = vertices_[i].before, b = vertices_[i].after;
    const glm::dvec2 tip = vertices_[i].p;
    const bool first = glm::distance(vertices_[u].p, tip) <= glm::distance(vertices_[w].p, tip);
    const Index other = first ? u : w;
    const glm::dvec2 p = vertices_[other].p;
    const Index top = add_node(tip), node = add_node(p);
    const Index outer = first ? vertices_[u].prev : vertices_[w].next;
    const Index left = first ? vertices_[u].before : a, right = first ? b : vertices_[w].after;
    end_vertex(i, top);
    end_vertex(other, node);
    // Both faces share the ridge from the tip to the start of the shorter edge.
    link(a, top, node);
    link(b, node, top);
    const Index made = add_vertex(left, right, p, node);
    if (first) {
      connect(outer, made);
      connect(made, w);
    } else {
      connect(u, made);
      connect(made, outer);
    }
  }

  /// Advances to the next event and handles it. @return false if there is none
  bool step() {
    enum class Kind { kNothing, kCollapse, kSplit };
    Kind kind = Kind::kNothing;
    double soonest = kNever;
    Index who = kNone, whom = kNone;
    for (const Index i : active_) {
      if (vertices_[i].next == vertices_[i].prev) {
        end_loop(i);
        return true;
      }
      if (vertices_[i].spike) {
        shorten_spike(i);
        return true;
      }
    }
    for (const Index i : active_) {
      const Vertex &v = vertices_[i], &w = vertices_[v.next];
      const glm::dvec2& along = edges_[v.after].along;
      const double length = glm::dot(w.p - v.p, along);
      const double shrinks = -glm::dot(w.velocity - v.velocity, along);
      if (shrinks <= 1e-12) continue;
      const double when = std::max(length, 0.0) / shrinks;
      if (when < soonest) soonest = when, kind = Kind::kCollapse, who = i;
    }
    for (const Index i : active_) {
      const Vertex& v = vertices_[i];
      if (!v.reflex) continue;
      for (const Index j : active_) {
        const Vertex &s = vertices_[j], &e = vertices_[s.next];
        if (j == i || s.next == i || j == v.prev) continue;
        const Edge& edge = edges_[s.after];
        const double closing = 1 - glm::dot(edge.normal, v.velocity);
        if (closing <= 1e-12) continue;
        const double away = glm::dot(edge.normal, v.p) - edge.offset - time_;
        if (away < -tolerance_) continue;
        const double when = std::max(away, 0.0) / closing;
        if (!(when < soonest)) continue;
        // The vertex must then be between the ends of the edge.
        const glm::dvec2 hit = v.p + v.velocity * when;
        const double from = glm::dot(hit - s.p - s.velocity * when, edge.along);
        const double to = glm::dot(e.p + e.velocity * when - hit, edge.along);
        if (from < -tolerance_ || to < -tolerance_) continue;
        // An edge that ends in a reflex corner is not hit by a vertex that moves on beyond that
        // end.
        constexpr double kStill = -1e-9;
        const auto passes = [&](const Vertex& end, double room, const glm::dvec2& towards) {
          return end.reflex && room <= tolerance_ &&
                 glm::dot(v.velocity - end.velocity, towards) < kStill;
        };
        if (passes(s, from, edge.along) || passes(e, to, -edge.along)) continue;
        // An edge without length cannot be hit: it is about to vanish or to grow.
        if (from + to <= 2 * tolerance_) continue;
        soonest = when, kind = Kind::kSplit, who = i, whom = j;
      }
    }
    if (kind == Kind::kNothing) return false;
    for (const Index i : active_) vertices_[i].p += vertices_[i].velocity * soonest;
    time_ += soonest;
    kind == Kind::kCollapse ? collapse(who) : split(who, whom);
    return true;
  }

  StraightSkeleton result_;
  std::vector<Edge> edges_;
  std::vector<Vertex> vertices_;
  std::vector<Index> active_;  ///< vertices that are alive
  double time_ = 0, tolerance_ = 0;
};

}  // namespace

Result<StraightSkeleton> straight_skeleton(const Outline& outline, int corner_steps,
                                           const Jitter& jitter) {
  return Wavefront().run(outline, corner_steps, jitter);
}

}  // namespace strata::csg
