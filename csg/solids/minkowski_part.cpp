// The parts of Minkowski operands: the flat facets of their boundaries and points inside them.
//
// This work is based on: S. Hertel, K. Mehlhorn, "Fast triangulation of simple polygons", 1983.
// Diagonals are removed one after another where the merged polygon stays convex.
#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "csg/solids/minkowski.h"
#include "mesh/weld.h"
#include "strata/mesh/soup_tools.h"

namespace strata::csg {
namespace {

/// Disjoint sets of indices.
class Groups {
 public:
  explicit Groups(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t from, std::uint32_t to) { parent_[root(from)] = root(to); }

 private:
  std::vector<std::uint32_t> parent_;
};

/// Merges neighbouring triangles into convex polygons.
class FacetMerger {
 public:
  explicit FacetMerger(const TriangleSoup& mesh) {
    const Bounds box = bounds(mesh);
    if (box.empty()) return;
    tolerance_ = 1e-10 * glm::length(box.high - box.low);
    detail::WeldTable<double> table(mesh.positions.size());
    const auto weld = [&](std::uint32_t vertex) {
      return detail::find_or_keep(table, positions_, mesh.positions[vertex]);
    };
    for (const glm::uvec3& t : mesh.triangles) {
      Polygon polygon{{weld(t.x), weld(t.y), weld(t.z)}, {}};
      const glm::dvec3& a = positions_[polygon.corners[0]];
      polygon.area =
          glm::cross(positions_[polygon.corners[1]] - a, positions_[polygon.corners[2]] - a);
      if (glm::length(polygon.area) > 0.0) polygons_.push_back(std::move(polygon));
    }
  }

  Facets run() {
    std::unordered_map<std::uint64_t, std::uint32_t> polygon_at;
    for (std::uint32_t i = 0; i < polygons_.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        const auto [at, is_new] = polygon_at.try_emplace(key(corner(i, k), corner(i, k + 1)), i);
        if (!is_new) at->second = kMany;
      }
    }
    Groups groups(polygons_.size());
    std::vector<glm::uvec3> triangles;
    for (const Polygon& p : polygons_) {
      triangles.emplace_back(p.corners[0], p.corners[1], p.corners[2]);
    }
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = triangles[i][k], b = triangles[i][(k + 1) % 3];
        const auto here = polygon_at.find(key(a, b)), there = polygon_at.find(key(b, a));
        if (there == polygon_at.end() || here->second == kMany || there->second == kMany) continue;
        const std::uint32_t one = groups.root(i), other = groups.root(there->second);
        if (one == other || !merge(polygons_[one], polygons_[other], a, b)) continue;
        groups.join(other, one);
      }
    }
    Facets facets;
    for (const Polygon& polygon : polygons_) {
      if (polygon.corners.empty()) continue;
      for (const std::uint32_t v : polygon.corners) facets.corners.push_back(positions_[v]);
      facets.ends.push_back(static_cast<std::uint32_t>(facets.corners.size()));
    }
    return facets;
  }

 private:
  static constexpr std::uint32_t kMany = ~std::uint32_t{0};
  static constexpr std::size_t kMostCorners = 32;  // merging compares every corner with every edge
  struct Polygon {
    std::vector<std::uint32_t> corners;  // empty: merged into another polygon
    glm::dvec3 area{0.0};                // twice the area, along the normal
  };

  static std::uint64_t key(std::uint32_t from, std::uint32_t to) {
    return std::uint64_t{from} << 32 | to;
  }
  [[nodiscard]] std::uint32_t corner(std::uint32_t polygon, int k) const {
    return polygons_[polygon].corners[static_cast<std::size_t>(k % 3)];
  }

  /// Merges `other` into `one` over their common edge from a to b if the result is convex.
  bool merge(Polygon& one, Polygon& other, std::uint32_t a, std::uint32_t b) {
    if (one.corners.size() + other.corners.size() > kMostCorners) return false;
    if (!(glm::dot(one.area, other.area) > 0.0)) return false;
    std::vector<std::uint32_t> corners;
    const auto add = [&](const Polygon& polygon, std::uint32_t first, std::uint32_t last) {
      const auto at = std::find(polygon.corners.begin(), polygon.corners.end(), first);
      const auto from = static_cast<std::size_t>(at - polygon.corners.begin());
      const std::size_t count = polygon.corners.size();
      for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t v = polygon.corners[(from + i) % count];
        if (v != last) corners.push_back(v);
      }
    };
    add(one, b, a);
    add(other, a, b);
    // Removes further edges that both polygons share.
    for (std::size_t i = 0; corners.size() > 2 && i < corners.size();) {
      const std::size_t n = corners.size();
      if (corners[(i + n - 1) % n] != corners[(i + 1) % n]) {
        ++i;
        continue;
      }
      const std::size_t next = (i + 1) % n;
      corners.erase(corners.begin() + static_cast<std::ptrdiff_t>(std::max(i, next)));
      corners.erase(corners.begin() + static_cast<std::ptrdiff_t>(std::min(i, next)));
      i = 0;
    }
    const glm::dvec3 area = one.area + other.area;
    if (!is_convex(corners, glm::normalize(area))) return false;
    one.corners = std::move(corners);
    one.area = area;
    other.corners.clear();
    return true;
  }

  /// Whether all corners lie in one plane and on the inner side of each edge. Edges between points
  /// that only rounding has separated are skipped: they have no direction.
  [[nodiscard]] bool is_convex(std::span<const std::uint32_t> corners,
                               const glm::dvec3& normal) const {
    if (corners.size() < 3) return false;
    const glm::dvec3& origin = positions_[corners[0]];
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const glm::dvec3& p = positions_[corners[i]];
      if (std::abs(glm::dot(p - origin, normal)) > tolerance_) return false;
      const glm::dvec3 edge = positions_[corners[(i + 1) % corners.size()]] - p;
      const double length = glm::length(edge);
      if (length < 10.0 * tolerance_) continue;
      const glm::dvec3 inwards = glm::cross(normal, edge) / length;
      for (const std::uint32_t other : corners) {
        if (glm::dot(positions_[other] - p, inwards) < -tolerance_) return false;
      }
    }
    return true;
  }

  std::vector<glm::dvec3> positions_;
  std::vector<Polygon> polygons_;
  double tolerance_ = 0.0;
};

