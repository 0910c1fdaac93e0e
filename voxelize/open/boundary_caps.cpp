#include "voxelize/open/boundary_caps.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <span>
#include <utility>

#include "mesh/disjoint_sets.h"
#include "raster/triangle_setup.h"
#include "strata/mesh/diagnose.h"

namespace strata {
namespace {

constexpr std::uint32_t kNone = ~std::uint32_t{0};
/// A loop is flat when its vertices are no farther from its plane than this share of its size.
constexpr double kFlat = 0.1;

bool before(const glm::ivec3& p, const glm::ivec3& q) {
  return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : p.z < q.z;
}

/// The mesh's boundary: directed edges between vertices that are numbered by position, so that
/// nothing depends on the order of the triangles. As many edges enter a vertex as leave it.
struct Boundary {
  std::vector<std::uint32_t> vertices;  ///< index in the mesh, by number
  std::vector<std::uint32_t> begin;     ///< first edge that leaves a vertex; one more at the end
  std::vector<std::uint32_t> to;        ///< by edge, sorted within a vertex
};

/// @param by_index  edges that are unbalanced if vertices of equal positions differ
Boundary boundary_of(const LatticeMesh& mesh, std::vector<detail::EdgeSum> by_index) {
  const auto edges = detail::unbalanced_by_position<int>(
      std::move(by_index), std::span<const glm::ivec3>(mesh.vertices));
  Boundary result;
  for (const detail::EdgeSum& edge : edges) {
    result.vertices.insert(result.vertices.end(), {edge.low, edge.high});
  }
  const auto by_position = [&](std::uint32_t a, std::uint32_t b) {
    return before(mesh.vertices[a], mesh.vertices[b]);
  };
  auto& vertices = result.vertices;
  std::sort(vertices.begin(), vertices.end(), by_position);
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  const auto number = [&](std::uint32_t vertex) {
    return static_cast<std::uint32_t>(
        std::lower_bound(vertices.begin(), vertices.end(), vertex, by_position) - vertices.begin());
  };
  std::vector<std::pair<std::uint32_t, std::uint32_t>> directed;
  for (const detail::EdgeSum& edge : edges) {
    std::pair ends(number(edge.low), number(edge.high));
    if (edge.sum < 0) std::swap(ends.first, ends.second);
    directed.insert(directed.end(), static_cast<std::size_t>(std::abs(edge.sum)), ends);
  }
  std::sort(directed.begin(), directed.end());
  result.begin.assign(vertices.size() + 1, 0);
  result.to.reserve(directed.size());
  for (const auto& [from, to] : directed) {
    ++result.begin[from + 1];
    result.to.push_back(to);
  }
  for (std::size_t i = 0; i < vertices.size(); ++i) result.begin[i + 1] += result.begin[i];
  return result;
}

/// Calls loop(vertices) for simple loops that use every edge of the boundary once, in its
/// direction.
template <class Loop>
void for_each_loop(const Boundary& boundary, Loop&& loop) {
  const std::size_t count = boundary.vertices.size();
  std::vector<std::uint32_t> next(boundary.begin.begin(), boundary.begin.end() - 1);
  std::vector<std::uint32_t> place(count, kNone);  // of a vertex on the path
  std::vector<std::uint32_t> path;
  for (std::uint32_t start = 0; start < count; ++start) {
    path.assign(1, start);
    place[start] = 0;
    // A path that enters a vertex can leave it, so it ends at its start alone.
    while (next[path.back()] < boundary.begin[path.back() + 1]) {
      const std::uint32_t to = boundary.to[next[path.back()]++];
      if (place[to] == kNone) {
        place[to] = static_cast<std::uint32_t>(path.size());
        path.push_back(to);
        continue;
      }
      loop(std::span<const std::uint32_t>(path).subspan(place[to]));
      while (path.back() != to) {
        place[path.back()] = kNone;
        path.pop_back();
      }
    }
    place[start] = kNone;
  }
}

/// Twice the area in square lattice steps, a whole number so that sums do not depend on their
/// order.
Int128 area_of(const LatticeMesh& mesh, const glm::uvec3& t) {
  const glm::dvec3 a = mesh.vertices[t.x];
  return static_cast<Int128>(glm::length(
      glm::cross(glm::dvec3(mesh.vertices[t.y]) - a, glm::dvec3(mesh.vertices[t.z]) - a)));
}

/// The pieces of a mesh, connected through positions, and the areas of their triangles and caps.
class Pieces {
 public:
  /// @param seams  edges at whose ends vertices of equal positions may differ
  Pieces(const LatticeMesh& mesh, std::span<const detail::EdgeSum> seams)
      : mesh_(mesh), connected_(mesh.vertices.size()), area_(mesh.vertices.size()) {
    for (const glm::uvec3& t : mesh.triangles) {
      connected_.join(t.x, t.y);
      connected_.join(t.y, t.z);
    }
    std::vector<std::uint32_t> ends;
    for (const detail::EdgeSum& seam : seams) ends.insert(ends.end(), {seam.low, seam.high});
    std::sort(ends.begin(), ends.end(), [&](std::uint32_t a, std::uint32_t b) {
      return before(mesh.vertices[a], mesh.vertices[b]);
    });
    for (std::size_t i = 1; i < ends.size(); ++i) {
      if (mesh.vertices[ends[i - 1]] == mesh.vertices[ends[i]]) {
        connected_.join(ends[i - 1], ends[i]);
      }
    }
  }
  void add_cap(const glm::uvec3& t) { area_[connected_.find(t.x)].caps += area_of(mesh_, t); }
  /// Adds up the mesh's area, until pieces are known to be large. @pre all caps are added
  void add_mesh() {
    for (const glm::uvec3& t : mesh_.triangles) {
      Area& area = area_[connected_.find(t.x)];
      if (area.mostly_open()) area.mesh += area_of(mesh_, t);
    }
  }
  /// Whether the caps of the piece at a vertex are nearly as large as it is.
  [[nodiscard]] bool mostly_open(std::uint32_t vertex) {
    return area_[connected_.find(vertex)].mostly_open();
  }

