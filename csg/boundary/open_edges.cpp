#include "csg/boundary/open_edges.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include "mesh/edge_balance.h"
#include "mesh/polygons/triangulate.h"

namespace strata::csg {
namespace {

using detail::EdgeSum;
using exact::LatticePoint;
using Vertex = std::uint32_t;
using Loop = std::vector<Vertex>;  ///< each vertex once, in the direction of the open edges
using Vec = glm::vec<3, std::int64_t, glm::defaultp>;

bool before(const LatticePoint& a, const LatticePoint& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

// The line through an edge: its direction without common divisor, towards larger positions, and
// its moment about the origin, |component| < 2^59. Two edges have equal ones when they are on one
// line.
using Line = std::array<std::int64_t, 6>;

Line line_through(const LatticePoint& a, const LatticePoint& b) {
  Vec along = before(a, b) ? Vec(b) - Vec(a) : Vec(a) - Vec(b);
  along /= Vec(std::gcd(std::gcd(along.x, along.y), along.z));
  const Vec from(a);
  return {along.x,
          along.y,
          along.z,
          from.y * along.z - from.z * along.y,
          from.z * along.x - from.x * along.z,
          from.x * along.y - from.y * along.x};
}

// Splits edges where ends of others on the same line lie within them, and adds up the pieces. The
// low end of a piece is that of the lesser position.
class LinePieces {
 public:
  LinePieces(std::span<const LatticePoint> vertices, bool parity)
      : vertices_(vertices), parity_(parity) {}

  std::vector<EdgeSum> split(std::span<const EdgeSum> edges) {
    std::vector<std::pair<Line, std::size_t>> lines;
    lines.reserve(edges.size());
    for (std::size_t e = 0; e < edges.size(); ++e) {
      lines.emplace_back(line_through(vertices_[edges[e].low], vertices_[edges[e].high]), e);
    }
    std::sort(lines.begin(), lines.end());
    std::vector<EdgeSum> pieces;
    for (std::size_t i = 0, end = 0; i < lines.size(); i = end) {
      ends_.clear();
      for (; end < lines.size() && lines[end].first == lines[i].first; ++end) {
        // Towards larger positions: +sum from low to high, or -sum from high to low.
        const auto& [low, high, sum] = edges[lines[end].second];
        ends_.push_back({low, sum});
        ends_.push_back({high, -sum});
      }
      sweep(pieces);
    }
    return pieces;
  }

 private:
  struct End {
    Vertex vertex;
    std::int64_t change;  ///< of the number of uses towards larger positions
  };

  void sweep(std::vector<EdgeSum>& pieces) {
    std::sort(ends_.begin(), ends_.end(), [this](const End& a, const End& b) {
      return before(vertices_[a.vertex], vertices_[b.vertex]);
    });
    std::int64_t uses = 0;
    for (std::size_t i = 0; i + 1 < ends_.size(); ++i) {
      uses += ends_[i].change;
      const Vertex from = ends_[i].vertex, to = ends_[i + 1].vertex;
      if (vertices_[from] == vertices_[to]) continue;
      const std::int64_t sum = parity_ ? uses & 1 : uses;
      if (sum != 0) pieces.push_back({from, to, sum});
    }
  }

  std::span<const LatticePoint> vertices_;
  bool parity_;
  std::vector<End> ends_;
};

// Divides open edges into loops that meet no vertex twice. Which ones does not depend on the order
// of the edges: every step takes the edge to the least position.
class LoopWalk {
 public:
  LoopWalk(std::span<const LatticePoint> vertices, std::span<const EdgeSum> pieces, bool parity)
      : vertices_(vertices) {
    number_vertices(pieces);
    for (const EdgeSum& piece : pieces) {
      const Vertex a = number_of(piece.low), b = number_of(piece.high);
      for (std::int64_t i = std::abs(piece.sum); i > 0; --i) {
        const auto edge = static_cast<std::uint32_t>(used_.size());
        used_.push_back(0);
        const bool down = piece.sum < 0;
        steps_.push_back({down ? b : a, down ? a : b, edge});
        if (parity) steps_.push_back({down ? a : b, down ? b : a, edge});
      }
    }
    std::sort(steps_.begin(), steps_.end(), [](const Step& a, const Step& b) {
      return std::tie(a.from, a.to, a.edge) < std::tie(b.from, b.to, b.edge);
    });
    next_.assign(order_.size() + 1, 0);
    for (const Step& step : steps_) ++next_[step.from + 1];
    std::partial_sum(next_.begin(), next_.end(), next_.begin());
    ends_.assign(next_.begin() + 1, next_.end());
  }

  std::vector<Loop> loops() {
    place_.assign(order_.size(), kNotThere);
    for (Vertex start = 0; start < order_.size(); ++start) {
      path_.assign(1, start);
      place_[start] = 0;
      while (take_step()) {
      }
      for (const Vertex v : path_) place_[v] = kNotThere;
    }
    return std::move(loops_);
  }

 private:
  static constexpr std::uint32_t kNotThere = 0xffffffffu;
  struct Step {
    Vertex from, to;  ///< numbers by position
    std::uint32_t edge;
  };

  void number_vertices(std::span<const EdgeSum> pieces) {
    for (const EdgeSum& piece : pieces) order_.insert(order_.end(), {piece.low, piece.high});
    std::sort(order_.begin(), order_.end(),
              [this](Vertex a, Vertex b) { return before(vertices_[a], vertices_[b]); });
    const auto same = [this](Vertex a, Vertex b) { return vertices_[a] == vertices_[b]; };
    order_.erase(std::unique(order_.begin(), order_.end(), same), order_.end());
  }
  Vertex number_of(Vertex v) const {
    const auto found =
        std::lower_bound(order_.begin(), order_.end(), v,
                         [this](Vertex a, Vertex b) { return before(vertices_[a], vertices_[b]); });
    return static_cast<Vertex>(found - order_.begin());
  }

  // Goes on from the end of the path; takes a loop off when it comes back to it.
  bool take_step() {
    const Vertex at = path_.back();
    while (next_[at] < ends_[at] && used_[steps_[next_[at]].edge] != 0) ++next_[at];
    if (next_[at] == ends_[at]) return false;  // as many edges arrive as leave: this is the start
    const Step& step = steps_[next_[at]++];
    used_[step.edge] = 1;
    if (place_[step.to] == kNotThere) {
      place_[step.to] = static_cast<std::uint32_t>(path_.size());
      path_.push_back(step.to);
      return true;
    }
    const std::size_t begin = place_[step.to];
    Loop& loop = loops_.emplace_back();
    for (std::size_t i = begin; i < path_.size(); ++i) {
      if (i > begin) place_[path_[i]] = kNotThere;
      loop.push_back(order_[path_[i]]);
    }
    path_.resize(begin + 1);
    return true;
  }

  std::span<const LatticePoint> vertices_;
  std::vector<Vertex> order_;  ///< the vertices by position; their places are the numbers
  std::vector<Step> steps_;
  std::vector<std::uint8_t> used_;
  std::vector<std::size_t> next_, ends_;  ///< of the steps from each vertex
  std::vector<std::uint32_t> place_;      ///< of each vertex on the path
  std::vector<Vertex> path_;
  std::vector<Loop> loops_;
};

// The triangles that close one loop.
class Cap {
 public:
  Cap(std::vector<LatticePoint>& vertices, Loop loop) : vertices_(vertices), rim_(std::move(loop)) {
    // The cap runs along its edges against the direction of the open ones, from the least vertex.
    std::reverse(rim_.begin(), rim_.end());
    const auto least = std::min_element(rim_.begin(), rim_.end(), [&](Vertex a, Vertex b) {
      return before(vertices_[a], vertices_[b]);
    });
    std::rotate(rim_.begin(), least, rim_.end());
    for (std::size_t i = 0; i < rim_.size(); ++i) {
      length += glm::length(at(i + 1 < rim_.size() ? i + 1 : 0) - at(i));
      if (i + 1 < rim_.size()) normal_ += glm::cross(at(i), at(i + 1));
    }
    if (!flat() || !triangulate_flat()) fan();
    for (const glm::uvec3& t : triangles) {
      const glm::dvec3 a(vertices_[t.x]), b(vertices_[t.y]), c(vertices_[t.z]);
      area += glm::length(glm::cross(b - a, c - a)) / 2;
    }
  }

  // From the least vertex, against the open edges.
  const Loop& rim() const { return rim_; }

  std::vector<glm::uvec3> triangles;
  double length = 0, area = 0;  ///< in steps; of the loop, of the triangles

 private:
  glm::dvec3 at(std::size_t i) const {  // about the first vertex
    return glm::dvec3(vertices_[rim_[i]]) - glm::dvec3(vertices_[rim_[0]]);
  }

  // Within what snapping does to points of a plane.
  bool flat() const {
    constexpr double kSnapped = 2.0;  // steps; each point moves by at most sqrt(3) / 2
    const double size = glm::length(normal_);
    if (size == 0) return false;
    for (std::size_t i = 0; i < rim_.size(); ++i) {
      if (std::abs(glm::dot(at(i), normal_)) > kSnapped * size) return false;
    }
    return true;
  }

  // @return whether the projection keeps the vertices apart, as that of a plane does
  bool triangulate_flat() {
    const glm::dvec3 size = glm::abs(normal_);
    const int k = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    int u = (k + 1) % 3, v = (k + 2) % 3;
    if (normal_[k] < 0) std::swap(u, v);
    std::vector<glm::dvec2> contour;
    std::vector<std::pair<double, double>> seen;
    for (std::size_t i = 0; i < rim_.size(); ++i) {
      contour.emplace_back(at(i)[u], at(i)[v]);
      seen.emplace_back(at(i)[u], at(i)[v]);
    }
    std::sort(seen.begin(), seen.end());
    if (std::adjacent_find(seen.begin(), seen.end()) != seen.end()) return false;
    for (const glm::uvec3& t : triangulate(std::span(&contour, 1))) {
      triangles.emplace_back(rim_[t.x], rim_[t.y], rim_[t.z]);
    }
    return true;
  }

  void fan() {
    Vec sum(0);
    const auto count = static_cast<std::int64_t>(rim_.size());
    for (const Vertex v : rim_) sum += Vec(vertices_[v]);
    LatticePoint middle;
    for (int k = 0; k < 3; ++k) {  // to nearest, ties up
      const std::int64_t twice = 2 * sum[k] + count;
      const std::int64_t down = twice / (2 * count) - (twice % (2 * count) < 0 ? 1 : 0);
      middle[k] = static_cast<int>(down);
    }
    const auto apex = static_cast<Vertex>(vertices_.size());
    vertices_.push_back(middle);
    for (std::size_t i = 0; i < rim_.size(); ++i) {
      const Vertex from = rim_[i], to = rim_[i + 1 < rim_.size() ? i + 1 : 0];
      // A triangle of two equal corners is nothing: its edges cancel.
      if (vertices_[from] == middle || vertices_[to] == middle) continue;
      triangles.emplace_back(from, to, apex);
    }
  }

  std::vector<LatticePoint>& vertices_;
  Loop rim_;
  glm::dvec3 normal_{0};  ///< twice the area vector
};

class Closer {
 public:
  Closer(LatticeSolids& solids, OpenSolids policy, const Tree& tree)
      : solids_(solids), policy_(policy), tree_(tree), added_(solids.solid_count()) {}

  // @param edges  of one solid, not balanced by index
  Result<void> close(std::uint32_t solid, std::vector<EdgeSum> edges) {
    edges = detail::unbalanced_by_position<int>(std::move(edges), solids_.vertices);
    const bool parity = tree_.solids()[solid].rule == InsideRule::kParity;
    if (parity) std::erase_if(edges, [](const EdgeSum& edge) { return edge.sum % 2 == 0; });
    const auto pieces = LinePieces(solids_.vertices, parity).split(edges);
    if (pieces.empty()) return {};
    std::vector<Loop> loops = LoopWalk(solids_.vertices, pieces, parity).loops();
    for (Loop& loop : loops) {
      if (solids_.vertices.size() >= 0xffffffffu) {
        return fail(ErrorCode::kLimit, "the solids have more than {} vertices with their caps",
                    0xffffffffu);
      }
      const Cap cap(solids_.vertices, std::move(loop));
      added_[solid].insert(added_[solid].end(), cap.triangles.begin(), cap.triangles.end());
      if (cap.area <= cap.length) continue;  // a crack, no wider than a step on the average
      const double step = solids_.lattice.step;
      caps.push_back({solid, cap.rim().size(), cap.length * step, cap.area * step * step});
      if (first_.empty() || before(solids_.vertices[cap.rim()[0]], solids_.vertices[first_[0]])) {
        first_ = {cap.rim().front(), cap.rim().back()};
      }
    }
    if (policy_ == OpenSolids::kFail && !caps.empty()) return refuse();
    return {};
  }

  // Puts the new triangles behind those of their solids.
  Result<void> finish() {
    std::uint64_t total = solids_.triangles.size();
    for (const auto& triangles : added_) total += triangles.size();
    if (total == solids_.triangles.size()) return {};
    if (total > 0xffffffffu) {
      return fail(ErrorCode::kLimit, "the solids have {} triangles with their caps; at most {} fit",
                  total, 0xffffffffu);
    }
    std::vector<glm::uvec3> all;
    all.reserve(total);
    const auto old = solids_.triangles.begin();
    for (std::size_t s = 0, from = 0; s < solids_.solid_count(); ++s) {
      const std::size_t to = solids_.first_triangle[s + 1];
      all.insert(all.end(), old + static_cast<std::ptrdiff_t>(from),
                 old + static_cast<std::ptrdiff_t>(to));
      all.insert(all.end(), added_[s].begin(), added_[s].end());
      solids_.first_triangle[s + 1] = static_cast<std::uint32_t>(all.size());
      from = to;
    }
    label_caps(all);
    solids_.triangles = std::move(all);
    return {};
  }

  std::vector<BoundaryCap> caps;

 private:
  // Caps have the label of a triangle at their rim. @param all  triangles, of the new ranges
  void label_caps(const std::vector<glm::uvec3>& all) {
    if (solids_.labels.empty()) return;
    std::vector<std::uint32_t> at_vertex(solids_.vertices.size(), 0);
    for (std::size_t t = 0; t < solids_.triangles.size(); ++t) {
      const glm::uvec3& v = solids_.triangles[t];
      at_vertex[v.x] = at_vertex[v.y] = at_vertex[v.z] = solids_.labels[t];
    }
    std::vector<std::uint32_t> labels;
    labels.reserve(all.size());
    std::size_t old = 0;
    for (std::size_t s = 0; s < solids_.solid_count(); ++s) {
      const std::size_t end = solids_.first_triangle[s + 1] - added_[s].size();
      while (labels.size() < end) labels.push_back(solids_.labels[old++]);
      // The middle of a hole is its last vertex, and no triangle's.
      for (const glm::uvec3& cap : added_[s]) {
        labels.push_back(at_vertex[std::min({cap.x, cap.y, cap.z})]);
      }
    }
    solids_.labels = std::move(labels);
  }
  // @pre all caps are of one solid
  Result<void> refuse() const {
    const auto world = [this](Vertex v) {
      return solids_.lattice.origin + solids_.lattice.step * glm::dvec3(solids_.vertices[v]);
    };
    std::uint64_t edges = 0;
    double length = 0;
    for (const BoundaryCap& cap : caps) edges += cap.edges, length += cap.length;
    const glm::dvec3 a = world(first_[0]), b = world(first_[1]);
    const std::string& name = tree_.solids()[caps[0].solid].name;
    return fail(ErrorCode::kGeometry,
                "{} is open: {} edges around holes, of the length {:.6g} in all; the first goes "
                "from ({:.9g}, {:.9g}, {:.9g}) to ({:.9g}, {:.9g}, {:.9g}), length {:.6g}",
                name.empty() ? fmt::format("solid {}", caps[0].solid) : name, edges, length, a.x,
                a.y, a.z, b.x, b.y, b.z, glm::length(b - a));
  }

  LatticeSolids& solids_;
  OpenSolids policy_;
  const Tree& tree_;
  std::vector<std::vector<glm::uvec3>> added_;  ///< to each solid
  std::vector<Vertex> first_;                   ///< the open edge at the least vertex of a hole
};

// The index behind the vertices of each solid. Solids take ranges of vertices in their order.
std::vector<Vertex> vertex_ends(const LatticeSolids& solids) {
  std::vector<Vertex> ends(solids.solid_count(), 0);
  Vertex end = 0;
  for (std::size_t s = 0; s < ends.size(); ++s) {
    for (std::uint32_t t = solids.first_triangle[s]; t < solids.first_triangle[s + 1]; ++t) {
      const glm::uvec3& v = solids.triangles[t];
      end = std::max({end, v.x + 1, v.y + 1, v.z + 1});
    }
    ends[s] = end;
  }
  return ends;
}

}  // namespace

Result<std::vector<BoundaryCap>> close_solids(LatticeSolids& solids, OpenSolids policy,
                                              const Tree& tree, const Execution& execution) {
  const std::vector<EdgeSum> open =
      detail::unbalanced_by_index(solids.triangles, solids.vertices.size(), execution);
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  if (open.empty()) return std::vector<BoundaryCap>{};
  Closer closer(solids, policy, tree);
  const std::vector<Vertex> ends = vertex_ends(solids);
  for (std::size_t i = 0, s = 0; i < open.size(); ++s) {
    std::size_t end = i;
    while (end < open.size() && open[end].low < ends[s]) ++end;
    if (end == i) continue;
    const auto first = open.begin();
    auto closed = closer.close(
        static_cast<std::uint32_t>(s),
        {first + static_cast<std::ptrdiff_t>(i), first + static_cast<std::ptrdiff_t>(end)});
    if (!closed) return tl::unexpected(closed.error());
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    i = end;
  }
  if (auto done = closer.finish(); !done) return tl::unexpected(done.error());
  return std::move(closer.caps);
}

}  // namespace strata::csg