/// The distance along `way` at which a ray meets a triangle; infinity if it does not. The triangle
/// is taken slightly larger, so that no ray passes between two triangles along their edge.
double distance_to(const glm::dvec3& origin, const glm::dvec3& way, const glm::dvec3& a,
                   const glm::dvec3& b, const glm::dvec3& c) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const glm::dvec3 u = b - a, v = c - a, across = glm::cross(way, v);
  const double scale = glm::dot(u, across);
  if (scale == 0.0) return kNone;
  const glm::dvec3 from = origin - a, other = glm::cross(from, u);
  const double s = glm::dot(from, across) / scale, t = glm::dot(way, other) / scale;
  constexpr double kMore = 1e-9;
  return s >= -kMore && t >= -kMore && s + t <= 1.0 + kMore ? glm::dot(v, other) / scale : kNone;
}

/// A point inside each component. Triangles count as connected when they have corners in the same
/// cell of a grid much finer than the mesh, or of that grid moved by half a cell. A component split
/// in two only makes the sum larger to write.
std::vector<glm::dvec3> find_anchors(const TriangleSoup& mesh, const Execution& execution) {
  const Bounds box = bounds(mesh);
  const double size = glm::length(box.high - box.low), cell = 1e-6 * size;
  const std::vector<glm::uvec3>& triangles = mesh.triangles;
  Groups groups(triangles.size());
  std::unordered_map<std::uint64_t, std::uint32_t> owner;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (int k = 0; k < 6; ++k) {
      const glm::dvec3 at = (mesh.positions[triangles[t][k % 3]] - box.low) / cell;
      // 20 bits per axis suffice for 1e6 cells. The top bit of the key tells the two grids apart.
      const auto part = [&](double x) {
        return static_cast<std::uint64_t>(std::floor(x + (k < 3 ? 0.0 : 0.5)));
      };
      const std::uint64_t key =
          std::uint64_t{k < 3 ? 0u : 1u} << 63 | part(at.x) << 42 | part(at.y) << 21 | part(at.z);
      const auto [found, is_new] = owner.try_emplace(key, t);
      if (!is_new) groups.join(t, found->second);
    }
  }
  // The anchor lies below the middle of the component's largest triangle, halfway through the
  // material.
  std::unordered_map<std::uint32_t, std::uint32_t> largest;
  const auto area = [&](std::uint32_t t) {
    const glm::dvec3& a = mesh.positions[triangles[t].x];
    return glm::cross(mesh.positions[triangles[t].y] - a, mesh.positions[triangles[t].z] - a);
  };
  std::vector<std::uint32_t> roots;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const auto [at, is_new] = largest.try_emplace(groups.root(t), t);
    if (is_new) roots.push_back(at->first);
    if (glm::length(area(t)) > glm::length(area(at->second))) at->second = t;
  }
  std::vector<glm::dvec3> anchors(roots.size());
  parallel_for(execution, roots.size(), [&](std::size_t i, int) {
    const std::uint32_t t = largest.at(roots[i]);
    const auto point = [&](std::uint32_t triangle, int k) -> const glm::dvec3& {
      return mesh.positions[triangles[triangle][k]];
    };
    const glm::dvec3 origin = (point(t, 0) + point(t, 1) + point(t, 2)) / 3.0;
    const double length = glm::length(area(t));
    anchors[i] = origin;
    if (length == 0.0) return;
    const glm::dvec3 way = -area(t) / length;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::uint32_t other = 0; other < triangles.size(); ++other) {
      if (other == t) continue;
      const double d = distance_to(origin, way, point(other, 0), point(other, 1), point(other, 2));
      if (d > 1e-9 * size) nearest = std::min(nearest, d);
    }
    if (std::isfinite(nearest)) anchors[i] += 0.5 * nearest * way;
  });
  return anchors;
}

}  // namespace

Facets merge_facets(const TriangleSoup& mesh) { return FacetMerger(mesh).run(); }

Result<MinkowskiPart> make_part(const TriangleSoup& mesh, std::uint32_t source,
                                const Execution& execution) {
  MinkowskiPart part;
  part.source = source;
  if (mesh.triangles.empty()) return part;
  auto hull = convex_hull_with_edges(mesh.positions, execution.stop);
  if (!hull && hull.error().code != ErrorCode::kGeometry) return tl::unexpected(hull.error());
  if (hull) {
    const double whole = signed_volume(hull->mesh);
    if (std::abs(whole - signed_volume(mesh)) <= 1e-9 * whole) {
      part.hull = *std::move(hull);
      return part;
    }
  }
  part.facets = merge_facets(mesh);
  part.anchors = find_anchors(mesh, execution);
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return part;
}

}  // namespace strata::csg
