#include "strata/csg/measure/measure.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "csg/geometry.h"
#include "csg/measure/result_bounds.h"
#include "strata/csg/solid_lists.h"
#include "strata/hashbuffer/build_ldi.h"
#include "strata/raster/lattice_mesh.h"

namespace strata::csg {
namespace {

/// Least side of a measured box, as a part of its longest side.
constexpr double kThinnest = 1e-9;
constexpr int kFirstResolution = 256;
constexpr int kLastResolution = 1024;
/// Most crossings that a measurement uses unless a resolution is given: a second of work.
constexpr std::uint64_t kMostCrossings = 16'000'000;
/// A volume bound worse than this part of the volume asks for more rays.
constexpr double kGoodBound = 1e-3;

/// A triangle as seen by rays along one axis.
struct Face {
  float slope_u = 0;                 ///< change of depth per lattice step along u
  float slope_v = 0;                 ///< change of depth per lattice step along v
  float facing = 0;                  ///< |cosine| between the normal and the ray
  std::int32_t least = 0, most = 0;  ///< depths, lattice steps
  std::uint32_t solid = 0;
};

/// A crossing with the data that the sums need.
struct Crossing {
  double depth = 0;  ///< lattice steps; the middle of the depth step
  const Face* face = nullptr;
  bool exit = false;
};

/// The length inside the result along one ray, and its slopes towards the neighbouring rays.
struct Column {
  double length = 0, slope_u = 0, slope_v = 0;  ///< voxels; slopes are voxels per voxel
  std::uint32_t count = 0;                      ///< crossings
};

/// Sums over the depth lists along the three axes, in voxels of the grid.
class Sums {
 public:
  Sums(const SolidLists& lists, const LatticeMesh& mesh, const VoxelGrid& grid, double world_error)
      : lists_(&lists), mesh_(&mesh), grid_(&grid), world_error_(world_error) {}

  void add(Axis axis, const LayeredDepthImage& image);
  /// @param outer  a box that contains the result
  [[nodiscard]] Measures finish() const;
  /// The box of all crossings, world space.
  [[nodiscard]] Bounds crossed() const;

 private:
  void see_faces(const AxisFrame& frame);
  /// How far a face may be from the measured crossing, lattice steps (law 5).
  [[nodiscard]] double tolerance(const Crossing& one) const;
  void leave_out_films();
  void add_column(const AxisFrame& frame, int u, int v);

  const SolidLists* lists_;
  const LatticeMesh* mesh_;
  const VoxelGrid* grid_;
  double world_error_;     ///< position error of the faces, world units
  double axis_error_ = 0;  ///< the same error along the rays, lattice steps

  std::vector<Face> faces_;
  std::vector<Crossing> list_;
  std::vector<Column> row_, above_;

