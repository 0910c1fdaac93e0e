#include "csg/outline/roof.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

#include "csg/outline/straight_skeleton.h"
#include "csg/outline/triangulate_pieces.h"
#include "mesh/polygons/plane_predicates.h"
#include "strata/mesh/diagnose.h"
#include "strata/mesh/soup_tools.h"

namespace strata::csg {
namespace {

using Index = std::uint32_t;

bool surrounds(const std::vector<glm::dvec2>& contour, const glm::dvec2& p) {
  bool inside = false;
  for (std::size_t i = 0; i < contour.size(); ++i) {
    const glm::dvec2 &a = contour[i], &b = contour[(i + 1) % contour.size()];
    if ((a.y > p.y) == (b.y > p.y)) continue;
    if ((orient(a, b, p) > 0) == (b.y > a.y)) inside = !inside;
  }
  return inside;
}

/// The pieces of an outline: each outer contour with its holes. A hole belongs to the smallest
/// outer contour around it.
std::vector<Outline> pieces(const Outline& outline) {
  std::vector<Outline> result;
  for (const auto& contour : outline.contours) {
    if (signed_area(contour) > 0) result.push_back({{contour}});
  }
  for (const auto& hole : outline.contours) {
    if (signed_area(hole) >= 0) continue;
    const glm::dvec2 middle = (hole[0] + hole[1]) / 2.0;
    Outline* best = nullptr;
    for (Outline& piece : result) {
      if (!surrounds(piece.contours[0], middle)) continue;
      if (best == nullptr || signed_area(piece.contours[0]) < signed_area(best->contours[0])) {
        best = &piece;
      }
    }
    if (best != nullptr) best->contours.push_back(hole);
  }
  return result;
}

/// The closed loops that directed edges make, as lists of nodes.
std::vector<std::vector<Index>> loops_of(std::vector<std::pair<Index, Index>> edges) {
  std::sort(edges.begin(), edges.end());
  std::vector<bool> used(edges.size(), false);
  std::vector<std::vector<Index>> loops;
  for (std::size_t first = 0; first < edges.size(); ++first) {
    if (used[first]) continue;
    std::vector<Index> loop;
    std::size_t at = first;
    while (true) {
      used[at] = true;
      loop.push_back(edges[at].first);
      const Index to = edges[at].second;
      auto next = std::lower_bound(edges.begin(), edges.end(), std::pair(to, Index{0}));
      while (next != edges.end() && next->first == to &&
             used[static_cast<std::size_t>(next - edges.begin())]) {
        ++next;
      }
      if (next == edges.end() || next->first != to) break;
      at = static_cast<std::size_t>(next - edges.begin());
    }
    if (loop.size() >= 3) loops.push_back(std::move(loop));
  }
  return loops;
}

/// The roof over one outer contour with its holes.
Result<TriangleSoup> piece_roof(const Outline& piece, int steps, const Jitter& jitter) {
  auto skeleton = straight_skeleton(piece, steps, jitter);
  if (!skeleton) return tl::unexpected(skeleton.error());
  TriangleSoup mesh;
  mesh.positions = skeleton->nodes;
  // The first nodes are the points of the contours.
  for (const glm::uvec3& t : triangulate(piece)) mesh.triangles.emplace_back(t.x, t.z, t.y);
  for (const glm::uvec3& t : skeleton->flats) mesh.triangles.push_back(t);
  double covered = 0;
  for (auto& face : skeleton->faces) {
    Outline flat;
    std::vector<Index> nodes;
    for (const auto& loop : loops_of(std::move(face))) {
      auto& contour = flat.contours.emplace_back();
      for (const Index node : loop) contour.emplace_back(mesh.positions[node]);
      nodes.insert(nodes.end(), loop.begin(), loop.end());
    }
    for (const glm::uvec3& t : triangulate(flat)) {
      const glm::uvec3 corner(nodes[t.x], nodes[t.y], nodes[t.z]);
      const std::array<glm::dvec2, 3> corners{mesh.positions[corner.x], mesh.positions[corner.y],
                                              mesh.positions[corner.z]};
      covered += std::abs(signed_area(corners));
      mesh.triangles.push_back(corner);
    }
  }
  double area = 0;
  for (const auto& contour : piece.contours) area += signed_area(contour);
  constexpr double kOverlap = 1e-5;
  if (!(std::abs(covered - area) <= kOverlap * area)) {
    return fail(ErrorCode::kGeometry,
                "roof: the faces cover {} of {}: the outline is too intricate", covered, area);
  }
  if (!is_closed(mesh)) {
    return fail(ErrorCode::kGeometry,
                "roof: the faces leave gaps between each other: the outline is too intricate");
  }
  return mesh;
}

}  // namespace

Result<TriangleSoup> make_roof(const Outline& outline, const std::string& method,
                               const Segments& segments) {
  const bool voronoi = method == "voronoi";
  if (!voronoi && method != "straight") {
    return fail(ErrorCode::kGeometry, "roof: the method must be 'straight' or 'voronoi', got '{}'",
                method);
  }
  glm::dvec2 low(std::numeric_limits<double>::infinity()), high = -low;
  for (const auto& contour : outline.contours) {
    for (const glm::dvec2& p : contour) low = glm::min(low, p), high = glm::max(high, p);
  }
  const double extent = std::max(high.x - low.x, high.y - low.y);
  const int steps = voronoi ? segments.count(extent / 2) : 0;
  TriangleSoup mesh;
  for (const Outline& piece : pieces(outline)) {
    auto roof = piece_roof(piece, steps, {});
    // Events that coincide within rounding can be taken in a wrong order. A little noise separates
    // them.
    for (std::uint32_t seed = 1; seed <= 4; ++seed) {
      for (const double distance : {1e-8, 1e-7, 1e-6}) {
        if (!roof) roof = piece_roof(piece, steps, {distance * extent, seed});
      }
    }
    if (!roof) return roof;
    append(mesh, *roof);
  }
  return mesh;
}

}  // namespace strata::csg
