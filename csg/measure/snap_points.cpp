#include "csg/measure/snap_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <optional>
#include <tuple>

namespace strata::csg {
namespace {

constexpr std::size_t kMany = 300;             ///< triangles
constexpr double kFlatAngle = 0.99985;         ///< the cosine of one degree
constexpr std::size_t kMostTriangles = 20000;  ///< that are looked at at all

using Key = std::array<double, 3>;
Key key_of(const glm::dvec3& p) { return {p.x + 0.0, p.y + 0.0, p.z + 0.0}; }

struct Facet {
  std::uint32_t solid = 0;
  std::array<glm::dvec3, 3> corner;
  glm::dvec3 normal{0.0};
};

struct Edge {
  std::uint32_t solid = 0;
  glm::dvec3 a{0.0}, b{0.0};
};

glm::dvec3 nearest_on(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& p) {
  const glm::dvec3 d = b - a;
  const double length = glm::dot(d, d);
  return length > 0.0 ? a + d * std::clamp(glm::dot(p - a, d) / length, 0.0, 1.0) : a;
}

/// Where the stretch from a to b pierces a facet.
std::optional<glm::dvec3> pierce(const glm::dvec3& a, const glm::dvec3& b, const Facet& facet) {
  const double above = glm::dot(a - facet.corner[0], facet.normal),
               below = glm::dot(b - facet.corner[0], facet.normal);
  if (above * below > 0.0 || above == below) return {};
  const glm::dvec3 p = a + (b - a) * (above / (above - below));
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 side = facet.corner[(k + 1) % 3] - facet.corner[k];
    const double size = glm::length(side);
    if (glm::dot(glm::cross(side, p - facet.corner[k]), facet.normal) < -1e-9 * size * size) {
      return {};
    }
  }
  return p;
}

class Finder {
 public:
  Finder(const TreeRays& rays, const glm::dvec3& at, double radius) : at_(at), radius_(radius) {
    const Bounds box{at - glm::dvec3(radius), at + glm::dvec3(radius)};
    rays.near(box, [&](std::uint32_t solid, std::uint32_t triangle) {
      if (facets_.size() >= kMostTriangles) return;
      const Geometry::Part& part = rays.geometry().parts()[solid];
      Facet facet;
      facet.solid = solid;
      for (int k = 0; k < 3; ++k) {
        facet.corner[static_cast<std::size_t>(k)] = part.positions[part.triangles[triangle][k]];
      }
      const glm::dvec3 across =
          glm::cross(facet.corner[1] - facet.corner[0], facet.corner[2] - facet.corner[0]);
      if (!(glm::length(across) > 0.0)) return;
      facet.normal = glm::normalize(across);
      facets_.push_back(facet);
    });
  }

  std::vector<SnapPoint> run() {
    corners();
    if (facets_.size() > kMany) return std::move(found_);
    edges();
    for (const Edge& edge : edges_) {
      offer(Snap::kMidpoint, (edge.a + edge.b) * 0.5);
      offer(Snap::kEdge, nearest_on(edge.a, edge.b, at_));
      for (const Facet& facet : facets_) {
        if (facet.solid == edge.solid) continue;
        if (const auto p = pierce(edge.a, edge.b, facet)) offer(Snap::kVertex, *p);
      }
    }
    for (std::size_t i = 0; i < facets_.size(); ++i) {
      for (std::size_t j = i + 1; j < facets_.size(); ++j) meet(facets_[i], facets_[j]);
    }
    return std::move(found_);
  }

 private:
  void offer(Snap kind, const glm::dvec3& p) {
    if (glm::distance(p, at_) <= radius_) found_.push_back({kind, p});
  }

  /// Where facets of one solid with different planes meet in a point.
  void corners() {
    struct Seen {
      glm::dvec3 normal{0.0};
      bool corner = false;
    };
    std::map<std::pair<std::uint32_t, Key>, Seen> seen;
    for (const Facet& facet : facets_) {
      for (const glm::dvec3& p : facet.corner) {
        if (glm::distance(p, at_) > radius_) continue;
        const auto [entry, fresh] = seen.try_emplace({facet.solid, key_of(p)}, Seen{facet.normal});
        Seen& one = entry->second;
        if (fresh || one.corner || glm::dot(one.normal, facet.normal) > kFlatAngle) continue;
        one.corner = true;
        found_.push_back({Snap::kVertex, p});
      }
    }
  }

  /// The edges that can be seen: those between facets of different planes.
  void edges() {
    std::map<std::tuple<std::uint32_t, Key, Key>, std::vector<const Facet*>> uses;
    for (const Facet& facet : facets_) {
      for (std::size_t k = 0; k < 3; ++k) {
        Key a = key_of(facet.corner[k]), b = key_of(facet.corner[(k + 1) % 3]);
        if (b < a) std::swap(a, b);
        uses[{facet.solid, a, b}].push_back(&facet);
      }
    }
    for (const auto& [edge, facets] : uses) {
      if (facets.size() == 2 && glm::dot(facets[0]->normal, facets[1]->normal) > kFlatAngle) {
        continue;
      }
      const auto& [solid, a, b] = edge;
      edges_.push_back({solid, {a[0], a[1], a[2]}, {b[0], b[1], b[2]}});
    }
  }

  /// The line where facets of two solids cut each other.
  void meet(const Facet& a, const Facet& b) {
    if (a.solid == b.solid) return;
    std::vector<glm::dvec3> ends;
    const auto collect = [&](const Facet& from, const Facet& into) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (const auto p = pierce(from.corner[k], from.corner[(k + 1) % 3], into)) {
          ends.push_back(*p);
        }
      }
    };
    collect(a, b);
    collect(b, a);
    if (ends.size() < 2) return;
    glm::dvec3 farthest = ends[1];
    for (const glm::dvec3& p : ends) {
      if (glm::distance(p, ends[0]) > glm::distance(farthest, ends[0])) farthest = p;
    }
    offer(Snap::kEdge, nearest_on(ends[0], farthest, at_));
  }

  glm::dvec3 at_;
  double radius_;
  std::vector<Facet> facets_;
  std::vector<Edge> edges_;
  std::vector<SnapPoint> found_;
};

}  // namespace

std::vector<SnapPoint> snap_points(const TreeRays& rays, const glm::dvec3& at, double radius) {
  return Finder(rays, at, radius).run();
}

}  // namespace strata::csg
