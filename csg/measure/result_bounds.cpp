#include "csg/measure/result_bounds.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "strata/csg/picture/picture.h"
#include "strata/raster/view.h"

namespace strata::csg {
namespace {

/// Number of witness points for a side. The result reaches the side while it holds one of them.
constexpr std::size_t kWitnesses = 4;

/// A box that contains the result of a node. Each side (low x, y, z, high x, y, z) has witnesses:
/// points of the result that lie on the side. The result may not reach a side without witnesses.
struct Reach {
  Bounds box;
  std::array<std::vector<glm::dvec3>, 6> witnesses;
};

/// The position of a side; a smaller value is farther out.
double side(const Bounds& box, std::size_t i) {
  return i < 3 ? box.low[static_cast<int>(i)] : -box.high[static_cast<int>(i) - 3];
}

Reach reach_of(const Solid& solid) {
  Reach reach;
  if (!solid.mesh || solid.mesh->triangles.empty()) return reach;
  reach.box = bounds(solid);
  const auto reaches = [&](std::size_t i, const glm::dvec3& p) {
    return (i < 3 ? p[static_cast<int>(i)] : -p[static_cast<int>(i) - 3]) == side(reach.box, i);
  };
  const glm::dmat4& place = solid.world_from_mesh;
  std::vector<bool> seen(solid.mesh->positions.size(), false);
  for (const glm::uvec3& triangle : solid.mesh->triangles) {
    for (int k = 0; k < 3; ++k) {
      if (seen[triangle[k]]) continue;
      seen[triangle[k]] = true;
      const glm::dvec3 p(place * glm::dvec4(solid.mesh->positions[triangle[k]], 1.0));
      for (std::size_t i = 0; i < 6; ++i) {
        if (!reaches(i, p)) continue;
        // A round face has many points on a side. The outermost in each of four directions are
        // kept.
        auto& points = reach.witnesses[i];
        points.resize(kWitnesses, p);
        const int u = static_cast<int>(i + 1) % 3, v = static_cast<int>(i + 2) % 3;
        const auto keep = [&](std::size_t slot, double new_value, double old_value) {
          if (new_value > old_value) points[slot] = p;
        };
        keep(0, p[u] + p[v], points[0][u] + points[0][v]);
        keep(1, p[u] - p[v], points[1][u] - points[1][v]);
        keep(2, -p[u] + p[v], -points[2][u] + points[2][v]);
        keep(3, -p[u] - p[v], -points[3][u] - points[3][v]);
      }
    }
  }
  return reach;
}

bool inside_closed(const glm::dvec3& p, const Bounds& box) {
  return glm::all(glm::lessThanEqual(box.low, p)) && glm::all(glm::lessThanEqual(p, box.high));
}

void unite(Reach& reach, const Reach& one) {
  if (one.box.empty()) return;
  if (reach.box.empty()) {
    reach = one;
    return;
  }
  for (std::size_t i = 0; i < 6; ++i) {
    const double mine = side(reach.box, i), other = side(one.box, i);
    auto& points = reach.witnesses[i];
    if (other < mine) points.clear();
    if (other <= mine && points.size() < 4 * kWitnesses) {
      points.insert(points.end(), one.witnesses[i].begin(), one.witnesses[i].end());
    }
  }
  reach.box.include(one.box);
}

Reach reach_of(const Tree& tree, Tree::NodeId root) {
  std::vector<Reach> all(root + 1);  // operands come before the nodes that use them
  std::vector<Bounds> solids(tree.solids().size());
  for (Tree::NodeId id = 0; id <= root; ++id) {
    Reach& reach = all[id];
    const Tree::Node& node = tree.nodes()[id];
    if (node.operation == Operation::kSolid) {
      reach = reach_of(tree.solids()[node.first]);
      solids[node.first] = reach.box;
      continue;
    }
    const auto operands = tree.operands(id);
    if (node.operation == Operation::kUnion) {
      for (const Tree::NodeId operand : operands) unite(reach, all[operand]);
      continue;
    }
    if (operands.empty()) continue;
    reach = std::move(all[operands[0]]);
    for (const Tree::NodeId operand : operands.subspan(1)) {
      const Bounds& other = all[operand].box;
      if (node.operation == Operation::kDifference) {
        for (auto& points : reach.witnesses) {
          std::erase_if(points, [&](const glm::dvec3& p) { return inside_closed(p, other); });
        }
        continue;
      }
      reach.box.low = glm::max(reach.box.low, other.low);
      reach.box.high = glm::min(reach.box.high, other.high);
      reach.witnesses = {};
    }
    if (!glm::all(glm::lessThanEqual(reach.box.low, reach.box.high))) reach = {};
  }
  Reach& result = all[root];
  // bounds() also accounts for vast solids that are cut down.
  const Bounds left = bounds(tree, root, solids);
  for (std::size_t i = 0; i < 6; ++i) {
    if (side(left, i) != side(result.box, i)) result.witnesses[i].clear();
  }
  result.box = left;
  return std::move(result);
}

enum class Side : std::uint8_t { kOutside, kInside, kUnknown };

/// The square of the distance from `p` to a triangle.
double distance_squared(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                        const glm::dvec3& c) {
  const glm::dvec3 n = glm::cross(b - a, c - a);
  const double area = glm::dot(n, n);
  double nearest = std::numeric_limits<double>::infinity();
  bool above = area > 0;
  const glm::dvec3* const corners[] = {&a, &b, &c, &a};
  for (int i = 0; i < 3; ++i) {
    const glm::dvec3 &from = *corners[i], edge = *corners[i + 1] - from, to = p - from;
    above = above && glm::dot(glm::cross(edge, to), n) >= 0;
    const double length = glm::dot(edge, edge);
    const double t = length > 0 ? std::clamp(glm::dot(to, edge) / length, 0.0, 1.0) : 0.0;
    const glm::dvec3 off = to - t * edge;
    nearest = std::min(nearest, glm::dot(off, off));
  }
  if (!above) return nearest;
  const double height = glm::dot(p - a, n);
  return height * height / area;
}

/// The side of a solid's surface that a point is on, by the winding number along a ray in a generic
/// direction.
Side side_of(const glm::dvec3& p, const Geometry::Part& part, double tolerance) {
  const glm::dvec3 along(0.5321348901, 0.3178562391, 0.7847112345);
  const glm::dvec3 room(tolerance);
  if (!inside_closed(p, {part.box.low - room, part.box.high + room})) return Side::kOutside;
  int winding = 0;
  for (const glm::uvec3& t : part.triangles) {
    const glm::dvec3 &a = part.positions[t.x], &b = part.positions[t.y], &c = part.positions[t.z];
    const glm::dvec3 low = glm::min(glm::min(a, b), c), high = glm::max(glm::max(a, b), c);
    if (glm::any(glm::lessThan(high + room, p))) continue;  // the solid is behind the start
    if (glm::all(glm::lessThanEqual(low - room, p)) &&
        distance_squared(p, a, b, c) <= tolerance * tolerance) {
      return Side::kUnknown;
    }
    const glm::dvec3 q = glm::cross(along, c - a), n = glm::cross(b - a, c - a);
    const double area = glm::dot(b - a, q);
    if (area == 0) continue;
    const glm::dvec3 to = p - a;
    const double u = glm::dot(to, q) / area;
    const double v = glm::dot(along, glm::cross(to, b - a)) / area;
    if (u < 0 || v < 0 || u + v > 1) continue;
    if (glm::dot(c - a, glm::cross(to, b - a)) / area <= 0) continue;  // behind the start
    winding += glm::dot(n, along) > 0 ? 1 : -1;
  }
  return is_inside(part.rule, winding) ? Side::kInside : Side::kOutside;
}

/// Evaluates the tree with three values, where some solids are unknown. O(nodes), without
/// recursion.
Side value_of(const Tree& tree, Tree::NodeId root, const std::vector<Side>& solids) {
  std::vector<Side> values(root + 1);
  for (Tree::NodeId id = 0; id <= root; ++id) {
    const Tree::Node& node = tree.nodes()[id];
    if (node.operation == Operation::kSolid) {
      values[id] = solids[node.first];
      continue;
    }
    const auto operands = tree.operands(id);
    const bool unites = node.operation == Operation::kUnion;
    // One operand with this value decides; otherwise all operands must have the opposite value.
    const Side decisive = unites ? Side::kInside : Side::kOutside;
    const Side otherwise = unites ? Side::kOutside : Side::kInside;
    Side value = operands.empty() ? Side::kOutside : otherwise;
    for (std::size_t i = 0; i < operands.size() && value != decisive; ++i) {
      Side one = values[operands[i]];
      if (node.operation == Operation::kDifference && i > 0 && one != Side::kUnknown) {
        one = one == Side::kInside ? Side::kOutside : Side::kInside;
      }
      if (one == decisive || one == Side::kUnknown) value = one;
    }
    values[id] = value;
  }
  return values[root];
}

/// A vertex of a solid that a side of the result may reach.
struct Candidate {
  glm::dvec3 point;
  std::uint32_t solid;
};

/// For each solid, the vertices that a triangle uses. Only they count.
std::vector<std::vector<bool>> used_vertices(std::span<const Geometry::Part> parts) {
  std::vector<std::vector<bool>> used(parts.size());
  for (std::size_t solid = 0; solid < parts.size(); ++solid) {
    used[solid].resize(parts[solid].positions.size(), false);
    for (const glm::uvec3& t : parts[solid].triangles) {
      for (int k = 0; k < 3; ++k) used[solid][t[k]] = true;
    }
  }
  return used;
}

/// Keeps the outermost candidates of a side, the outermost first; equal ones in a fixed order.
void keep_outermost(std::vector<Candidate>& candidates, std::size_t i) {
  constexpr std::size_t kMostVertices = 64;
  const int axis = static_cast<int>(i) % 3;
  const auto out = [&](const glm::dvec3& p) { return i < 3 ? -p[axis] : p[axis]; };
  const auto first = [&](const Candidate& a, const Candidate& b) {
    if (out(a.point) != out(b.point)) return out(a.point) > out(b.point);
    if (a.solid != b.solid) return a.solid < b.solid;
    for (int k = 0; k < 3; ++k) {
      if (a.point[k] != b.point[k]) return a.point[k] < b.point[k];
    }
    return false;
  };
  const auto middle =
      candidates.begin() + static_cast<std::ptrdiff_t>(std::min(candidates.size(), kMostVertices));
  std::partial_sort(candidates.begin(), middle, candidates.end(), first);
  candidates.erase(middle, candidates.end());
}

}  // namespace

Bounds reached_vertices(const Tree& tree, Tree::NodeId root, const Geometry& geometry,
                        const Bounds& known, double tolerance) {
  constexpr std::uint64_t kMostTriangles = 50'000'000;  // visited in total
  const auto& parts = geometry.parts();
  Bounds reached;
  if (root == Tree::kNone) return reached;
  tolerance = std::max(tolerance, 1e-9 * glm::length(geometry.box().high - geometry.box().low));
  const Bounds outer = bounds(tree, root);
  std::uint64_t looked_at = 0;
  std::vector<Side> sides(parts.size(), Side::kOutside);
  const std::vector<std::vector<bool>> used = used_vertices(parts);
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < 6; ++i) {
    const int axis = static_cast<int>(i) % 3;
    candidates.clear();
    for (std::uint32_t solid = 0; solid < parts.size(); ++solid) {
      for (std::size_t at = 0; at < used[solid].size(); ++at) {
        const glm::dvec3& p = parts[solid].positions[at];
        const double out = i < 3 ? -p[axis] : p[axis];
        if (-side(known, i) < out && used[solid][at] && inside_closed(p, outer)) {
          candidates.push_back({p, solid});
        }
      }
    }
    keep_outermost(candidates, i);
    for (const Candidate& candidate : candidates) {
      if (looked_at >= kMostTriangles) break;
      for (std::size_t solid = 0; solid < parts.size(); ++solid) {
        if (solid == candidate.solid) {
          sides[solid] = Side::kInside;  // some points near the vertex lie inside its own solid
          continue;
        }
        sides[solid] = side_of(candidate.point, parts[solid], tolerance);
        looked_at += parts[solid].triangles.size();
      }
      if (value_of(tree, root, sides) != Side::kInside) continue;
      reached.include(candidate.point);
      break;
    }
  }
  return reached;
}