 private:
  struct Area {
    Int128 mesh = 0, caps = 0;
    [[nodiscard]] bool mostly_open() const { return 3 * caps >= 2 * mesh; }
  };
  const LatticeMesh& mesh_;
  detail::DisjointSets connected_;  ///< vertices
  std::vector<Area> area_;
};

bool is_flat(const LatticeMesh& mesh, std::span<const glm::uvec3> caps) {
  glm::dvec3 normal(0.0);
  for (const glm::uvec3& t : caps) {
    const glm::dvec3 a = mesh.vertices[t.x];
    normal += glm::cross(glm::dvec3(mesh.vertices[t.y]) - a, glm::dvec3(mesh.vertices[t.z]) - a);
  }
  const double length = glm::length(normal);
  double low = 0, high = 0, size = 0;  // heights along the normal, from the first vertex
  for (const glm::uvec3& t : caps) {
    for (int i = 0; i < 3; ++i) {
      const glm::dvec3 from = mesh.vertices[t[i]] - mesh.vertices[caps[0].x];
      const double height = glm::dot(from, normal);
      low = std::min(low, height), high = std::max(high, height);
      size = std::max(size, glm::length(from));
    }
  }
  return length > 0 && high - low <= kFlat * size * length;
}

}  // namespace

MeshClosedness find_closedness(const TriangleSoup& mesh, bool even_is_closed,
                               const Execution& execution) {
  MeshClosedness result;
  auto seams = detail::unbalanced_by_index(mesh.triangles, mesh.positions.size(), execution);
  if (seams.size() <= mesh.triangles.size() / 4) result.seams = seams;
  result.closed =
      detail::unbalanced_by_position<double>(std::move(seams), mesh.positions).empty() ||
      (even_is_closed && diagnose(mesh, execution).even);
  return result;
}

BoundaryCaps boundary_caps(const LatticeMesh& mesh, const MeshClosedness& found,
                           const Execution& execution) {
  const auto seams =
      found.seams ? *found.seams
                  : detail::unbalanced_by_index(mesh.triangles, mesh.vertices.size(), execution);
  BoundaryCaps result;
  if (seams.empty()) return result;
  const Boundary boundary = boundary_of(mesh, seams);
  if (boundary.to.empty()) return result;

  Pieces pieces(mesh, seams);
  std::vector<glm::uvec3> caps;
  std::vector<std::size_t> loops(1, 0);  // their first caps, and the end
  std::vector<std::pair<std::size_t, std::size_t>> arcs;
  for_each_loop(boundary, [&](std::span<const std::uint32_t> loop) {
    const auto vertex = [&](std::size_t i) { return boundary.vertices[loop[i]]; };
    arcs.assign(1, {0, loop.size() - 1});
    while (!arcs.empty()) {
      const auto [first, last] = arcs.back();
      arcs.pop_back();
      if (last - first < 2) continue;
      const std::size_t middle = (first + last) / 2;
      caps.emplace_back(vertex(last), vertex(middle), vertex(first));  // against the loop
      pieces.add_cap(caps.back());
      arcs.emplace_back(first, middle);
      arcs.emplace_back(middle, last);
    }
    loops.push_back(caps.size());
  });
  pieces.add_mesh();
  std::vector<glm::uvec3> sure;
  for (std::size_t i = 0; i + 1 < loops.size(); ++i) {
    const auto loop = std::span(caps).subspan(loops[i], loops[i + 1] - loops[i]);
    if (loop.empty()) continue;
    const bool doubtful = pieces.mostly_open(loop[0].x) || !is_flat(mesh, loop);
    auto& to = doubtful ? result.triangles : sure;
    to.insert(to.end(), loop.begin(), loop.end());
  }
  result.doubtful = result.triangles.size();
  result.triangles.insert(result.triangles.end(), sure.begin(), sure.end());
  return result;
}

}  // namespace strata
