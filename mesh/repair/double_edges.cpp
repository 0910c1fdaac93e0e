#include "mesh/repair/double_edges.h"

#include <algorithm>
#include <array>
#include <map>
#include <tuple>

namespace strata {
namespace {

using Index = std::uint32_t;
constexpr Index kNone = 0xffffffffu;

// A half-edge at an edge that more than two triangles share.
struct Use {
  Index low, high;  // vertices
  Index wedge;
  Index triangle, corner;
};

// Divides a triangle whose edges k have the middle vertex middle[k], or kNone.
void divide(RoundedMesh& mesh, Index triangle, const std::array<Index, 3>& middle) {
  const glm::uvec3 t = mesh.triangles[triangle];
  std::vector<glm::uvec3> parts;
  const auto is_middle = [&middle](Index vertex) {
    return std::find(middle.begin(), middle.end(), vertex) != middle.end();
  };
  std::vector<Index> rest;  // a polygon without the corners between two middle vertices
  for (int k = 0; k < 3; ++k) {
    const Index previous = middle[static_cast<std::size_t>((k + 2) % 3)],
                next = middle[static_cast<std::size_t>(k)];
    if (previous != kNone && next != kNone) {
      parts.emplace_back(previous, t[k], next);
    } else {
      rest.push_back(t[k]);
    }
    if (next != kNone) rest.push_back(next);
  }
  // Three or four corners are left. Four are cut from the middle vertex if there is only one, which
  // lies on a line with its neighbours, and else from the least.
  const auto least = std::min_element(rest.begin(), rest.end(), [&](Index a, Index b) {
    if (parts.empty() && (is_middle(a) || is_middle(b))) return is_middle(a);
    const exact::FilePoint &p = mesh.positions[a], &q = mesh.positions[b];
    return std::tie(p.x, p.y, p.z) < std::tie(q.x, q.y, q.z);
  });
  std::rotate(rest.begin(), least, rest.end());
  for (std::size_t i = 2; i < rest.size(); ++i) {
    parts.emplace_back(rest[0], rest[i - 1], rest[i]);
  }
  mesh.triangles[triangle] = parts.front();
  mesh.triangles.insert(mesh.triangles.end(), parts.begin() + 1, parts.end());
  mesh.labels.resize(mesh.triangles.size(), Index(mesh.labels[triangle]));
  mesh.groups[triangle] = RoundedMesh::kNoGroup;
  mesh.groups.resize(mesh.triangles.size(), RoundedMesh::kNoGroup);
}

std::vector<Use> sorted_uses(const std::vector<glm::uvec3>& triangles,
                             std::span<const WedgeEdge> wedges) {
  std::vector<Use> uses;
  for (const WedgeEdge& edge : wedges) {
    const glm::uvec3& t = triangles[edge.triangle];
    const Index a = t[static_cast<int>(edge.corner)],
                b = t[static_cast<int>(edge.corner == 2 ? 0 : edge.corner + 1)];
    uses.push_back({std::min(a, b), std::max(a, b), edge.wedge, edge.triangle, edge.corner});
  }
  std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) {
    return std::tie(a.low, a.high, a.wedge) < std::tie(b.low, b.high, b.wedge);
  });
  return uses;
}

}  // namespace

std::size_t divide_double_edges(RoundedMesh& mesh, std::span<const WedgeEdge> wedges,
                                const WrittenPositions& written) {
  const std::vector<Use> uses = sorted_uses(mesh.triangles, wedges);
  std::vector<exact::FilePoint>& positions = mesh.positions;
  const std::size_t count = positions.size();
  std::map<Index, std::array<Index, 3>> middles;  // of the edges of triangles
  for (std::size_t begin = 0, end = 0; begin < uses.size(); begin = end) {
    const Use& first = uses[begin];
    while (end < uses.size() && uses[end].low == first.low && uses[end].high == first.high) ++end;
    if (end - begin <= 2) continue;
    const exact::FilePoint sum = positions[first.low] + positions[first.high];
    for (std::size_t i = begin; i < end; ++i) {
      if (i == begin || uses[i].wedge != uses[i - 1].wedge) {
        positions.push_back(written.round(sum >> exact::FilePoint(1)));
      }
      auto& middle =
          middles.try_emplace(uses[i].triangle, std::array{kNone, kNone, kNone}).first->second;
      middle[uses[i].corner] = static_cast<Index>(positions.size() - 1);
    }
  }
  for (const auto& [triangle, middle] : middles) divide(mesh, triangle, middle);
  return positions.size() - count;
}

}  // namespace strata
