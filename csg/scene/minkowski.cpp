#include "csg/scene/minkowski.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>
#include <unordered_map>

#include "csg/scene/hull.h"
#include "mesh/soup_tools.h"

namespace strata::csg {
namespace {

constexpr double kMostHulls = 3e6;
constexpr double kMostPoints = 4e8;            // into all hulls of a sum: minutes
constexpr std::size_t kMostPairs = 4'000'000;  // of vertices of two convex parts

/// A point of each component, where triangles are connected that have corners in the same cell of
/// a grid much finer than the mesh; too many components only make the sum larger to write.
std::vector<glm::dvec3> find_anchors(std::span<const glm::dvec3> triangles) {
  glm::dvec3 low = triangles[0], high = triangles[0];
  for (const glm::dvec3& p : triangles) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const double cell = 1e-6 * glm::length(high - low);
  std::vector<std::uint32_t> parent(triangles.size() / 3);
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::unordered_map<std::uint64_t, std::uint32_t> owner;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const glm::dvec3 at = (triangles[i] - low) / cell;
    // 21 bits an axis are enough for 1e6 cells.
    const auto part = [&](double x) { return static_cast<std::uint64_t>(std::llround(x)); };
    const std::uint64_t key = part(at.x) << 42 | part(at.y) << 21 | part(at.z);
    const auto triangle = static_cast<std::uint32_t>(i / 3);
    const auto [found, is_new] = owner.try_emplace(key, triangle);
    if (!is_new) parent[root(triangle)] = root(found->second);
  }
  std::vector<glm::dvec3> anchors;
  for (std::uint32_t t = 0; t < parent.size(); ++t) {
    if (root(t) == t) anchors.push_back(triangles[3 * std::size_t{t}]);
  }
  return anchors;
}

/// The vertices of the hull of `points`; none if they lie in a plane.
std::vector<glm::dvec3> hull_vertices(std::span<const glm::dvec3> points) {
  auto hull = convex_hull(points);
  return hull ? std::move(hull->positions) : std::vector<glm::dvec3>();
}

/// Those of `points` that lie farthest along one of `directions`.
std::vector<glm::dvec3> extremes(std::span<const glm::dvec3> points,
                                 std::span<const glm::dvec3> directions) {
  std::vector<bool> taken(points.size(), false);
  for (const glm::dvec3& direction : directions) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < points.size(); ++i) {
      if (glm::dot(points[i], direction) > glm::dot(points[best], direction)) best = i;
    }
    taken[best] = true;
  }
  std::vector<glm::dvec3> result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (taken[i]) result.push_back(points[i]);
  }
  return result;
}

/// Even directions: a Fibonacci spiral on the sphere.
std::vector<glm::dvec3> even_directions(int count) {
  std::vector<glm::dvec3> directions;
  const double turn = 2.39996322972865332;  // the golden angle
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - 2.0 * (i + 0.5) / count, r = std::sqrt(1.0 - z * z);
    directions.emplace_back(r * std::cos(turn * i), r * std::sin(turn * i), z);
  }
  return directions;
}

std::vector<glm::dvec3> pairwise(std::span<const glm::dvec3> a, std::span<const glm::dvec3> b) {
  std::vector<glm::dvec3> sums;
  sums.reserve(a.size() * b.size());
  for (const glm::dvec3& p : a) {
    for (const glm::dvec3& q : b) sums.push_back(p + q);
  }
  return sums;
}

MinkowskiPart moved(const MinkowskiPart& part, const glm::dvec3& by) {
  MinkowskiPart result = part;
  for (glm::dvec3& p : result.triangles) p += by;
  for (glm::dvec3& p : result.anchors) p += by;
  result.offset += by;
  return result;
}

/// One convex sum to be made: of `a` with `b`, both convex point sets.
struct Task {
  std::span<const glm::dvec3> a, b;
};

}  // namespace

MinkowskiPart make_part(const TriangleSoup& mesh, std::uint32_t source) {
  MinkowskiPart part;
  part.source = source;
  if (mesh.triangles.empty()) return part;
  if (const auto hull = convex_hull(mesh.positions)) {
    const double whole = signed_volume(*hull);
    if (std::abs(whole - signed_volume(mesh)) <= 1e-9 * whole) {
      part.hull = hull->positions;
      return part;
    }
  }
  part.triangles.reserve(3 * mesh.triangles.size());
  for (const glm::uvec3& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) part.triangles.push_back(mesh.positions[t[i]]);
  }
  part.anchors = find_anchors(part.triangles);
  return part;
}

Result<std::vector<MinkowskiPart>> minkowski_sum(std::span<const MinkowskiPart> a,
                                                 std::span<const MinkowskiPart> b,
                                                 bool& approximate, const Execution& execution) {
  std::vector<MinkowskiPart> result;
  std::vector<Task> tasks;
  const auto pieces = [](const MinkowskiPart& part) {
    return part.convex() ? 1.0 : static_cast<double>(part.triangles.size()) / 3.0;
  };
  const auto piece_points = [](const MinkowskiPart& part) {
    return part.convex() ? static_cast<double>(part.hull.size()) : 3.0;
  };
  double hulls = 0.0, points = 0.0;
  for (const MinkowskiPart& p : a) {
    for (const MinkowskiPart& q : b) {
      hulls += pieces(p) * pieces(q);
      points += pieces(p) * pieces(q) * piece_points(p) * piece_points(q);
    }
  }
  if (hulls > kMostHulls || points > kMostPoints) {
    return fail(ErrorCode::kLimit, "it would take {:.0f} convex hulls of {:.0f} points in all",
                hulls, points);
  }
  const auto piece = [](const MinkowskiPart& part, std::size_t i) {
    return part.convex() ? std::span<const glm::dvec3>(part.hull)
                         : std::span<const glm::dvec3>(part.triangles).subspan(3 * i, 3);
  };
  for (const MinkowskiPart& p : a) {
    for (const MinkowskiPart& q : b) {
      if ((p.convex() && p.hull.empty()) || (q.convex() && q.hull.empty())) continue;
      for (std::size_t i = 0; i < static_cast<std::size_t>(pieces(p)); ++i) {
        for (std::size_t j = 0; j < static_cast<std::size_t>(pieces(q)); ++j) {
          tasks.push_back({piece(p, i), piece(q, j)});
        }
      }
      if (!p.convex()) {
        for (const glm::dvec3& by :
             q.convex() ? std::span(q.hull).first(1) : std::span(q.anchors)) {
          result.push_back(moved(p, by));
        }
      }
      if (!q.convex()) {
        for (const glm::dvec3& by :
             p.convex() ? std::span(p.hull).first(1) : std::span(p.anchors)) {
          result.push_back(moved(q, by));
        }
      }
    }
  }
  std::vector<MinkowskiPart> sums(tasks.size());
  Execution quiet = execution;
  quiet.progress = {};
  std::atomic<bool> thinned{false};
  parallel_for(quiet, tasks.size(), [&](std::size_t i, int) {
    const Task& task = tasks[i];
    if (task.a.size() * task.b.size() <= kMostPairs) {
      sums[i].hull = hull_vertices(pairwise(task.a, task.b));
      return;
    }
    const auto directions = even_directions(3000);
    sums[i].hull =
        hull_vertices(pairwise(extremes(task.a, directions), extremes(task.b, directions)));
    thinned = true;
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  approximate |= thinned;
  for (MinkowskiPart& sum : sums) {
    if (!sum.hull.empty()) result.push_back(std::move(sum));
  }
  return result;
}

}  // namespace strata::csg
