#include "apps/verify/comparison.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <optional>
#include <random>

#include "apps/verify/snapped_volume.h"
#include "csg/geometry.h"
#include "strata/csg/measure/measure.h"
#include "strata/csg/solid_lists.h"
#include "strata/voxelize/grid_fit.h"
#include "strata/voxelize/voxelize.h"

namespace strata::apps {
namespace {

/// Steps of the lattice in a voxel; a vertex is moved by half a step along each axis at most.
constexpr double kSnap = 1.0 / 256.0;
constexpr std::size_t kMostExamples = 8;
/// Points that differ and are looked at; beyond, they count as wrong.
constexpr std::uint64_t kMostNearTests = 20000;

double squared_distance(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                        const glm::dvec3& c) {
  const auto to_segment = [&p](const glm::dvec3& from, const glm::dvec3& to) {
    const glm::dvec3 along = to - from, away = p - from;
    const double length = glm::dot(along, along);
    const double t = length > 0 ? std::clamp(glm::dot(away, along) / length, 0.0, 1.0) : 0.0;
    const glm::dvec3 rest = away - t * along;
    return glm::dot(rest, rest);
  };
  const glm::dvec3 normal = glm::cross(b - a, c - a);
  const double size = glm::dot(normal, normal);
  if (size > 0) {
    const auto side = [&](const glm::dvec3& from, const glm::dvec3& to) {
      return glm::dot(glm::cross(to - from, p - from), normal);
    };
    if (side(a, b) >= 0 && side(b, c) >= 0 && side(c, a) >= 0) {
      const double height = glm::dot(p - a, normal);
      return height * height / size;
    }
  }
  return std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
}

/// Asks for surfaces of the solids, of either tree.
class Surfaces {
 public:
  Surfaces(const csg::Tree& tree, const csg::Tree& other) : trees_{tree_of(tree), tree_of(other)} {}

  [[nodiscard]] bool within(const glm::dvec3& p, double distance) const {
    for (const csg::Geometry& geometry : trees_) {
      for (const csg::Geometry::Part& part : geometry.parts()) {
        if (part.triangles.empty() || outside(p, part.box.low, part.box.high, distance)) continue;
        for (const glm::uvec3& t : part.triangles) {
          const glm::dvec3 &a = part.positions[t.x], &b = part.positions[t.y],
                           &c = part.positions[t.z];
          if (outside(p, glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c)), distance)) {
            continue;
          }
          if (squared_distance(p, a, b, c) <= distance * distance) return true;
        }
      }
    }
    return false;
  }

 private:
  static csg::Geometry tree_of(const csg::Tree& tree) { return csg::Geometry(tree); }
  static bool outside(const glm::dvec3& p, const glm::dvec3& low, const glm::dvec3& high,
                      double distance) {
    for (int i = 0; i < 3; ++i) {
      if (p[i] < low[i] - distance || p[i] > high[i] + distance) return true;
    }
    return false;
  }
  csg::Geometry trees_[2];
};

/// Which voxels of a grid the lists fill.
class Filled {
 public:
  static Result<Filled> make(csg::SolidLists& lists, const VoxelGrid& grid,
                             const Execution& execution) {
    Filled filled;
    if (lists.soup().triangles.empty()) return filled;
    if (auto done = lists.fit(grid, nullptr, execution); !done) {
      return tl::unexpected(done.error());
    }
    VoxelizeOptions options;
    options.filter = &lists.filter();
    auto intervals = voxelize(lists.soup(), grid, options, execution);
    if (!intervals) return tl::unexpected(intervals.error());
    filled.intervals_ = std::move(*intervals);
    return filled;
  }
  [[nodiscard]] bool at(const glm::ivec3& voxel) const {
    if (!intervals_) return false;
    const auto column = intervals_->column(voxel.x, voxel.y);
    return std::any_of(column.begin(), column.end(), [&](const Interval& interval) {
      return voxel.z >= interval.begin() && voxel.z < interval.end();
    });
  }

 private:
  std::optional<VoxelIntervals> intervals_;
};

class Comparer {
 public:
  Comparer(const csg::Tree& tree, const csg::Tree& other, const ExactSolid& exact,
           const VerifyOptions& options, const Execution& execution)
      : lists_(tree, tree.root()),
        surfaces_(tree, other),
        exact_(exact),
        options_(options),
        execution_(execution) {
    for (const csg::Tree* each : {&tree, &other}) box_.include(csg::bounds(*each, each->root()));
  }

  [[nodiscard]] bool nothing() const { return box_.empty(); }
  /// Length of a voxel where the longest side has `resolution`.
  [[nodiscard]] double step(int resolution) const {
    const glm::dvec3 extent = box_.high - box_.low;
    return std::max({extent.x, extent.y, extent.z}) / resolution;
  }

  /// All voxels of a grid around both.
  Result<PointCheck> voxels() {
    return run(options_.resolution, glm::dvec3(0.0), [&](const VoxelGrid& grid, const auto& visit) {
      for (int z = 0; z < grid.dims.z; ++z) {
        for (int y = 0; y < grid.dims.y; ++y) {
          for (int x = 0; x < grid.dims.x; ++x) {
            if (!visit(glm::ivec3(x, y, z))) return;
          }
        }
      }
    });
  }