  glm::dvec3 low_{std::numeric_limits<double>::infinity()};
  glm::dvec3 high_{-std::numeric_limits<double>::infinity()};
  double volumes_[3] = {}, errors_[3] = {};  ///< cubic voxels
  double half_areas_[2] = {};  ///< world units; columns of the two colours of a chessboard
  glm::dvec3 projected_{0};  ///< world area of all layers of the surface, projected along each axis
  double outlines_ = 0;      ///< world area of cells where the number of layers changes
  glm::dvec3 moment_{0};
  // The extent and the first moment of the columns that hold some of the result. They serve for an
  // axis whose own rays miss a thin result.
  glm::dvec3 column_low_{low_}, column_high_{high_}, column_moment_{0}, column_weight_{0};
  std::uint64_t crossings_ = 0, most_ = 0;
};

void Sums::see_faces(const AxisFrame& frame) {
  axis_error_ = world_error_ * kLatticeSteps / grid_->voxel_size[frame.w];
  faces_.resize(mesh_->triangles.size());
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    const glm::uvec3& t = mesh_->triangles[i];
    const glm::ivec3 &a = mesh_->vertices[t.x], &b = mesh_->vertices[t.y],
                     &c = mesh_->vertices[t.z];
    Face& face = faces_[i];
    face = {};
    face.solid = lists_->solid_of(static_cast<std::uint32_t>(i));
    std::tie(face.least, face.most) = std::minmax({a[frame.w], b[frame.w], c[frame.w]});
    const glm::dvec3 across = glm::cross(glm::dvec3(b - a), glm::dvec3(c - a));  // lattice units
    if (across[frame.w] != 0.0) {
      face.slope_u = static_cast<float>(-across[frame.u] / across[frame.w]);
      face.slope_v = static_cast<float>(-across[frame.v] / across[frame.w]);
    }
    // Where voxels are not cubes, normals scale inversely to lengths.
    const glm::dvec3 normal = across / grid_->voxel_size;
    const double size = glm::length(normal);
    if (size > 0) face.facing = static_cast<float>(std::abs(normal[frame.w]) / size);
  }
}

double Sums::tolerance(const Crossing& one) const {
  // The bound is that of Coincidence::bound(): the rounding of depths and vertices, but no more
  // than the triangle's own extent.
  const Face& face = *one.face;
  const double slopes = 0.5 * (std::abs(face.slope_u) + std::abs(face.slope_v));
  const double reach = std::max({one.depth - face.least, face.most - one.depth, 0.0});
  return 1.5 + std::min(slopes, reach) + axis_error_;
}

/// Removes neighbouring crossings that coincide: a film (an entry and another solid's exit) or a
/// slit (an exit and another solid's entry).
void Sums::leave_out_films() {
  std::size_t kept = 0;
  for (const Crossing& next : list_) {
    if (kept > 0) {
      const Crossing& last = list_[kept - 1];
      if (last.exit != next.exit && last.face->solid != next.face->solid &&
          next.depth - last.depth <= tolerance(last) + tolerance(next)) {
        --kept;
        continue;
      }
    }
    list_[kept++] = next;
  }
  list_.resize(kept);
}

void Sums::add_column(const AxisFrame& frame, int u, int v) {
  Column& column = row_[static_cast<std::size_t>(u)];
  column = {};
  if (list_.empty()) return;
  const double cell = grid_->voxel_size[frame.u] * grid_->voxel_size[frame.v];
  double first_moment = 0;
  for (const Crossing& one : list_) {
    const double depth = one.depth / kLatticeSteps;
    const double sign = one.exit ? 1.0 : -1.0;
    column.length += sign * depth;
    column.slope_u += sign * one.face->slope_u;
    column.slope_v += sign * one.face->slope_v;
    first_moment += sign * depth * depth / 2;
    // A crossing represents an area of cell / facing. Weighted by facing^2, the contributions of
    // the three axes add up to the area.
    half_areas_[(u + v) % 2] += cell * one.face->facing;
    low_[frame.w] = std::min(low_[frame.w], depth);
    high_[frame.w] = std::max(high_[frame.w], depth);
  }
  column.count = static_cast<std::uint32_t>(list_.size());
  crossings_ += list_.size();
  most_ = std::max<std::uint64_t>(most_, list_.size());
  projected_[frame.w] += cell * static_cast<double>(list_.size());
  volumes_[frame.w] += column.length;
  moment_[frame.w] += first_moment;
  for (const auto& [side, at] : {std::pair(frame.u, u + 0.5), std::pair(frame.v, v + 0.5)}) {
    column_low_[side] = std::min(column_low_[side], at);
    column_high_[side] = std::max(column_high_[side], at);
    column_moment_[side] += at * column.length;
    column_weight_[side] += column.length;
  }
}

void Sums::add(Axis axis, const LayeredDepthImage& image) {
  const AxisFrame frame(axis);
  see_faces(frame);
  row_.assign(static_cast<std::size_t>(image.width), {});
  above_ = row_;
  const double cell = grid_->voxel_size[frame.u] * grid_->voxel_size[frame.v];
  // Compares the lengths halfway between two rays, extrapolated from both. Half a cell may belong
  // to either.
  const auto compare = [&](const Column& a, const Column& b, double slope_a, double slope_b) {
    const double ahead = a.length + slope_a / 2, back = b.length - slope_b / 2;
    const bool alike = a.count == b.count;
    errors_[frame.w] += 0.5 * std::abs(alike ? ahead - back : a.length - b.length);
    if (!alike) outlines_ += cell * std::abs(double(a.count) - double(b.count)) / 2;
  };
  for (int v = 0; v < image.height; ++v) {
    std::swap(row_, above_);
    for (int u = 0; u < image.width; ++u) {
      list_.clear();
      for (const DepthItem item : image.list(u, v)) {
        list_.push_back({item.depth() + 0.5, &faces_[item.triangle()], item.exit()});
      }
      leave_out_films();
      add_column(frame, u, v);
      const Column& column = row_[static_cast<std::size_t>(u)];
      if (u > 0) {
        const Column& left = row_[static_cast<std::size_t>(u) - 1];
        compare(left, column, left.slope_u, column.slope_u);
      }
      if (v > 0) {
        const Column& up = above_[static_cast<std::size_t>(u)];
        compare(up, column, up.slope_v, column.slope_v);
      }
    }
  }
}

Bounds Sums::crossed() const {
  Bounds box;
  for (int i = 0; i < 3; ++i) {
    const bool met = volumes_[i] > 0;
    box.low[i] = grid_->origin[i] + (met ? low_[i] : column_low_[i]) * grid_->voxel_size[i];
    box.high[i] = grid_->origin[i] + (met ? high_[i] : column_high_[i]) * grid_->voxel_size[i];
  }
  return box;
}

Measures Sums::finish() const {
  Measures result;
  result.result_crossings = crossings_;
  result.max_depth_complexity = most_;
  result.empty = !(volumes_[0] + volumes_[1] + volumes_[2] > 0);
  if (result.empty) return result;
  const glm::dvec3& step = grid_->voxel_size;
  const double cube = step.x * step.y * step.z;
  const double snap = glm::dot(projected_, step) / (2.0 * kLatticeSteps) / cube;
  // Axes are weighted by the inverse square of their error. An axis whose rays all miss what others
  // meet does not count.
  double weight = 0;
  for (int i = 0; i < 3; ++i) {
    if (!(volumes_[i] > 0)) continue;
    const double error = errors_[i] + snap;
    const double own = 1.0 / std::max(error * error, std::numeric_limits<double>::min());
    weight += own;
    result.volume += own * volumes_[i];
    result.volume_error += own * error;
  }
  result.volume /= weight;
  result.volume_error /= weight;
  // If the axes contradict each other, some rays have missed parts that others meet. Any of the
  // axes may be right.
  double farthest = 0;
  bool contradict = false;
  for (int i = 0; i < 3; ++i) {
    const double error = errors_[i] + snap;
    const double apart = std::abs(volumes_[i] - result.volume);
    contradict = contradict || apart > error + result.volume_error;
    if (volumes_[i] > 0) farthest = std::max(farthest, apart + error);
  }
  if (contradict) result.volume_error = std::max(result.volume_error, farthest);
  result.volume *= cube;
  result.volume_error *= cube;
  result.area = half_areas_[0] + half_areas_[1];
  result.area_error = std::max(3 * std::abs(half_areas_[0] - half_areas_[1]), outlines_);
  for (int i = 0; i < 3; ++i) {
    const bool met = volumes_[i] > 0;
    const double moment = met ? moment_[i] : column_moment_[i];
    result.centre[i] =
        grid_->origin[i] + moment / (met ? volumes_[i] : column_weight_[i]) * step[i];
  }
  return result;
}

/// A grid with the same number of voxels along each side, so that thin plates and rods are measured
/// as well as cubes. One voxel of room on each side keeps the result's depths from being clamped.
/// Solids may reach beyond the grid, where nothing belongs to the result.
VoxelGrid grid_around(const Bounds& box, int resolution) {
  const glm::dvec3 extent = box.high - box.low;
  const double longest = std::max({extent.x, extent.y, extent.z});
  VoxelGrid grid;
  grid.voxel_size = glm::max(extent, glm::dvec3(longest * kThinnest)) / double(resolution);
  grid.dims = glm::ivec3(resolution + 2);
  grid.origin = (box.low + box.high) * 0.5 - glm::dvec3(grid.dims) * grid.voxel_size * 0.5;
  return grid;
}

/// The share of the whole progress that one run has. Each run has four times the rays of the one
/// before.
struct Share {
  double begin = 0, length = 1;
};

class Measurer {
 public:
  Measurer(const Tree& tree, Tree::NodeId root, const Execution& execution)
      : tree_(&tree),
        root_(root),
        execution_(&execution),
        geometry_(tree),
        outer_(bounds(tree, root)) {}