Result<Bounds> result_bounds(const Tree& tree, Tree::NodeId node, double relative_precision,
                             const Execution& execution) {
  if (node == Tree::kNone) return Bounds{};
  const Reach reach = reach_of(tree, node);
  const Bounds outer = reach.box;
  if (outer.empty() || std::none_of(reach.witnesses.begin(), reach.witnesses.end(),
                                    [](const auto& points) { return points.empty(); })) {
    return outer;
  }
  // Renders a view of each remaining side from outside. The nearest depth is the position of the
  // side.
  constexpr int kPixels = 256;
  Tree opaque = tree;
  opaque.set_root(node);
  for (Solid& solid : opaque.solids()) solid.colour.reset();
  Preview preview(std::move(opaque), {}, relative_precision, execution);
  const glm::dvec3 centre = 0.5 * outer.low + 0.5 * outer.high;
  Bounds box = outer;
  for (std::size_t i = 0; i < 6; ++i) {
    if (!reach.witnesses[i].empty()) continue;
    const int axis = static_cast<int>(i) % 3;
    glm::dvec3 out(0.0);
    out[axis] = i < 3 ? -1.0 : 1.0;
    Camera camera = look_at(centre + out, centre);
    camera.projection = Projection::kOrthographic;
    fit_camera(camera, outer);
    const auto view = make_view(camera, glm::ivec2(kPixels), preview.box());
    if (!view) return tl::unexpected(view.error());
    const auto image = preview.draw(*view, execution);
    if (!image) return tl::unexpected(image.error());
    const auto& depths = (*image)->depth;
    const std::uint32_t nearest = *std::min_element(depths.begin(), depths.end());
    if (nearest == SurfaceImage::kNone) return Bounds{};
    const double height = camera.distance - view->distance(nearest + 0.5);
    // A position within two pixels of the operands' box is taken as the box's side: probably no ray
    // has met the outermost point.
    const double pixel = glm::length(outer.high - outer.low) / kPixels;
    const double most = 0.5 * (outer.high[axis] - outer.low[axis]);
    if (height > most - 2 * pixel) continue;
    (i < 3 ? box.low : box.high)[axis] = centre[axis] + out[axis] * height;
  }
  return box;
}

}  // namespace strata::csg
