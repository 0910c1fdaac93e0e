#include "csg/scene/hull.h"

#include <cstdint>
#include <cstdio>
#include <glm/common.hpp>
#include <limits>
#include <memory>
#include <unordered_map>
#include <vector>

#include "mesh/diagnose.h"
#include "mesh/soup_tools.h"

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace strata::csg {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

/// One run of Qhull; its memory goes with it.
class Run {
 public:
  Run() { qh_zero(&state_, nullptr); }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;
  ~Run() {
    state_.NOerrexit = True;  // no jump on the way out
    qh_freeqhull(&state_, !qh_ALL);
    int long_blocks = 0, long_bytes = 0;
    qh_memfreeshort(&state_, &long_blocks, &long_bytes);
  }
  qhT* get() { return &state_; }

 private:
  qhT state_;
};

}  // namespace

Result<TriangleSoup> convex_hull(std::span<const glm::dvec3> points) {
  if (points.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()) / 3) {
    return fail(ErrorCode::kLimit, "{} points for a convex hull", points.size());
  }
  if (points.size() < 4) return fail(ErrorCode::kGeometry, "the points lie in a plane");
  glm::dvec3 low = points[0], high = points[0];
  for (const glm::dvec3& p : points) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  // About the middle, so that a small hull far from the origin keeps its digits.
  const glm::dvec3 middle = 0.5 * low + 0.5 * high;
  std::vector<double> coordinates;
  coordinates.reserve(3 * points.size());
  for (const glm::dvec3& p : points) {
    for (int i = 0; i < 3; ++i) coordinates.push_back(p[i] - middle[i]);
  }
  const File silence(std::fopen("/dev/null", "w"));
  if (!silence) return fail(ErrorCode::kInternal, "/dev/null cannot be opened");
  Run run;
  qhT* qh = run.get();
  char command[] = "qhull Pp";
  const int status = qh_new_qhull(qh, 3, static_cast<int>(points.size()), coordinates.data(), False,
                                  command, nullptr, silence.get());
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
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
      mesh.triangles.emplace_back(corners[0], corners[i], corners[i + 1]);
    }
  }
  if (signed_volume(mesh) < 0.0) reverse_orientation(mesh);
  return mesh;
}

}  // namespace strata::csg
