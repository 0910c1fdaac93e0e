#include "mesh/check/mesh_links.h"

#include <algorithm>
#include <numeric>

#include "mesh/block_sum.h"
#include "mesh/disjoint_sets.h"
#include "mesh/edge_balance.h"
#include "mesh/edge_uses.h"
#include "mesh/weld.h"

namespace strata {
namespace {

constexpr std::uint32_t kNoHalf = 0xffffffffu;

struct EdgeFacts {
  std::uint64_t edges = 0, unbalanced = 0, non_manifold = 0;
  std::vector<std::array<std::uint32_t, 2>> examples;
  std::vector<std::array<std::uint32_t, 2>> joined;  // triangles at edges of more than two

  void join(const EdgeFacts& other) {
    edges += other.edges;
    unbalanced += other.unbalanced;
    non_manifold += other.non_manifold;
    examples.insert(examples.end(), other.examples.begin(), other.examples.end());
    if (examples.size() > kLinkExamples) examples.resize(kLinkExamples);
    joined.insert(joined.end(), other.joined.begin(), other.joined.end());
  }
};

// Half-edge 3 t + k of triangle t goes from its vertex k to the next one.
std::uint32_t next_of(std::uint32_t half) { return half % 3 == 2 ? half - 2 : half + 1; }
std::uint32_t previous_of(std::uint32_t half) { return half % 3 == 0 ? half + 2 : half - 1; }

class Links {
 public:
  Links(std::span<const glm::uvec3> triangles, std::span<const std::uint32_t> vertex,
        const Execution& execution)
      : triangles_(triangles), vertex_(vertex), execution_(execution) {}

  void find(MeshLinks& result) {
    opposite_.assign(3 * triangles_.size(), kNoHalf);
    const EdgeFacts facts = pair_edges();
    result.edges = facts.edges;
    result.unbalanced_edges = facts.unbalanced;
    result.non_manifold_edges = facts.non_manifold;
    result.edge_examples = facts.examples;
    Execution both = execution_;
    both.stop = {};
    parallel_for(both, 2, [&](std::size_t part, int) {
      part == 0 ? count_fans(result) : find_shells(facts.joined, result);
    });
  }

 private:
  [[nodiscard]] std::uint32_t vertex_at(std::uint32_t half) const {
    return vertex_[triangles_[half / 3][static_cast<int>(half % 3)]];
  }
  [[nodiscard]] bool proper(std::size_t t) const {
    const std::uint32_t a = vertex_[triangles_[t].x], b = vertex_[triangles_[t].y],
                        c = vertex_[triangles_[t].z];
    return a != b && b != c && c != a;
  }

  // The half-edge of a use.
  [[nodiscard]] std::uint32_t half_of(const detail::EdgeUse& use, std::uint32_t low) const {
    const std::uint32_t from = use.down() ? use.high : low, first = 3 * use.of();
    return vertex_at(first) == from ? first : vertex_at(first + 1) == from ? first + 1 : first + 2;
  }

  EdgeFacts pair_edges() {
    detail::EdgeUses uses(triangles_, vertex_, [&](std::size_t t) { return proper(t); });
    return detail::fold_blocks<EdgeFacts>(
        execution_, vertex_.size(),
        [&](EdgeFacts& facts, std::size_t v) {
          uses.for_edges(v, [&](std::span<const detail::EdgeUse> edge) {
            add_edge(static_cast<std::uint32_t>(v), edge, facts);
          });
        },
        [](EdgeFacts& total, const EdgeFacts& part) { total.join(part); });
  }

  void add_edge(std::uint32_t low, std::span<const detail::EdgeUse> uses, EdgeFacts& facts) {
    ++facts.edges;
    if (uses.size() == 2) {
      const std::uint32_t a = half_of(uses[0], low), b = half_of(uses[1], low);
      opposite_[a] = b;
      opposite_[b] = a;
      facts.unbalanced += uses[0].down() == uses[1].down();
      return;
    }
    std::size_t up = 0;
    for (const detail::EdgeUse& use : uses) up += !use.down();
    facts.unbalanced += 2 * up != uses.size();
    for (std::size_t i = 1; i < uses.size(); ++i) {
      facts.joined.push_back({uses[0].of(), uses[i].of()});
    }
    if (uses.size() <= 2) return;
    ++facts.non_manifold;
    if (facts.examples.size() < kLinkExamples) facts.examples.push_back({low, uses[0].high});
  }

  // Marks the corners that follow `corner` around its vertex, across `edge` and further ones.
  // Triangles at an edge need not have the same orientation.
  void walk(std::uint32_t corner, std::uint32_t edge, std::vector<bool>& visited) const {
    const std::uint32_t v = vertex_at(corner);
    while (opposite_[edge] != kNoHalf) {
      const std::uint32_t across = opposite_[edge];
      const bool begins = vertex_at(across) == v;
      corner = begins ? across : next_of(across);
      edge = begins ? previous_of(corner) : corner;
      if (visited[corner]) return;
      visited[corner] = true;
    }
  }

  // A fan: corners at a vertex, each next to the one before.
  void count_fans(MeshLinks& result) {
    std::vector<bool> visited(opposite_.size());
    std::vector<bool> has_fan(vertex_.size()), has_more(vertex_.size());
    for (std::uint32_t start = 0; start < opposite_.size(); ++start) {
      if (visited[start] || !proper(start / 3)) continue;
      if (start % 4096 == 0 && execution_.stop.stop_requested()) return;
      visited[start] = true;
      walk(start, previous_of(start), visited);
      walk(start, start, visited);
      const std::uint32_t v = vertex_at(start);
      if (has_fan[v]) has_more[v] = true;
      has_fan[v] = true;
    }
    for (std::uint32_t v = 0; v < has_more.size(); ++v) {
      if (!has_more[v]) continue;
      ++result.non_manifold_vertices;
      if (result.vertex_examples.size() < kLinkExamples) result.vertex_examples.push_back(v);
    }
  }

  void find_shells(const std::vector<std::array<std::uint32_t, 2>>& joined, MeshLinks& result) {
    detail::DisjointSets sets(triangles_.size());
    for (std::uint32_t half = 0; half < opposite_.size(); ++half) {
      if (opposite_[half] != kNoHalf && opposite_[half] < half) {
        sets.join(opposite_[half] / 3, half / 3);
      }
    }
    for (const auto& [a, b] : joined) sets.join(a, b);
    result.shell_of.resize(triangles_.size());
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      const std::uint32_t root = sets.find(t);  // the least of its set
      result.shell_of[t] = root == t ? result.shells++ : result.shell_of[root];
    }
  }

  std::span<const glm::uvec3> triangles_;
  std::span<const std::uint32_t> vertex_;
  const Execution& execution_;
  std::vector<std::uint32_t> opposite_;  // of half-edges at edges of two triangles
};

}  // namespace

MeshLinks mesh_links(std::span<const exact::FilePoint> positions,
                     std::span<const glm::uvec3> triangles, const Execution& execution) {
  MeshLinks result;
  result.by_index = detail::unbalanced_by_index(triangles, positions.size(), execution).empty();
  std::vector<std::uint32_t> vertex(positions.size());
  if (result.by_index) {
    std::iota(vertex.begin(), vertex.end(), 0u);
  } else {
    detail::weld_first<std::int64_t>(
        execution, positions.size(), [&](std::size_t v) { return positions[v]; }, vertex.data());
  }
  Links(triangles, vertex, execution).find(result);
  if (!result.by_index) result.vertex = std::move(vertex);
  return result;
}

}  // namespace strata
