#include "csg/boundary/triangulate_boundary.h"

#include <algorithm>
#include <atomic>
#include <numeric>

#include "csg/boundary/canonical_order.h"
#include "csg/boundary/double_edges.h"
#include "csg/boundary/face_triangulation.h"
#include "csg/boundary/umbrellas.h"
#include "csg/boundary/written_positions.h"
#include "mesh/disjoint_sets.h"

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
  TriangulatedBoundary finish() const;

  const BoundaryFaces& faces_;
  const WrittenPositions& written_;
  const Execution& execution_;
  std::vector<FilePoint> positions_;  // of points, then of additional vertices
  std::vector<glm::uvec3> triangles_;
  std::vector<Index> labels_;
  std::vector<WedgeEdge> wedges_;
  std::uint64_t split_ = 0;
};

void Triangulation::place_points() {
  positions_.resize(faces_.points.size());
  constexpr std::size_t kRange = 1 << 16;
  parallel_for(execution_, (positions_.size() + kRange - 1) / kRange, [&](std::size_t r, int) {
    const std::size_t end = std::min(positions_.size(), (r + 1) * kRange);
    for (std::size_t i = r * kRange; i < end; ++i) {
      positions_[i] = written_.round(faces_.points.rounded(static_cast<Index>(i)));
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
    if (!triangulation) triangulation = std::make_unique<FaceTriangulation>(faces_, positions_);
    for (const Index plane : tasks[task]) {
      if (!triangulation->append(faces_.planes[plane], parts[task])) good = false;
      if (!good || execution_.stop.stop_requested()) return;
    }
  });
  if (good) collect(parts);
  return good;
}

void Triangulation::collect(std::vector<FaceTriangles>& parts) {
  std::size_t count = faces_.wholes.size();
  for (const FaceTriangles& part : parts) count += part.triangles.size();
  triangles_.reserve(count);
  labels_.reserve(count);
  for (const BoundaryFaces::Whole& whole : faces_.wholes) {
    triangles_.push_back(whole.points);
    labels_.push_back(whole.label);
  }
  for (FaceTriangles& part : parts) {
    const auto before = static_cast<Index>(triangles_.size());
    triangles_.insert(triangles_.end(), part.triangles.begin(), part.triangles.end());
    labels_.insert(labels_.end(), part.labels.begin(), part.labels.end());
    for (const WedgeEdge& edge : part.wedges) {
      wedges_.push_back({before + edge.triangle, edge.corner, edge.wedge});
    }
    part = {};
  }
}

TriangulatedBoundary Triangulation::finish() const {
  OrderedMesh ordered = canonical_order(positions_, triangles_, labels_);
  TriangulatedBoundary result;
  result.points = std::move(ordered.points);
  result.triangles = std::move(ordered.triangles);
  result.labels = std::move(ordered.labels);
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
  const Result<std::vector<Index>> additional =
      split_umbrellas(triangles_, faces_.points.size(), wedges_);
  if (!additional) return tl::unexpected(additional.error());
  split_ = additional->size();
  for (const Index point : *additional) positions_.push_back(FilePoint(positions_[point]));
  split_ += divide_double_edges(triangles_, labels_, positions_, wedges_, written_);
  if (cancelled()) return stop();
  return finish();
}

}  // namespace

Result<TriangulatedBoundary> triangulate_boundary(const BoundaryFaces& faces,
                                                  const Lattice& lattice, bool float_positions,
                                                  const Execution& execution) {
  const Result<WrittenPositions> written = WrittenPositions::make(lattice, float_positions);
  if (!written) return tl::unexpected(written.error());
  return Triangulation(faces, *written, execution).run();
}

}  // namespace strata::csg
