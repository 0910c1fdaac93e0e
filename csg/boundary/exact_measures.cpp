#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <new>

#include "csg/boundary/boundary_arrangement.h"
#include "exact/mesh_sums.h"

namespace strata::csg {
namespace {

using exact::FinePoint;

class Summer {
 public:
  explicit Summer(const BoundaryFaces& faces) : faces_(faces) {}

  void run() {
    const BoundaryPoints& points = faces_.points;
    for (const BoundaryFaces::Whole& whole : faces_.wholes) {
      const exact::LatticePoint &a = points.vertices()[whole.points.x],
                                &b = points.vertices()[whole.points.y],
                                &c = points.vertices()[whole.points.z];
      add(exact::plane_through(a, b, c), exact::fine_point(a), exact::fine_point(b),
          exact::fine_point(c));
      for (int k = 0; k < 3; ++k) include(points.rounded(whole.points[k]));
    }
    // A face is the signed sum of the triangles from a point of its plane to its edges.
    for (const BoundaryPlane& plane : faces_.planes) {
      const FinePoint base = exact::fine_point(plane.plane.base);
      for (std::uint32_t e = plane.first_edge; e < plane.first_edge + plane.edge_count; ++e) {
        const BoundaryEdge& edge = faces_.edges[e];
        add(plane.plane, base, fine(edge.from), fine(edge.to));
        include(points.rounded(edge.from));
      }
    }
  }

  exact::MomentSum moments;
  exact::AreaSum area;
  exact::FilePoint low{std::numeric_limits<std::int64_t>::max()};
  exact::FilePoint high{std::numeric_limits<std::int64_t>::min()};

 private:
  FinePoint fine(std::uint32_t point) const {
    const BoundaryPoints& points = faces_.points;
    return points.on_lattice(point) ? exact::fine_point(points.vertices()[point])
                                    : exact::round_fine(points.rational(point));
  }
  void add(const exact::Plane& plane, const FinePoint& a, const FinePoint& b, const FinePoint& c) {
    moments.add(a, b, c);
    area.add(plane, a, b, c);
  }
  void include(const exact::FilePoint& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }

  const BoundaryFaces& faces_;
};

}  // namespace

Result<ExactMeasures> exact_measures(const Tree& tree, Tree::NodeId root,
                                     const BoundaryOptions& options,
                                     const Execution& execution) try {
  BoundaryOptions plain = options;
  plain.parts = BoundaryParts::kOne;
  plain.faces = BoundaryFaceKind::kCanonical;
  auto boundary = find_exact_boundary(tree, root, plain, execution);
  if (!boundary) return tl::unexpected(boundary.error());
  ExactMeasures result;
  result.report = boundary->report;
  Summer sums(boundary->faces);
  sums.run();
  const double step = boundary->lattice.step;
  const double volume = sums.moments.volume().volume();
  if (volume == 0) return result;
  result.empty = false;
  result.volume = volume * step * step * step;
  result.area = sums.area.area() * step * step;
  result.area_error = sums.area.error() * step * step;
  result.volume_snap_error = result.area * std::sqrt(3.0) / 2 * step;
  constexpr int kPairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {2, 0}, {0, 1}};
  double second[6];
  for (int k = 0; k < 6; ++k) {
    second[k] = sums.moments.central_moment(kPairs[k][0], kPairs[k][1]) * std::pow(step, 5);
  }
  result.inertia = {second[1] + second[2],
                    second[2] + second[0],
                    second[0] + second[1],
                    -second[3],
                    -second[4],
                    -second[5]};
  for (int k = 0; k < 3; ++k) {
    result.centre[k] = boundary->lattice.origin[k] + sums.moments.centre(k) * step;
    result.low[k] = boundary->lattice.origin[k] + static_cast<double>(sums.low[k]) * 0x1p-24 * step;
    result.high[k] =
        boundary->lattice.origin[k] + static_cast<double>(sums.high[k]) * 0x1p-24 * step;
  }
  return result;
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for the boundary of the tree");
}

}  // namespace strata::csg
