#include "csg/solids/minkowski.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <utility>

#include "strata/mesh/soup_tools.h"

namespace strata::csg {
namespace {

constexpr double kMostPieces = 3e6;
constexpr double kMostVertices = 1e8;  // all pieces together; more take minutes
/// Up to this many pairs of points, a sum is the hull of all pairs.
constexpr std::size_t kFewPairs = 1024;
/// Most points for one run of Qhull when all pairs are needed.
constexpr std::size_t kPairsAtOnce = 100'000;

/// The corners of a polytope or of a flat polygon. Each corner has the cone of directions in which
/// it is the farthest corner: the directions that make no obtuse angle with any of its rays.
struct Corners {
  std::vector<glm::dvec3> points;
  std::vector<glm::dvec3> along;     ///< a direction inside the cone; 0: not a corner
  std::vector<std::uint32_t> first;  ///< first ray of each corner; one more entry ends the last
  std::vector<glm::dvec3> rays;      ///< unit vectors to a corner from its neighbours
};

/// A polytope and its edges, stored by vertex.
struct Polytope {
  struct Spoke {
    std::uint32_t to;
    glm::dvec3 normals[2];
  };
  Corners corners;
  std::vector<Spoke> spokes;  ///< ordered as corners.rays; empty if Qhull gave no edges
};

glm::dvec3 unit(const glm::dvec3& v) {
  const double length = glm::length(v);
  return length > 0.0 ? v / length : glm::dvec3(0.0);
}

Polytope make_polytope(const ConvexHull& hull) {
  Polytope polytope;
  Corners& corners = polytope.corners;
  corners.points = hull.mesh.positions;
  if (hull.edges.empty()) return polytope;
  corners.first.assign(corners.points.size() + 1, 0);
  for (const ConvexHull::Edge& edge : hull.edges) {
    for (const std::uint32_t v : edge.vertices) ++corners.first[v + 1];
  }
  for (std::size_t v = 0; v < corners.points.size(); ++v) corners.first[v + 1] += corners.first[v];
  std::vector<std::uint32_t> next(corners.first.begin(), corners.first.end() - 1);
  polytope.spokes.resize(corners.first.back());
  corners.rays.resize(corners.first.back());
  corners.along.assign(corners.points.size(), glm::dvec3(0.0));
  for (const ConvexHull::Edge& edge : hull.edges) {
    for (int end = 0; end < 2; ++end) {
      const std::uint32_t v = edge.vertices[end], to = edge.vertices[1 - end];
      const std::uint32_t at = next[v]++;
      polytope.spokes[at] = {to, {edge.normals[0], edge.normals[1]}};
      corners.rays[at] = unit(corners.points[v] - corners.points[to]);
      corners.along[v] += edge.normals[0] + edge.normals[1];
    }
  }
  return polytope;
}

Corners corners_of(std::span<const glm::dvec3> facet) {
  Corners corners;
  corners.points.assign(facet.begin(), facet.end());
  for (std::size_t i = 0; i < facet.size(); ++i) {
    const glm::dvec3& before = facet[(i + facet.size() - 1) % facet.size()];
    const glm::dvec3& after = facet[(i + 1) % facet.size()];
    corners.first.push_back(static_cast<std::uint32_t>(corners.rays.size()));
    corners.rays.push_back(unit(facet[i] - before));
    corners.rays.push_back(unit(facet[i] - after));
    const glm::dvec3 along = corners.rays.end()[-1] + corners.rays.end()[-2];
    // A point in the middle of a side is not the farthest in any direction.
    corners.along.push_back(glm::length(along) > 1e-9 ? along : glm::dvec3(0.0));
  }
  corners.first.push_back(static_cast<std::uint32_t>(corners.rays.size()));
  return corners;
}

/// Finds the vertices of the sum of a corner set and a polytope. One object serves one thread. A
/// vertex of a sum is the sum of two vertices that are both the farthest in some direction. For
/// each corner, the walk begins at a polytope vertex that is the farthest in a direction of the
/// corner's cone. It follows edges for which a direction between the normals of their two facets
/// lies in the cone. Cones are convex, so the walk reaches all vertices.
class VertexWalk {
 public:
  void add_sums(const Corners& corners, const Polytope& polytope, std::vector<glm::dvec3>& sums) {
    const std::vector<glm::dvec3>& points = polytope.corners.points;
    seen_.assign(points.size(), 0);
    for (std::uint32_t c = 0; c < corners.points.size(); ++c) {
      const glm::dvec3& along = corners.along[c];
      if (along == glm::dvec3(0.0)) continue;
      const auto rays = std::span(corners.rays)
                            .subspan(corners.first[c], corners.first[c + 1] - corners.first[c]);
      std::uint32_t farthest = 0;
      for (std::uint32_t v = 1; v < points.size(); ++v) {
        if (glm::dot(points[v] - points[farthest], along) > 0.0) farthest = v;
      }
      waiting_.assign(1, farthest);
      seen_[farthest] = c + 1;
      while (!waiting_.empty()) {
        const std::uint32_t v = waiting_.back();
        waiting_.pop_back();
        sums.push_back(corners.points[c] + points[v]);
        for (std::uint32_t s = polytope.corners.first[v]; s < polytope.corners.first[v + 1]; ++s) {
          const Polytope::Spoke& spoke = polytope.spokes[s];
          if (seen_[spoke.to] == c + 1 || !meets(spoke, rays)) continue;
          seen_[spoke.to] = c + 1;
          waiting_.push_back(spoke.to);
        }
      }
    }
  }

