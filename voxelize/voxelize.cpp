#include "strata/voxelize/voxelize.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "strata/raster/lattice_mesh.h"
#include "strata/voxelize/checksum.h"
#include "strata/voxelize/shell_voxels.h"
#include "voxelize/open/boundary_caps.h"
#include "voxelize/open/winding_field.h"
#include "voxelize/samples.h"
#include "voxelize/solid.h"
#include "voxelize/tree_shell.h"

namespace strata {
namespace {

Result<void> check_grid(const VoxelGrid& grid) {
  for (int axis = 0; axis < 3; ++axis) {
    if (grid.dims[axis] < 1 || grid.dims[axis] > kMaxGridSide) {
      return fail(ErrorCode::kUsage, "the grid has {} voxels along {}; 1 to {} can be had",
                  grid.dims[axis], "xyz"[axis], kMaxGridSide);
    }
    if (!(grid.voxel_size[axis] > 0) || !std::isfinite(grid.voxel_size[axis]) ||
        !std::isfinite(grid.origin[axis])) {
      return fail(ErrorCode::kUsage,
                  "voxel size {} and origin {} along {} must be finite, the size > 0",
                  grid.voxel_size[axis], grid.origin[axis], "xyz"[axis]);
    }
  }
  return {};
}

/// Rows of a slab whose intervals are expected to stay within an eighth of the memory limit.
/// With samples of voxels, whole tiles of those.
int slab_rows(const VoxelGrid& grid, Axis axis, int samples, const Execution& execution) {
  const AxisFrame frame(axis);
  constexpr std::uint64_t kBytesPerColumn = 16;  // offset, and two intervals with their copies
  constexpr std::uint64_t kDefaultSlabBytes = std::uint64_t{512} << 20;
  const std::uint64_t budget = execution.memory_limit > 0
                                   ? std::min(kDefaultSlabBytes, execution.memory_limit / 8)
                                   : kDefaultSlabBytes;
  const std::uint64_t rows =
      budget / (kBytesPerColumn * static_cast<std::uint64_t>(grid.dims[frame.u]));
  const auto unit = static_cast<std::uint64_t>(kTileSide) * static_cast<std::uint64_t>(samples);
  const std::uint64_t units = std::max<std::uint64_t>(1, rows / unit);
  const std::uint64_t most = std::max<std::uint64_t>(1, kMaxGridSide / unit);
  return static_cast<int>(std::min(units, most) * unit);
}

Result<void> check_samples(const VoxelGrid& grid, const VoxelizeOptions& options) {
  const int samples = options.samples;
  const int longest = std::max({grid.dims.x, grid.dims.y, grid.dims.z});
  if (samples < 1 || samples > kMaxGridSide / longest) {
    return fail(ErrorCode::kUsage,
                "samples a side of a voxel must be 1 to {} on a grid of {} x {} x {}, got {}",
                kMaxGridSide / longest, grid.dims.x, grid.dims.y, grid.dims.z, samples);
  }
  if (samples > 1 && options.filter != nullptr && options.filter->labelled()) {
    return fail(ErrorCode::kUsage, "labels are of whole voxels, samples have none");
  }
  return {};
}

/// The solid of a mesh, slab by slab along options.axis. An open mesh is closed by caps, and what
/// its winding numbers are other than those of the closed one is added
/// (voxelize/open/winding_field.h).
class SolidSlabs {
 public:
  /// Keeps references to all arguments but `execution`.
  static Result<SolidSlabs> create(const LatticeMesh& mesh, const VoxelGrid& grid,
                                   const VoxelizeOptions& options, const Execution& execution) {
    SolidSlabs result;
    const LatticeMesh* whole = &mesh;
    if (!options.closed) {
      if (auto caps = boundary_caps(mesh, execution); !caps.triangles.empty()) {
        result.open_ = std::make_unique<Open>(mesh, std::move(caps), grid, execution.stop);
        if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
        whole = &result.open_->whole;
        VoxelizeOptions counting = options;
        counting.source = nullptr;
        counting.statistics = false;
        auto made =
            SolidVoxelizer::create(result.open_->caps, grid, options.axis, counting, execution);
        if (!made) return tl::unexpected(made.error());
        result.open_->columns = *std::move(made);
      }
    }
    auto made = SolidVoxelizer::create(*whole, grid, options.axis, options, execution,
                                       result.open_ ? &result.open_->field : nullptr);
    if (!made) return tl::unexpected(made.error());
    result.solid_ = *std::move(made);
    return result;
  }

  Result<VoxelIntervals> slab(int v_begin, int v_end, const Execution& execution,
                              VoxelizeReport& report) {
    auto result = solid_.slab(v_begin, v_end, execution, report);
    if (!result || !open_) return result;
    // The caps are missing where the mesh's columns are unbalanced, and their crossings are not
    // its.
    VoxelizeReport caps;
    const auto counted = open_->columns.slab(v_begin, v_end, execution, caps);
    if (!counted) return tl::unexpected(counted.error());
    report.unbalanced_columns += caps.unbalanced_columns;
    report.crossings -= caps.crossings;
    return result;
  }

