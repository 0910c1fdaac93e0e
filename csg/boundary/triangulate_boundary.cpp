#include "csg/boundary/triangulate_boundary.h"

#include <algorithm>
#include <atomic>
#include <glm/geometric.hpp>
#include <map>

#include "csg/arrangement/point_table.h"
#include "csg/boundary/face_triangulation.h"
#include "csg/boundary/turned_shells.h"
#include "mesh/disjoint_sets.h"
#include "mesh/repair/canonical_order.h"
#include "mesh/repair/double_edges.h"
#include "mesh/repair/mesh_repair.h"
#include "mesh/repair/umbrellas.h"
#include "mesh/repair/written_positions.h"

namespace strata::csg {
namespace {

using exact::FilePoint;
using Index = std::uint32_t;

constexpr std::size_t kTaskEdges = 4096;  // so many make a task of their own

class Triangulation {
 public:
  Triangulation(const BoundaryFaces& faces, const WrittenPositions& written,
                const Execution& execution)
      : faces_(faces), written_(written), execution_(execution) {}

  Result<TriangulatedBoundary> run();

 private:
  void place_points();
  std::vector<std::vector<Index>> make_tasks() const;
  bool triangulate_planes();
  void collect(std::vector<FaceTriangles>& parts);
  Index group_of(const glm::uvec3& triangle, Index plane) const;
  std::vector<WedgeEdge> all_half_edges() const;
  Result<void> split_vertices();
  Index point_of(Index vertex) const;
  exact::FinePoint exact_point(Index vertex) const;
  double most_moved() const;
  int compare_exactly(Index a, Index b) const;
  Result<MeshRepair> check_and_sort();
  TriangulatedBoundary finish();