  Result<Measures> run(const MeasureOptions& options);

 private:
  Result<Measures> once(int resolution, const Share& share);
  /// Sets the sides of the box and their error. Vertices count where the result reaches them.
  void settle_bounds(const VoxelGrid& grid, Bounds crossed, Measures& result) const;

  const Tree* tree_;
  Tree::NodeId root_;
  const Execution* execution_;
  Geometry geometry_;
  Bounds outer_;      ///< a box that contains the result
  Bounds box_;        ///< the box that is measured
  double error_ = 0;  ///< position error of the faces, world units
};

Result<Measures> Measurer::once(int resolution, const Share& share) {
  const VoxelGrid grid = grid_around(box_, resolution);
  SolidLists lists(*tree_, root_);
  if (auto done = lists.fit(grid, nullptr, *execution_); !done) return tl::unexpected(done.error());
  auto snapped = snap_to_lattice(lists.soup(), grid, *execution_);
  if (!snapped) return tl::unexpected(snapped.error());
  Sums sums(lists, *snapped, grid, error_);
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    auto image = build_ldi(*snapped, raster_target(grid, axis), {}, *execution_, &lists.filter());
    if (!image) return tl::unexpected(image.error());
    sums.add(axis, *image);
    if (execution_->progress) {
      execution_->progress(share.begin + share.length * (static_cast<int>(axis) + 1) / 3.0);
    }
  }
  Measures result = sums.finish();
  result.resolution = resolution;
  if (!std::isfinite(result.volume)) {
    return fail(ErrorCode::kGeometry, "the result is {:g} long; its volume is not finite",
                glm::length(box_.high - box_.low));
  }
  if (!result.empty) settle_bounds(grid, sums.crossed(), result);
  return result;
}

