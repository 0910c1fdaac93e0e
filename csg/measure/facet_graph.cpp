#include "csg/measure/facet_graph.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <unordered_map>
#include <unordered_set>

#include "mesh/weld.h"
#include "strata/mesh/soup_tools.h"

namespace strata::csg {
namespace {

constexpr double kSmooth = 0.64;       ///< the cosine of 50 degrees
constexpr double kSameAngle = 1.0e-7;  ///< 1 - the cosine of 0.026 degrees

}  // namespace

FacetGraph::FacetGraph(std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles)
    : positions_(positions), triangles_(triangles), first_(positions.size()) {
  Execution alone;
  alone.threads = 1;
  detail::weld_first<double>(
      alone, positions.size(), [&](std::size_t i) { return positions[i]; }, first_.data());
  struct Side {
    std::uint64_t edge;
    std::uint32_t triangle;
    int corner;
  };
  std::vector<Side> sides;
  sides.reserve(triangles.size() * 3);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = first_[triangles[t][k]], b = first_[triangles[t][(k + 1) % 3]];
      sides.push_back({std::uint64_t{std::min(a, b)} << 32 | std::max(a, b), t, k});
      const glm::dvec3 size = glm::abs(positions[triangles[t][k]]);
      largest_ = std::max({largest_, size.x, size.y, size.z});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.triangle < b.triangle;
  });
  across_.resize(triangles.size(), {kNone, kNone, kNone});
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i;
    while (end < sides.size() && sides[end].edge == sides[i].edge) ++end;
    if (end - i == 2) {
      across_[sides[i].triangle][static_cast<std::size_t>(sides[i].corner)] = sides[i + 1].triangle;
      across_[sides[i + 1].triangle][static_cast<std::size_t>(sides[i + 1].corner)] =
          sides[i].triangle;
    }
    i = end;
  }
}

glm::dvec3 FacetGraph::normal(std::uint32_t t) const {
  const glm::dvec3 across = glm::cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0));
  const double length = glm::length(across);
  return length > 0.0 ? across / length : glm::dvec3(0.0);
}

double FacetGraph::area(std::uint32_t t) const {
  return 0.5 * glm::length(glm::cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0)));
}

double FacetGraph::circumradius(std::uint32_t t) const {
  const double a = glm::length(corner(t, 1) - corner(t, 0)),
               b = glm::length(corner(t, 2) - corner(t, 1)),
               c = glm::length(corner(t, 0) - corner(t, 2)), four_areas = 4.0 * area(t);
  return four_areas > 0.0 ? a * b * c / four_areas : 1e300;
}

bool FacetGraph::coplanar(std::uint32_t a, std::uint32_t b) const {
  return glm::dot(normal(a), normal(b)) > 1.0 - kSameAngle;
}

std::vector<std::uint32_t> FacetGraph::smooth_neighbours(std::uint32_t t) const {
  std::vector<std::uint32_t> found;
  for (const std::uint32_t other : across_[t]) {
    if (other != kNone && glm::dot(normal(t), normal(other)) > kSmooth) found.push_back(other);
  }
  return found;
}

std::vector<std::uint32_t> FacetGraph::flat_patch(std::uint32_t seed) const {
  std::vector<std::uint32_t> found{seed};
  std::unordered_set<std::uint32_t> seen{seed};
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (const std::uint32_t other : across_[found[i]]) {
      if (other == kNone || !coplanar(seed, other) || !seen.insert(other).second) continue;
      found.push_back(other);
    }
  }
  return found;
}

std::vector<std::uint32_t> FacetGraph::smooth_patch(std::uint32_t seed, std::size_t count) const {
  std::vector<std::uint32_t> found{seed};
  std::unordered_set<std::uint32_t> seen{seed};
  for (std::size_t i = 0; i < found.size() && found.size() < count; ++i) {
    for (const std::uint32_t other : smooth_neighbours(found[i])) {
      if (seen.insert(other).second) found.push_back(other);
    }
  }
  return found;
}

std::vector<glm::dvec3> FacetGraph::points(const std::vector<std::uint32_t>& facets) const {
  std::vector<std::uint32_t> corners;
  for (const std::uint32_t t : facets) {
    for (int k = 0; k < 3; ++k) corners.push_back(first_[triangles_[t][k]]);
  }
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  std::vector<glm::dvec3> result;
  for (const std::uint32_t i : corners) result.push_back(positions_[i]);
  return result;
}

double FacetGraph::width(const std::vector<std::uint32_t>& facets, const glm::dvec3& axis) const {
  const glm::dvec3 across = glm::cross(axis, normal(facets.front()));
  double low = 1e300, high = -1e300;
  for (const std::uint32_t t : facets) {
    for (int k = 0; k < 3; ++k) {
      low = std::min(low, glm::dot(across, corner(t, k)));
      high = std::max(high, glm::dot(across, corner(t, k)));
    }
  }
  return high - low;
}

double FacetGraph::extent(const std::vector<std::uint32_t>& facets) const {
  Bounds box;
  for (const std::uint32_t t : facets) {
    for (int k = 0; k < 3; ++k) box.include(corner(t, k));
  }
  return box.longest_side();
}

std::vector<std::vector<glm::dvec3>> FacetGraph::rims(
    const std::vector<std::uint32_t>& facets) const {
  const std::unordered_set<std::uint32_t> inside(facets.begin(), facets.end());
  std::unordered_map<std::uint32_t, std::uint32_t> next;
  for (const std::uint32_t t : facets) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t other = across_[t][static_cast<std::size_t>(k)];
      if (other != kNone && inside.count(other) != 0) continue;
      next[first_[triangles_[t][k]]] = first_[triangles_[t][(k + 1) % 3]];
    }
  }
  std::vector<std::vector<glm::dvec3>> loops;
  for (const std::uint32_t t : facets) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t begin = first_[triangles_[t][k]];
      std::vector<glm::dvec3> loop;
      std::uint32_t at = begin;
      for (auto found = next.find(at); found != next.end(); found = next.find(at)) {
        loop.push_back(positions_[at]);
        at = found->second;
        next.erase(found);
      }
      if (at == begin && loop.size() > 2) loops.push_back(std::move(loop));
    }
  }
  return loops;
}

}  // namespace strata::csg