  /// Some voxels of a fine grid that lies anywhere.
  Result<PointCheck> points() {
    std::mt19937_64 random(options_.seed);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    glm::dvec3 shift;
    for (int axis = 0; axis < 3; ++axis) shift[axis] = unit(random);
    return run(options_.point_resolution, shift, [&](const VoxelGrid& grid, const auto& visit) {
      for (int i = 0; i < options_.points; ++i) {
        glm::ivec3 voxel;
        for (int axis = 0; axis < 3; ++axis) {
          voxel[axis] = std::uniform_int_distribution<int>(0, grid.dims[axis] - 1)(random);
        }
        if (!visit(voxel)) return;
      }
    });
  }

 private:
  template <class Visits>
  Result<PointCheck> run(int resolution, const glm::dvec3& shift, const Visits& visits) {
    GridRequest request;
    request.resolution = resolution;
    request.padding = 1;
    auto grid = fit_grid(box_, request);
    if (!grid) return tl::unexpected(grid.error());
    // Within the padding, so that the box stays covered.
    grid->origin -= shift * grid->voxel_size;
    const auto filled = Filled::make(lists_, *grid, execution_);
    if (!filled) return tl::unexpected(filled.error());
    PointCheck check;
    bool stopped = false;
    visits(*grid, [&](const glm::ivec3& voxel) {
      stopped = execution_.stop.stop_requested();
      if (!stopped) compare(*grid, voxel, filled->at(voxel), check);
      return !stopped;
    });
    if (stopped) return fail(ErrorCode::kCancelled, "stopped");
    return check;
  }

  void compare(const VoxelGrid& grid, const glm::ivec3& voxel, bool filled, PointCheck& check) {
    const glm::dvec3 centre = grid.origin + (glm::dvec3(voxel) + 0.5) * grid.voxel_size;
    const ExactSolid::Side side = exact_.side_of(centre);
    ++check.compared;
    if (side == ExactSolid::Side::kBoundary) {
      ++check.boundary;
      return;
    }
    const bool inside = side == ExactSolid::Side::kInside;
    check.inside += inside ? 1 : 0;
    if (inside == filled) return;
    const double longest = std::max({grid.voxel_size.x, grid.voxel_size.y, grid.voxel_size.z});
    if (check.near + check.wrong < kMostNearTests && surfaces_.within(centre, longest * kSnap)) {
      ++check.near;
      return;
    }
    ++check.wrong;
    if (check.examples.size() < kMostExamples) check.examples.push_back({centre, inside});
  }

  csg::SolidLists lists_;
  Surfaces surfaces_;
  const ExactSolid& exact_;
  const VerifyOptions& options_;
  const Execution& execution_;
  Bounds box_;
};

}  // namespace

namespace {

/// Volumes of `tree` by csg/boundary and of its snapped solids by CGAL.
Result<SnapCheck> compare_snapped(const csg::Tree& tree, const Execution& execution) {
  SnapCheck check;
  const auto ours = snapped_volume(tree, execution);
  if (!ours) return tl::unexpected(ours.error());
  const auto exact = ExactSolid::evaluate(ours->snapped, ours->snapped.root(), execution);
  if (!exact && exact.error().code != ErrorCode::kGeometry) return tl::unexpected(exact.error());
  if (!exact) {  // faces of a solid may meet once it is snapped
    check.reason = exact.error().message;
    return check;
  }
  check.compared = true;
  check.boundary = ours->volume;
  check.exact = exact->volume() * std::pow(ours->step, 3);
  check.equal = ours->six_volumes == exact->six_volumes();
  return check;
}

}  // namespace

double SizeCheck::difference() const { return std::abs(lists - exact); }

Result<Verification> verify(const csg::Tree& tree, const csg::Tree& other,
                            const VerifyOptions& options, const Execution& execution) {
  const auto exact = ExactSolid::evaluate(other, other.root(), execution);
  if (!exact) return tl::unexpected(exact.error());
  Verification found;
  found.exact = exact->facts();
  Comparer comparer(tree, other, *exact, options, execution);
  if (comparer.nothing()) return found;

  const auto measures =
      csg::measure(tree, tree.root(), {.resolution = options.measure_resolution}, execution);
  if (!measures) return tl::unexpected(measures.error());
  const double area = std::max(exact->area(), measures->area);
  const double step = comparer.step(options.measure_resolution);
  found.volume = {measures->volume, exact->volume(), area * step};
  found.area = {measures->area, exact->area(),
                std::max(measures->area_error, 0.5 * exact->creases() * step)};

  auto voxels = comparer.voxels();
  if (!voxels) return tl::unexpected(voxels.error());
  found.voxels = std::move(*voxels);
  auto points = comparer.points();
  if (!points) return tl::unexpected(points.error());
  found.points = std::move(*points);
  if (&tree == &other) {
    auto snapped = compare_snapped(tree, execution);
    if (!snapped) return tl::unexpected(snapped.error());
    found.snapped = *std::move(snapped);
  } else {
    found.snapped.reason = "two trees were given";
  }
  return found;
}

}  // namespace strata::apps
