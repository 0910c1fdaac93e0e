#include "strata/mesh/diagnose.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <tuple>

#include "mesh/block_sum.h"
#include "mesh/edge_balance.h"
#include "mesh/edge_uses.h"
#include "mesh/no_vertex.h"
#include "mesh/weld.h"

namespace strata {
namespace {

constexpr std::size_t kExamples = 8;

/// An unbalanced edge. Those of the first triangles become examples in the diagnosis.
struct Candidate {
  std::uint32_t triangle = 0, low = 0, high = 0, up = 0, down = 0;
  bool starts_low = true;

  friend bool operator<(const Candidate& a, const Candidate& b) {
    return std::tie(a.triangle, a.low, a.high) < std::tie(b.triangle, b.low, b.high);
  }
};

struct EdgeCounts {
  std::uint64_t edges = 0, boundary = 0, non_manifold = 0, misoriented = 0, unbalanced = 0, odd = 0;
  std::vector<Candidate> first;

  void join(const EdgeCounts& other) {
    edges += other.edges;
    boundary += other.boundary;
    non_manifold += other.non_manifold;
    misoriented += other.misoriented;
    unbalanced += other.unbalanced;
    odd += other.odd;
    first.insert(first.end(), other.first.begin(), other.first.end());
    keep_first();
  }
  void keep_first() {
    std::sort(first.begin(), first.end());
    if (first.size() > kExamples) first.resize(kExamples);
  }
};

/// Classifies one edge by its uses and counts it.
void count_edge(std::uint32_t low, std::span<const detail::EdgeUse> uses, EdgeCounts& counts) {
  const detail::EdgeUse front = uses.front();
  std::uint32_t up = 0, down = 0;
  for (const detail::EdgeUse& use : uses) ++(use.down() ? down : up);
  ++counts.edges;
  counts.boundary += up + down == 1;
  counts.non_manifold += up + down > 2;
  counts.odd += (up + down) % 2;
  if (up == down) return;
  ++counts.unbalanced;
  counts.misoriented += (up + down) % 2 == 0;
  counts.first.push_back({front.of(), low, front.high, up, down, !front.down()});
  if (counts.first.size() > 64 * kExamples) counts.keep_first();
}

/// Counts the triangles' edges between welded vertices.
EdgeCounts count_all_edges(const TriangleSoup& mesh, const std::vector<std::uint32_t>& welded,
                           const Execution& execution) {
  detail::EdgeUses uses(mesh.triangles, welded, [](std::size_t) { return true; });
  return detail::fold_blocks<EdgeCounts>(
      execution, mesh.positions.size(),
      [&](EdgeCounts& counts, std::size_t v) {
        const auto low = static_cast<std::uint32_t>(v);
        uses.for_edges(v, [&](auto edge) { count_edge(low, edge, counts); });
      },
      [](EdgeCounts& total, const EdgeCounts& part) { total.join(part); });
}

std::uint64_t count_components(const TriangleSoup& mesh, const std::vector<std::uint32_t>& welded) {
  constexpr std::uint32_t kUnused = 0xffffffffu;
  std::vector<std::uint32_t> parent(mesh.positions.size(), kUnused);
  const auto root = [&](std::uint32_t v) {
    if (parent[v] == kUnused) parent[v] = v;
    while (parent[v] != v) v = parent[v] = parent[parent[v]];  // halves the path
    return v;
  };
  for (const glm::uvec3& t : mesh.triangles) {
    const std::uint32_t a = root(welded[t.x]), b = root(welded[t.y]), c = root(welded[t.z]);
    const std::uint32_t least = std::min({a, b, c});
    parent[a] = parent[b] = parent[c] = least;
  }
  std::uint64_t count = 0;
  for (std::size_t v = 0; v < parent.size(); ++v) count += parent[v] == v;
  return count;
}

std::uint64_t count_duplicates(const TriangleSoup& mesh, const std::vector<std::uint32_t>& welded,
                               const Execution& execution) {
  std::vector<std::uint32_t> first(mesh.triangles.size());
  const auto turned = [&](std::size_t i) {
    const glm::uvec3 t = mesh.triangles[i];
    const std::uint32_t a = welded[t.x], b = welded[t.y], c = welded[t.z];
    if (a == b || b == c || c == a) {  // a triangle without area is not compared
      return glm::uvec3(static_cast<std::uint32_t>(i), detail::kNoVertex, detail::kNoVertex);
    }
    // The least corner comes first. The orientation is kept.
    if (a < b && a < c) return glm::uvec3(a, b, c);
    return b < c ? glm::uvec3(b, c, a) : glm::uvec3(c, a, b);
  };
  return mesh.triangles.size() -
         detail::weld_first<std::uint32_t>(execution, mesh.triangles.size(), turned, first.data());
}

struct FaceSums {
  double area = 0.0;
  std::uint64_t degenerate = 0, non_finite = 0;
};

FaceSums sum_faces(const TriangleSoup& mesh, const Execution& execution) {
  return detail::fold_blocks<FaceSums>(
      execution, mesh.triangles.size(),
      [&](FaceSums& sums, std::size_t i) {
        const glm::uvec3 t = mesh.triangles[i];
        const glm::dvec3 a = mesh.positions[t.x], b = mesh.positions[t.y], c = mesh.positions[t.z];
        const glm::dvec3 probe = (a + b + c) * 0.0;
        if (!(probe.x == 0.0 && probe.y == 0.0 && probe.z == 0.0)) {
          ++sums.non_finite;
          return;
        }
        const double twice = glm::length(glm::cross(b - a, c - a));
        sums.degenerate += twice == 0.0;
        sums.area += 0.5 * twice;
      },
      [](FaceSums& total, const FaceSums& part) {
        total.area += part.area;
        total.degenerate += part.degenerate;
        total.non_finite += part.non_finite;
      });
}

template <class Scalar>
bool balanced(std::span<const glm::vec<3, Scalar>> positions, std::span<const glm::uvec3> triangles,
              const Execution& execution) {
  // Edges that are balanced by index stay balanced after welding. Only the others need positions.
  return detail::unbalanced_by_position<Scalar>(
             detail::unbalanced_by_index(triangles, positions.size(), execution), positions)
      .empty();
}

}  // namespace

bool is_closed(std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles,
               const Execution& execution) {
  return balanced<double>(positions, triangles, execution);
}

bool is_closed(std::span<const glm::ivec3> positions, std::span<const glm::uvec3> triangles,
               const Execution& execution) {
  return balanced<int>(positions, triangles, execution);
}

bool is_closed(const TriangleSoup& mesh, const Execution& execution) {
  return is_closed(std::span(mesh.positions), std::span(mesh.triangles), execution);
}

MeshDiagnosis diagnose(const TriangleSoup& mesh, const Execution& execution) {
  MeshDiagnosis result;
  result.triangles = mesh.triangles.size();
  result.vertices = mesh.positions.size();
  result.bounds = bounds(mesh, execution);
  result.volume = signed_volume(mesh, execution);
  const FaceSums faces = sum_faces(mesh, execution);
  result.area = faces.area;
  result.degenerate_faces = faces.degenerate;
  result.non_finite_faces = faces.non_finite;

  std::vector<std::uint32_t> welded(mesh.positions.size());
  result.welded_vertices = detail::weld_first<double>(
      execution, mesh.positions.size(), [&](std::size_t v) { return mesh.positions[v]; },
      welded.data());
  result.duplicate_faces = count_duplicates(mesh, welded, execution);
  result.components = count_components(mesh, welded);

  const EdgeCounts counts = count_all_edges(mesh, welded, execution);
  result.edges = counts.edges;
  result.boundary_edges = counts.boundary;
  result.non_manifold_edges = counts.non_manifold;
  result.misoriented_edges = counts.misoriented;
  result.unbalanced_edges = counts.unbalanced;
  for (const Candidate& edge : counts.first) {
    const std::uint32_t element =
        mesh.face_elements.empty() ? edge.triangle : mesh.face_elements[edge.triangle];
    const glm::dvec3 low = mesh.positions[edge.low], high = mesh.positions[edge.high];
    result.examples.push_back(edge.starts_low
                                  ? UnbalancedEdge{low, high, element, edge.up, edge.down}
                                  : UnbalancedEdge{high, low, element, edge.down, edge.up});
  }
  result.closed = counts.unbalanced == 0;
  result.even = counts.odd == 0;
  result.inverted = result.closed && result.volume < 0.0;
  return result;
}

}  // namespace strata
