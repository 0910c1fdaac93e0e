#include "csg/solids/hull.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <glm/common.hpp>
#include <limits>
#include <memory>
#include <unordered_map>
#include <vector>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/soup_tools.h"

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace strata::csg {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

/// One run of Qhull, which owns Qhull's memory. Qhull prints into a file that discards its text.
/// Each line, one every fifty facets, calls ask(), which checks for a stop and then tells Qhull to
/// end.
class Run {
 public:
  explicit Run(const std::stop_token& stop) : stop_(stop) {
    qh_zero(&state_, nullptr);
    cookie_io_functions_t functions{};
    functions.write = [](void* run, const char*, std::size_t size) {
      static_cast<Run*>(run)->ask();
      return static_cast<ssize_t>(size);
    };
    output_.reset(fopencookie(this, "w", functions));
    if (output_) std::setvbuf(output_.get(), nullptr, _IONBF, 0);
  }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;
  ~Run() {
    state_.NOerrexit = True;  // do not longjmp while freeing memory
    qh_freeqhull(&state_, !qh_ALL);
    int long_blocks = 0, long_bytes = 0;
    qh_memfreeshort(&state_, &long_blocks, &long_bytes);
  }
  qhT* get() { return &state_; }
  std::FILE* output() { return output_.get(); }
  [[nodiscard]] bool stopped() const { return stopped_; }

 private:
  void ask() {
    stopped_ = stopped_ || stop_.stop_requested();
    if (stopped_) state_.STOPadd = 1;  // add no further vertex
  }

  const std::stop_token& stop_;
  bool stopped_ = false;
  File output_;
  qhT state_;
};

/// Collects the edges of facets. @param corners  corners of the facet, in order around it
class EdgeCollector {
 public:
  void add(std::span<const std::uint32_t> corners, const glm::dvec3& normal) {
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const std::uint32_t a = corners[i], b = corners[(i + 1) % corners.size()];
      const std::uint64_t key = std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
      const auto [at, is_new] = index_.try_emplace(key, edges_.size());
      if (is_new) {
        edges_.push_back({{a, b}, {normal, normal}});
        continue;
      }
      edges_[at->second].normals[1] = normal;
      ++pairs_;
    }
    corners_ += corners.size();
  }
  /// The edges; empty unless each edge has exactly two facets.
  std::vector<ConvexHull::Edge> take() {
    if (pairs_ != edges_.size() || corners_ != 2 * pairs_) edges_.clear();
    return std::move(edges_);
  }

 private:
  std::unordered_map<std::uint64_t, std::size_t> index_;
  std::vector<ConvexHull::Edge> edges_;
  std::size_t pairs_ = 0, corners_ = 0;
};

Result<TriangleSoup> make_hull(std::span<const glm::dvec3> points, EdgeCollector* edges,
                               const std::stop_token& stop) {
  if (points.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()) / 3) {
    return fail(ErrorCode::kLimit, "a convex hull of {} points is too large", points.size());
  }
  if (points.size() < 4) return fail(ErrorCode::kGeometry, "the points lie in a plane");
  glm::dvec3 low = points[0], high = points[0];
  for (const glm::dvec3& p : points) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  // Coordinates relative to the middle, so that a small hull far from the origin keeps its digits.
  const glm::dvec3 middle = 0.5 * low + 0.5 * high;
  std::vector<double> coordinates;
  coordinates.reserve(3 * points.size());
  for (const glm::dvec3& p : points) {
    for (int i = 0; i < 3; ++i) coordinates.push_back(p[i] - middle[i]);
  }
  Run run(stop);
  if (!run.output()) return fail(ErrorCode::kInternal, "cannot open a file for Qhull's messages");
  qhT* qh = run.get();
  char command[] = "qhull Pp TF50";
  const int status = qh_new_qhull(qh, 3, static_cast<int>(points.size()), coordinates.data(), False,
                                  command, nullptr, run.output());
  if (run.stopped()) return fail(ErrorCode::kCancelled, "stopped");
  if (status == qh_ERRmem) return fail(ErrorCode::kLimit, "no memory for a convex hull");
  if (status != 0) return fail(ErrorCode::kGeometry, "the points lie in a plane, or nearly");

  TriangleSoup mesh;
  std::unordered_map<int, std::uint32_t> vertex_of_point;
  std::vector<std::uint32_t> corners;
  facetT* facet = nullptr;
  FORALLfacets {
    setT* vertices = qh_facet3vertex(qh, facet);
    corners.clear();
    vertexT *vertex = nullptr, **vertexp = nullptr;
    FOREACHvertex_(vertices) {
      const int point = qh_pointid(qh, vertex->point);
      const auto [at, is_new] =
          vertex_of_point.try_emplace(point, static_cast<std::uint32_t>(mesh.positions.size()));
      if (is_new) mesh.positions.push_back(points[static_cast<std::size_t>(point)]);
      corners.push_back(at->second);
    }
    qh_settempfree(qh, &vertices);
    if (edges) edges->add(corners, {facet->normal[0], facet->normal[1], facet->normal[2]});
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
      mesh.triangles.emplace_back(corners[0], corners[i], corners[i + 1]);
    }
  }
  if (signed_volume(mesh) < 0.0) reverse_orientation(mesh);
  return mesh;
}

}  // namespace

Result<TriangleSoup> convex_hull(std::span<const glm::dvec3> points, const std::stop_token& stop) {
  return make_hull(points, nullptr, stop);
}

Result<ConvexHull> convex_hull_with_edges(std::span<const glm::dvec3> points,
                                          const std::stop_token& stop) {
  EdgeCollector edges;
  auto mesh = make_hull(points, &edges, stop);
  if (!mesh) return tl::unexpected(mesh.error());
  return ConvexHull{*std::move(mesh), edges.take()};
}

}  // namespace strata::csg