 private:
  /// Whether a direction between the two normals makes no obtuse angle with any ray. Directions
  /// that do so only by rounding are accepted: the hull drops superfluous points.
  static bool meets(const Polytope::Spoke& spoke, std::span<const glm::dvec3> rays) {
    constexpr double kRounding = 1e-7;
    double low = 0.0, high = 1.0;  // parameters of directions: 0 is the first normal, 1 the second
    for (const glm::dvec3& ray : rays) {
      const double one = glm::dot(spoke.normals[0], ray) + kRounding;
      const double other = glm::dot(spoke.normals[1], ray) + kRounding;
      if (one < 0.0 && other < 0.0) return false;
      if (one < 0.0) low = std::max(low, one / (one - other));
      if (other < 0.0) high = std::min(high, one / (one - other));
    }
    return low <= high;
  }

  std::vector<std::uint32_t> seen_;  ///< the last corner that reached the vertex, from 1
  std::vector<std::uint32_t> waiting_;
};

/// The hull of the sums of all pairs of points, built in batches.
Result<ConvexHull> hull_of_pairs(std::span<const glm::dvec3> a, std::span<const glm::dvec3> b,
                                 const std::stop_token& stop) {
  std::vector<glm::dvec3> sums;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (const glm::dvec3& q : b) sums.push_back(a[i] + q);
    if (sums.size() < kPairsAtOnce || i + 1 == a.size()) continue;
    auto hull = convex_hull(sums, stop);
    if (!hull && hull.error().code != ErrorCode::kGeometry) return tl::unexpected(hull.error());
    if (hull) sums = std::move(hull->positions);
  }
  return convex_hull_with_edges(sums, stop);
}

/// The centre of mass, which lies deep inside a convex solid.
glm::dvec3 middle_of(const TriangleSoup& mesh) {
  const glm::dvec3 about = mesh.positions[0];
  glm::dvec3 sum(0.0);
  double volume = 0.0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 p = mesh.positions[t.x] - about, q = mesh.positions[t.y] - about,
                     r = mesh.positions[t.z] - about;
    const double part = glm::dot(p, glm::cross(q, r));
    volume += part;
    sum += part * (p + q + r);
  }
  return volume > 0.0 ? about + sum / (4.0 * volume) : about;
}