  const BoundaryFaces& faces_;
  const WrittenPositions& written_;
  const Execution& execution_;
  std::vector<std::uint8_t> moved_;  // the points, by rounding
  RoundedMesh mesh_;                 // its vertices are the points, then the additional ones
  std::vector<Index> planes_;        // of the triangles after the wholes, as in FaceTriangles
  std::vector<WedgeEdge> wedges_;
  std::vector<Index> additional_;  // the points of the vertices after those of the points
  std::uint64_t split_ = 0;
};

void Triangulation::place_points() {
  mesh_.positions.resize(faces_.points.size());
  moved_.resize(faces_.points.size());
  constexpr std::size_t kRange = 1 << 16;
  parallel_for(execution_, (mesh_.positions.size() + kRange - 1) / kRange, [&](std::size_t r, int) {
    const std::size_t end = std::min(mesh_.positions.size(), (r + 1) * kRange);
    for (std::size_t i = r * kRange; i < end; ++i) {
      const auto point = static_cast<Index>(i);
      const FilePoint exact = faces_.points.rounded(point);
      mesh_.positions[i] = written_.round(exact);
      moved_[i] = faces_.points.moved(point) || mesh_.positions[i] != exact ? 1 : 0;
    }
  });
}

// Planes by tasks: large planes first, each by itself, since a thread has a plane alone.
std::vector<std::vector<Index>> Triangulation::make_tasks() const {
  std::vector<std::vector<Index>> tasks;
  std::vector<Index> task;
  std::size_t edges = 0;
  for (Index p = 0; p < faces_.planes.size(); ++p) {
    const std::size_t count = faces_.planes[p].edge_count;
    if (count >= kTaskEdges) {
      tasks.push_back({p});
      continue;
    }
    task.push_back(p);
    edges += count;
    if (edges < kTaskEdges) continue;
    tasks.push_back(std::move(task));
    task.clear();
    edges = 0;
  }
  if (!task.empty()) tasks.push_back(std::move(task));
  const auto size = [this](const std::vector<Index>& planes) {
    return planes.size() == 1 ? faces_.planes[planes.front()].edge_count : 0;
  };
  std::stable_sort(tasks.begin(), tasks.end(),
                   [&](const auto& a, const auto& b) { return size(a) > size(b); });
  return tasks;
}

bool Triangulation::triangulate_planes() {
  const std::vector<std::vector<Index>> tasks = make_tasks();
  std::vector<FaceTriangles> parts(tasks.size());
  std::vector<std::unique_ptr<FaceTriangulation>> workers(
      static_cast<std::size_t>(execution_.thread_count()));
  std::atomic<bool> good = true;
  parallel_for(execution_, tasks.size(), [&](std::size_t task, int worker) {
    auto& triangulation = workers[static_cast<std::size_t>(worker)];
    if (!triangulation)
      triangulation = std::make_unique<FaceTriangulation>(faces_, mesh_.positions);
    for (const Index plane : tasks[task]) {
      if (!triangulation->append(plane, parts[task])) good = false;
      if (!good || execution_.stop.stop_requested()) return;
    }
  });
  if (good) collect(parts);
  return good;
}

void Triangulation::collect(std::vector<FaceTriangles>& parts) {
  std::size_t count = faces_.wholes.size();
  for (const FaceTriangles& part : parts) count += part.triangles.size();
  mesh_.triangles.reserve(count);
  mesh_.labels.reserve(count);
  mesh_.groups.reserve(count);
  for (const BoundaryFaces::Whole& whole : faces_.wholes) {
    mesh_.triangles.push_back(whole.points);
    mesh_.labels.push_back(whole.label);
    mesh_.groups.push_back(group_of(whole.points, FaceTriangles::kNotSimple));
  }
  for (FaceTriangles& part : parts) {
    const auto before = static_cast<Index>(mesh_.triangles.size());
    mesh_.triangles.insert(mesh_.triangles.end(), part.triangles.begin(), part.triangles.end());
    mesh_.labels.insert(mesh_.labels.end(), part.labels.begin(), part.labels.end());
    for (std::size_t t = 0; t < part.triangles.size(); ++t) {
      mesh_.groups.push_back(group_of(part.triangles[t], part.planes[t]));
    }
    planes_.insert(planes_.end(), part.planes.begin(), part.planes.end());
    for (const WedgeEdge& edge : part.wedges) {
      wedges_.push_back({before + edge.triangle, edge.corner, edge.wedge});
    }
    part = {};
  }
}

// Triangles of exact points do not meet; nor do those of a plane whose edges do not.
Index Triangulation::group_of(const glm::uvec3& t, Index plane) const {
  if (moved_[t.x] + moved_[t.y] + moved_[t.z] == 0) return RoundedMesh::kUnmoved;
  return (plane & FaceTriangles::kNotSimple) != 0 ? RoundedMesh::kNoGroup : plane + 1;
}

// All half-edges, numbered so that those of opposite directions with the same number belong
// together. Rounding may lead diagonals of several planes along one line.
std::vector<WedgeEdge> Triangulation::all_half_edges() const {
  constexpr Index kTwoFaces = 0x7fffffffu;   // edges of faces, which two have
  constexpr Index kDiagonals = 0x80000000u;  // and the plane
  std::vector<WedgeEdge> result;
  std::map<std::pair<Index, Index>, Index> edges;  // of a plane
  Index plane_of_edges = 0xffffffffu;
  for (Index t = 0; t < mesh_.triangles.size(); ++t) {
    const std::size_t wholes = faces_.wholes.size();
    const Index index = t < wholes ? 0 : planes_[t - wholes] & ~FaceTriangles::kNotSimple;
    if (t >= wholes && index != plane_of_edges) {
      plane_of_edges = index;
      edges.clear();
      const BoundaryPlane& plane = faces_.planes[index];
      for (Index i = 0; i < plane.edge_count; ++i) {
        const BoundaryEdge& edge = faces_.edges[plane.first_edge + i];
        edges[{edge.from, edge.to}] = edge.wedge != 0 ? edge.wedge : kTwoFaces;
      }
    }
    const glm::uvec3& corners = mesh_.triangles[t];
    for (Index k = 0; k < 3; ++k) {
      const auto found =
          edges.find({corners[static_cast<int>(k)], corners[static_cast<int>(k == 2 ? 0 : k + 1)]});
      const Index number = t < wholes             ? kTwoFaces
                           : found != edges.end() ? found->second
                                                  : kDiagonals | index;
      result.push_back({t, k, number});
    }
  }
  return result;
}

// Gives each fan a vertex of its own, and each edge two triangles.
Result<void> Triangulation::split_vertices() {
  const std::size_t points = faces_.points.size();
  auto additional = split_umbrellas(mesh_.triangles, points, wedges_, execution_);
  if (!additional && additional.error().code == ErrorCode::kInternal) {
    wedges_ = all_half_edges();
    additional = split_umbrellas(mesh_.triangles, points, wedges_, execution_);
  }
  if (!additional) return tl::unexpected(additional.error());
  additional_ = *std::move(additional);
  for (const Index point : additional_)
    mesh_.positions.push_back(FilePoint(mesh_.positions[point]));
  split_ = additional_.size() + divide_double_edges(mesh_, wedges_, written_);
  return {};
}

// None for vertices in the middle of an edge.
Index Triangulation::point_of(Index vertex) const {
  const std::size_t count = faces_.points.size(), other = vertex - count;
  return vertex < count ? vertex : other < additional_.size() ? additional_[other] : 0xffffffffu;
}

exact::FinePoint Triangulation::exact_point(Index vertex) const {
  const Index point = point_of(vertex);
  if (point == 0xffffffffu) {
    constexpr int kMore = exact::kFineBits - exact::kFileBits;
    const FilePoint& at = mesh_.positions[vertex];
    return {exact::Int128{at.x} << kMore, exact::Int128{at.y} << kMore,
            exact::Int128{at.z} << kMore};
  }
  return faces_.points.on_lattice(point) ? exact::fine_point(faces_.points.vertices()[point])
                                         : exact::round_fine(faces_.points.rational(point));
}

// By rounding to written positions, in 2^-24 step.
double Triangulation::most_moved() const {
  double most = 0;
  if (!written_.rounds()) return most;
  for (Index p = 0; p < faces_.points.size(); ++p) {
    const glm::dvec3 by(mesh_.positions[p] - faces_.points.rounded(p));
    most = std::max(most, glm::length(by));
  }
  return most;
}

// The order of vertices of one written position.
int Triangulation::compare_exactly(Index a, Index b) const {
  const Index p = point_of(a), q = point_of(b);
  if (p == q) return 0;
  if (p == 0xffffffffu || q == 0xffffffffu) return p < q ? -1 : 1;
  for (int axis = 0; axis < 3; ++axis) {
    const int order = order_along(faces_.points, p, q, axis);
    if (order != 0) return order;
  }
  return 0;
}

// Checks the written positions, repairs what meets there, and puts all in order.
Result<MeshRepair> Triangulation::check_and_sort() {
  Result<MeshRepair> repair;
  const std::uint64_t turned =
      drop_turned_shells(mesh_, most_moved(), [this](Index vertex) { return exact_point(vertex); });
  repair->places = turned;
  const auto conflicts = find_conflicts(mesh_, execution_);
  if (!conflicts) return tl::unexpected(conflicts.error());
  set_groups(mesh_, *conflicts);
  canonical_order(
      mesh_, [this](Index a, Index b) { return compare_exactly(a, b); }, execution_);
  if (conflicts->empty()) return repair;
  repair = repair_mesh(mesh_, written_, execution_);
  if (repair) {
    repair->places += turned + drop_loose_voids(mesh_);
    canonical_order(mesh_, [](Index a, Index b) { return a < b ? -1 : a > b ? 1 : 0; });
  }
  return repair;
}

TriangulatedBoundary Triangulation::finish() {
  TriangulatedBoundary result;
  result.points = std::move(mesh_.positions);
  result.triangles = std::move(mesh_.triangles);
  result.labels = std::move(mesh_.labels);
  result.positions.reserve(result.points.size());
  for (const FilePoint& point : result.points) result.positions.push_back(written_.world(point));
  result.vertices_split = split_;
  detail::DisjointSets shells(result.points.size());
  result.shells = result.points.size();
  for (const glm::uvec3& t : result.triangles) {
    if (shells.known_same(t.x, t.y, t.z)) continue;
    result.shells -= (shells.join(t.x, t.y) ? 1u : 0u) + (shells.join(t.x, t.z) ? 1u : 0u);
  }
  return result;
}

Result<TriangulatedBoundary> Triangulation::run() {
  const auto cancelled = [this] { return execution_.stop.stop_requested(); };
  const auto stop = [] { return fail(ErrorCode::kCancelled, "stopped"); };
  place_points();
  if (cancelled()) return stop();
  const bool good = triangulate_planes();
  if (cancelled()) return stop();
  if (!good) {
    return fail(ErrorCode::kInternal, "edges of a face of the boundary do not bound a region");
  }
  const Result<void> split = split_vertices();
  if (!split) return tl::unexpected(split.error());
  if (cancelled()) return stop();
  const Result<MeshRepair> repair = check_and_sort();
  if (!repair) return tl::unexpected(repair.error());
  if (cancelled()) return stop();
  TriangulatedBoundary result = finish();
  result.repaired = repair->places;
  result.repair_rounds = repair->rounds;
  return result;
}

}  // namespace

Result<TriangulatedBoundary> triangulate_boundary(const BoundaryFaces& faces,
                                                  const Lattice& lattice, bool float_positions,
                                                  const Execution& execution) {
  const Result<WrittenPositions> written =
      WrittenPositions::make(lattice.origin, lattice.step, float_positions);
  if (!written) return tl::unexpected(written.error());
  return Triangulation(faces, *written, execution).run();
}

}  // namespace strata::csg