void Measurer::settle_bounds(const VoxelGrid& grid, Bounds crossed, Measures& result) const {
  // A crossing is known to two lattice steps. No side lies outside the box that contains the
  // result.
  const glm::dvec3 step = grid.voxel_size * (2.0 / kLatticeSteps);
  crossed.low = glm::clamp(crossed.low, outer_.low, outer_.high);
  crossed.high = glm::clamp(crossed.high, outer_.low, outer_.high);
  const Bounds reached =
      reached_vertices(*tree_, root_, geometry_, {crossed.low + step, crossed.high - step}, error_);
  for (int i = 0; i < 3; ++i) {
    const auto settle = [&](double ray, double vertex, double outer, bool beyond) {
      const double side = beyond ? vertex : ray;
      const double off = std::abs(outer - side);
      if (off > 0) result.bounds_error = std::max(result.bounds_error, std::max(off, step[i]));
      return side;
    };
    result.low[i] = settle(crossed.low[i], reached.low[i], outer_.low[i],
                           reached.low[i] <= crossed.low[i] + step[i]);
    result.high[i] = settle(crossed.high[i], reached.high[i], outer_.high[i],
                            reached.high[i] >= crossed.high[i] - step[i]);
  }
}

Result<Measures> Measurer::run(const MeasureOptions& options) {
  Measures result;
  result.resolution = options.resolution.value_or(kFirstResolution);
  if (outer_.empty()) return result;
  auto box = result_bounds(*tree_, root_, options.relative_precision, *execution_);
  if (!box) return tl::unexpected(box.error());
  box_ = box->empty() ? outer_ : *box;
  error_ = geometry_.world_error(*tree_, options.relative_precision);
  const glm::dvec3 extent = box_.high - box_.low;
  const double longest = std::max({extent.x, extent.y, extent.z});
  if (!(longest > 0) || !std::isfinite(longest)) return result;
  if (options.resolution) return once(*options.resolution, {});
  constexpr double kRuns = 1 + 4 + 16;
  double begin = 0, length = 1 / kRuns;
  for (int resolution = kFirstResolution;; resolution *= 2) {
    auto next = once(resolution, {begin, length});
    if (!next) {
      // If memory does not suffice for more rays, the previous result is returned.
      if (next.error().code == ErrorCode::kLimit && !result.empty) return result;
      return next;
    }
    result = *next;
    // An empty result is not final while small parts far apart may lie between the rays.
    const bool done =
        result.empty ? box->empty() : result.volume_error <= kGoodBound * result.volume;
    if (done) return result;
    const bool many = 4 * result.result_crossings > kMostCrossings;
    if (many || resolution * 2 > kLastResolution) return result;
    begin += length, length *= 4;
  }
}

}  // namespace

Result<Measures> measure(const Tree& tree, Tree::NodeId root, const MeasureOptions& options,
                         const Execution& execution) {
  constexpr int kMost = kMaxGridSide / 2;
  if (options.resolution && (*options.resolution < 1 || *options.resolution > kMost)) {
    return fail(ErrorCode::kUsage, "the resolution of measures must be 1 to {} voxels, got {}",
                kMost, *options.resolution);
  }
  if (auto checked = check_tree(tree, root); !checked) return tl::unexpected(checked.error());
  return Measurer(tree, root, execution).run(options);
}

Result<Measures> measure(const Tree& tree, const MeasureOptions& options,
                         const Execution& execution) {
  return measure(tree, tree.root(), options, execution);
}

}  // namespace strata::csg