 private:
  struct Open {
    Open(const LatticeMesh& mesh, BoundaryCaps&& closing, const VoxelGrid& grid,
         const std::stop_token& stop)
        : triangles(mesh.triangles.begin(), mesh.triangles.end()),
          cap_triangles(std::move(closing.triangles)),
          field(mesh, std::span(cap_triangles).first(closing.doubtful), grid, stop) {
      triangles.insert(triangles.end(), cap_triangles.begin(), cap_triangles.end());
      whole = {mesh.vertices, triangles};
      for (glm::uvec3& t : cap_triangles) {
        for (int i = 0; i < 3; ++i) {
          caps.vertices.push_back(mesh.vertices[t[i]]);
          t[i] = static_cast<std::uint32_t>(caps.vertices.size() - 1);
        }
      }
      caps.triangles = cap_triangles;
    }
    std::vector<glm::uvec3> triangles, cap_triangles;  ///< the mesh's and the caps; the caps
    LatticeMesh whole, caps;
    WindingField field;
    SolidVoxelizer columns;  ///< of the caps alone
  };
  std::unique_ptr<Open> open_;
  SolidVoxelizer solid_;
};

/// Takes a finished slab over.
using OwningSink = std::function<Result<void>(VoxelIntervals&&)>;

/// The work of both entry points: slabs, or one, go to `sink` in increasing v.
/// @param asked the grid of the result; inside, `grid` is that of the samples
Result<VoxelizeReport> run(const TriangleSoup& mesh, const VoxelGrid& asked,
                           const VoxelizeOptions& options, const Execution& execution,
                           bool in_slabs, const OwningSink& sink) {
  if (auto valid = check_grid(asked); !valid) return tl::unexpected(valid.error());
  if (auto valid = check_samples(asked, options); !valid) return tl::unexpected(valid.error());
  if (!options.solid && !options.surface) {
    return fail(ErrorCode::kUsage, "neither the solid nor the surface is asked for");
  }
  if (options.filter != nullptr && !options.closed) {
    return fail(ErrorCode::kUsage, "the lists of a Boolean tree are closed; there is no vote");
  }
  if (options.filter != nullptr && options.surface && options.filter->labelled()) {
    return fail(ErrorCode::kUsage, "labels are of solids, the surface has none");
  }
  if (!options.closed && options.open == OpenMode::kFail) {
    return fail(ErrorCode::kGeometry, "the mesh is not closed");
  }
  const VoxelGrid grid = refined(asked, options.samples);
  const int step =
      in_slabs ? slab_rows(grid, options.axis, options.samples, execution) : kMaxGridSide;
  const auto snapped = snap_to_lattice(mesh, grid, execution);
  if (!snapped) return tl::unexpected(snapped.error());
  const LatticeMesh& lattice = *snapped;

  VoxelizeReport report;
  SetChecksum checksum(asked);
  Execution quiet = execution;  // inner phases do not report progress of their own
  quiet.progress = {};
  const bool open_surface = !options.closed && options.open == OpenMode::kSurface;
  const bool solid = options.solid && !open_surface;
  const bool surface = options.surface || open_surface;
  std::optional<TreeSurface> tree;
  if (surface && options.filter != nullptr) {
    auto made = TreeSurface::create(lattice, grid, options, quiet);
    if (!made) return tl::unexpected(made.error());
    tree = *std::move(made);
  }

  const auto pass_on = [&](VoxelIntervals&& slab) -> Result<void> {
    if (surface) {
      auto skin = tree ? tree->slab(slab.v_begin(), slab.v_end(), quiet)
                       : voxelize_surface(lattice, grid, options.surface_kind, options.axis,
                                          slab.v_begin(), slab.v_end(), quiet);
      if (skin && solid) skin = union_intervals(slab, *skin, quiet);
      if (!skin) return tl::unexpected(skin.error());
      slab = std::move(*skin);
    }
    if (options.samples > 1) slab = count_samples(slab, asked, options.samples, quiet);
    if (options.statistics) {
      report.solid_voxels += slab.solid_voxels();
      report.intervals += slab.interval_count();
      checksum.add(slab, quiet);
    }
    return sink(std::move(slab));
  };

  std::optional<SolidSlabs> slabs;
  if (solid) {
    auto made = SolidSlabs::create(lattice, grid, options, quiet);
    if (!made) return tl::unexpected(made.error());
    slabs = *std::move(made);
  }
  const int rows = grid.dims[AxisFrame(options.axis).v];
  for (int v = 0; v < rows; v += step) {
    const int end = std::min(rows, v + step);
    Result<VoxelIntervals> slab =
        slabs ? slabs->slab(v, end, quiet, report) : VoxelIntervals(grid, options.axis, v, end);
    if (!slab) return tl::unexpected(slab.error());
    if (auto done = pass_on(std::move(*slab)); !done) return tl::unexpected(done.error());
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    if (execution.progress) execution.progress(static_cast<double>(end) / rows);
  }
  if (options.statistics) report.checksum = checksum.value();
  return report;
}

}  // namespace

Result<VoxelizeReport> voxelize_slabs(const TriangleSoup& mesh, const VoxelGrid& grid,
                                      const VoxelizeOptions& options, const Execution& execution,
                                      const SlabSink& sink) {
  return run(mesh, grid, options, execution, true,
             [&](VoxelIntervals&& slab) { return sink(slab); });
}

Result<VoxelIntervals> voxelize(const TriangleSoup& mesh, const VoxelGrid& grid,
                                const VoxelizeOptions& options, const Execution& execution,
                                VoxelizeReport* report) {
  VoxelIntervals result;
  const auto done =
      run(mesh, grid, options, execution, false, [&](VoxelIntervals&& slab) -> Result<void> {
        result = std::move(slab);
        return {};
      });
  if (!done) return tl::unexpected(done.error());
  if (report != nullptr) *report = *done;
  return result;
}

}  // namespace strata