MinkowskiPart moved(const MinkowskiPart& part, const glm::dvec3& by) {
  MinkowskiPart result = part;
  for (glm::dvec3& p : result.facets.corners) p += by;
  for (glm::dvec3& p : result.anchors) p += by;
  result.offset += by;
  return result;
}

/// One convex sum: each operand is a polytope or a flat facet.
struct Task {
  const Polytope* polytopes[2] = {nullptr, nullptr};
  std::span<const glm::dvec3> facets[2];  ///< used where there is no polytope
};

Result<ConvexHull> sum_of(const Task& task, VertexWalk& walk, const std::stop_token& stop) {
  std::span<const glm::dvec3> points[2];
  for (int i = 0; i < 2; ++i) {
    points[i] = task.polytopes[i] ? std::span<const glm::dvec3>(task.polytopes[i]->corners.points)
                                  : task.facets[i];
  }
  // The walk follows the edges of the larger polytope.
  int over = points[0].size() > points[1].size() ? 0 : 1;
  const auto has_edges = [&](int i) {
    return task.polytopes[i] && !task.polytopes[i]->spokes.empty();
  };
  if (!has_edges(over)) over = 1 - over;
  const int other = 1 - over;
  if (points[0].size() * points[1].size() <= kFewPairs || !has_edges(over) ||
      (task.polytopes[other] && !has_edges(other))) {
    return hull_of_pairs(points[0], points[1], stop);
  }
  std::vector<glm::dvec3> sums;
  if (task.polytopes[other]) {
    walk.add_sums(task.polytopes[other]->corners, *task.polytopes[over], sums);
  } else {
    walk.add_sums(corners_of(task.facets[other]), *task.polytopes[over], sums);
  }
  return convex_hull_with_edges(sums, stop);
}

/// The size of the sums of all pieces together.
struct Cost {
  double pieces = 0.0, vertices = 0.0;
  [[nodiscard]] double bytes() const {
    // Each vertex comes with two triangles. They exist three times: as pieces, as one mesh, and in
    // the code that shows it.
    return vertices * 3.0 * (sizeof(glm::dvec3) + 2 * sizeof(glm::uvec3));
  }
};

Cost cost_of(std::span<const MinkowskiPart> a, std::span<const MinkowskiPart> b) {
  Cost cost;
  const auto pieces = [](const MinkowskiPart& part) {
    return part.convex() ? 1.0 : static_cast<double>(part.facets.size());
  };
  const auto points = [](const MinkowskiPart& part) {  // mean number of points of a piece
    return part.convex() ? static_cast<double>(part.hull.mesh.positions.size())
                         : static_cast<double>(part.facets.corners.size()) /
                               static_cast<double>(part.facets.size());
  };
  for (const MinkowskiPart& p : a) {
    for (const MinkowskiPart& q : b) {
      const double count = pieces(p) * pieces(q), m = points(p), n = points(q);
      cost.pieces += count;
      // Vertices of a sum are the vertices of the overlaid Gauss maps: those of both maps and the
      // crossings of their arcs.
      cost.vertices += count * std::min(m * n, m + n + 2.0 * std::sqrt(m * n));
    }
  }
  return cost;
}

/// The plan of a sum: the convex sums to compute, and the parts of one operand that are only moved.
class Plan {
 public:
  Plan(std::span<const MinkowskiPart> a, std::span<const MinkowskiPart> b) : sides_{a, b} {
    for (int side = 0; side < 2; ++side) {
      for (const MinkowskiPart& part : sides_[side]) {
        polytopes_[side].push_back(part.convex() ? make_polytope(part.hull) : Polytope());
      }
    }
    for (std::size_t i = 0; i < a.size(); ++i) {
      for (std::size_t j = 0; j < b.size(); ++j) {
        if (!a[i].empty() && !b[j].empty()) add(i, j);
      }
    }
  }
  std::vector<Task> tasks;  ///< refer to the polytopes of this plan
  std::vector<MinkowskiPart> moved_parts;

