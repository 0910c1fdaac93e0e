#include "csg/surface/depth_range.h"

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "strata/mesh/shapes.h"

namespace strata::csg {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// A point in world space, and where it is seen: (u w, v w, w).
struct SeenPoint {
  glm::dvec3 world, image;
};

/// What of a triangle stands in the picture and in a box.
class Clipper {
 public:
  Clipper(const View& view, const Bounds& box) : view_(&view), box_(box) {}

  [[nodiscard]] SeenPoint point(const glm::dvec3& world) const {
    const glm::dvec4 p = view_->image_from_world * glm::dvec4(world, 1.0);
    return {world, {p.x, p.y, p.w}};
  }
  /// @param nearest  what is not nearer is of no interest
  /// @return the corners of what is left
  std::span<const SeenPoint> clip(const std::array<SeenPoint, 3>& triangle, double nearest) {
    polygon_.assign(triangle.begin(), triangle.end());
    const glm::dvec2 size(view_->size);
    cut([](const SeenPoint& p) { return p.image.x; });
    cut([&](const SeenPoint& p) { return size.x * p.image.z - p.image.x; });
    cut([](const SeenPoint& p) { return p.image.y; });
    cut([&](const SeenPoint& p) { return size.y * p.image.z - p.image.y; });
    if (nearest < kNever) cut([&](const SeenPoint& p) { return nearest - p.image.z; });
    for (int axis = 0; axis < 3; ++axis) {
      cut([&](const SeenPoint& p) { return p.world[axis] - box_.low[axis]; });
      cut([&](const SeenPoint& p) { return box_.high[axis] - p.world[axis]; });
    }
    return polygon_;
  }

 private:
  template <class Side>
  void cut(const Side& side) {
    kept_.clear();
    for (std::size_t i = 0; i < polygon_.size(); ++i) {
      const SeenPoint& a = polygon_[i];
      const SeenPoint& b = polygon_[(i + 1) % polygon_.size()];
      const double at_a = side(a), at_b = side(b);
      if (at_a >= 0) kept_.push_back(a);
      if ((at_a >= 0) == (at_b >= 0)) continue;
      const double part = at_a / (at_a - at_b);
      kept_.push_back({a.world + (b.world - a.world) * part, a.image + (b.image - a.image) * part});
    }
    polygon_.swap(kept_);
  }

  const View* view_;
  Bounds box_;
  std::vector<SeenPoint> polygon_, kept_;
};

}  // namespace

std::optional<glm::dvec2> seen_distances(const Geometry& geometry, const View& view,
                                         const Bounds& seen, const Execution& execution) {
  if (seen.empty()) return {};
  Clipper around(view, seen);
  double farthest = 0;
  const TriangleSoup box = make_box(seen.low, seen.high);
  for (const glm::uvec3& t : box.triangles) {
    for (const SeenPoint& p :
         around.clip({around.point(box.positions[t.x]), around.point(box.positions[t.y]),
                      around.point(box.positions[t.z])},
                     kNever)) {
      farthest = std::max(farthest, p.image.z);
    }
  }
  if (!(farthest > 0)) return {};

  constexpr std::size_t kAtOnce = 4096;
  std::vector<std::pair<const Geometry::Part*, std::size_t>> chunks;
  for (const Geometry::Part& part : geometry.parts()) {
    for (std::size_t t = 0; t < part.triangles.size(); t += kAtOnce) chunks.emplace_back(&part, t);
  }
  std::vector<double> nearest(chunks.size(), kNever);
  parallel_for(execution, chunks.size(), [&](std::size_t chunk, int) {
    const auto& [part, first] = chunks[chunk];
    Clipper clipper(view, seen);
    double& best = nearest[chunk];
    const std::size_t end = std::min(part->triangles.size(), first + kAtOnce);
    for (std::size_t i = first; i < end; ++i) {
      const glm::uvec3& t = part->triangles[i];
      const std::array<SeenPoint, 3> triangle{clipper.point(part->positions[t.x]),
                                              clipper.point(part->positions[t.y]),
                                              clipper.point(part->positions[t.z])};
      const auto& [a, b, c] = triangle;
      if (std::min({a.image.z, b.image.z, c.image.z}) >= best) continue;
      if (std::max({a.image.z, b.image.z, c.image.z}) < 0) continue;
      for (const SeenPoint& p : clipper.clip(triangle, best)) best = std::min(best, p.image.z);
    }
  });
  double least = kNever;
  for (const double one : nearest) least = std::min(least, one);
  if (!(least < kNever)) return {};
  return glm::dvec2(least, std::max(least, farthest));
}

}  // namespace strata::csg