 private:
  static std::size_t pieces(const MinkowskiPart& part) {
    return part.convex() ? std::size_t{1} : part.facets.size();
  }
  void add(std::size_t i, std::size_t j) {
    const MinkowskiPart &a = sides_[0][i], &b = sides_[1][j];
    for (std::size_t p = 0; p < pieces(a); ++p) {
      for (std::size_t q = 0; q < pieces(b); ++q) {
        Task& task = tasks.emplace_back();
        set_piece(task, 0, i, p);
        set_piece(task, 1, j, q);
      }
    }
    move(a, b);
    move(b, a);
  }
  void set_piece(Task& task, int side, std::size_t part, std::size_t piece) const {
    const MinkowskiPart& of = sides_[side][part];
    if (of.convex()) {
      task.polytopes[side] = &polytopes_[side][part];
    } else {
      task.facets[side] = of.facets[piece];
    }
  }
  void move(const MinkowskiPart& part, const MinkowskiPart& other) {
    if (part.convex()) return;
    if (other.convex()) {
      moved_parts.push_back(moved(part, middle_of(other.hull.mesh)));
      return;
    }
    for (const glm::dvec3& by : other.anchors) moved_parts.push_back(moved(part, by));
  }

  std::span<const MinkowskiPart> sides_[2];
  std::vector<Polytope> polytopes_[2];
};

}  // namespace

Result<std::vector<MinkowskiPart>> minkowski_sum(std::span<const MinkowskiPart> a,
                                                 std::span<const MinkowskiPart> b, bool goes_on,
                                                 const Execution& execution) {
  const Cost cost = cost_of(a, b);
  const double most_bytes = execution.memory_limit > 0 ? static_cast<double>(execution.memory_limit)
                                                       : std::numeric_limits<double>::infinity();
  if (cost.pieces > kMostPieces || cost.vertices > kMostVertices || cost.bytes() > most_bytes) {
    return fail(ErrorCode::kLimit,
                "the sum needs {:.0f} convex pieces with about {:.3g} vertices and {:.3g} GB; the "
                "limits are {:.0f} pieces, {:g} vertices and {:.3g} GB",
                cost.pieces, cost.vertices, cost.bytes() / 1e9, kMostPieces, kMostVertices,
                most_bytes / 1e9);
  }
  Plan plan(a, b);
  const std::vector<Task>& tasks = plan.tasks;
  std::vector<MinkowskiPart> sums(tasks.size());
  std::vector<VertexWalk> walks(static_cast<std::size_t>(execution.thread_count()));
  std::vector<std::optional<Error>> errors(walks.size());
  const std::size_t at_once = std::max<std::size_t>(64, tasks.size() / 256);
  for (std::size_t first = 0; first < tasks.size() && !execution.stop.stop_requested();
       first += at_once) {
    const std::size_t count = std::min(at_once, tasks.size() - first);
    parallel_for(execution, count, [&](std::size_t i, int worker) {
      const auto w = static_cast<std::size_t>(worker);
      auto hull = sum_of(tasks[first + i], walks[w], execution.stop);
      if (hull) {
        sums[first + i].hull = *std::move(hull);
        if (!goes_on) sums[first + i].hull.edges = {};
      } else if (hull.error().code != ErrorCode::kGeometry) {
        errors[w] = hull.error();
      }
    });
    if (execution.progress) {
      execution.progress(static_cast<double>(first + count) / static_cast<double>(tasks.size()));
    }
  }
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  for (const auto& error : errors) {
    if (error) return tl::unexpected(*error);
  }
  std::erase_if(sums, [](const MinkowskiPart& sum) { return sum.empty(); });
  std::vector<MinkowskiPart> result = std::move(plan.moved_parts);
  result.insert(result.end(), std::make_move_iterator(sums.begin()),
                std::make_move_iterator(sums.end()));
  return result;
}

}  // namespace strata::csg
