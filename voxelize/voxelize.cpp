#include "strata/voxelize/voxelize.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "strata/hashbuffer/tile_lists.h"
#include "strata/raster/lattice_mesh.h"
#include "strata/voxelize/checksum.h"
#include "strata/voxelize/grid_fit.h"
#include "voxelize/open/boundary_caps.h"
#include "voxelize/open/winding_field.h"
#include "voxelize/samples.h"
#include "voxelize/shell_voxels.h"
#include "voxelize/solid.h"
#include "voxelize/tree_shell.h"

namespace strata {
namespace {

/// Columns walked along the side of a voxel.
int fine(const VoxelizeOptions& options) { return std::max(options.samples, options.rays); }

/// Rows of a slab whose intervals are expected to stay within kMostSlabBytes, and within an eighth
/// of the memory limit.
/// With several columns a voxel, whole tiles of voxels.
int slab_rows(const VoxelGrid& grid, const VoxelizeOptions& options, const Execution& execution) {
  const AxisFrame frame(options.axis);
  const int samples = fine(options);
  // Offset, and two intervals with their copies; the same of voxels, with labels, where only those
  // are made.
  const std::uint64_t bytes_a_column =
      options.rays > 0 ? 1 + 128 / static_cast<std::uint64_t>(samples * samples) : 16;
  const std::uint64_t budget = execution.memory_limit > 0
                                   ? std::min(kMostSlabBytes, execution.memory_limit / 8)
                                   : kMostSlabBytes;
  const std::uint64_t rows =
      budget / (bytes_a_column * static_cast<std::uint64_t>(grid.dims[frame.u]));
  const auto unit = static_cast<std::uint64_t>(kTileSide) * static_cast<std::uint64_t>(samples);
  const std::uint64_t units = std::max<std::uint64_t>(1, rows / unit);
  const std::uint64_t most = std::max<std::uint64_t>(1, kMaxGridSide / unit);
  return static_cast<int>(std::min(units, most) * unit);
}

Result<void> check_rays(int longest, const VoxelizeOptions& options) {
  const int rays = options.rays;
  if (rays == 0) return {};
  if (rays < 0 || rays > kTileSide || !std::has_single_bit(static_cast<unsigned>(rays))) {
    return fail(ErrorCode::kUsage,
                "rays per side of a voxel must be a power of two from 1 to {}, got {}", kTileSide,
                rays);
  }
  if (rays > kMaxGridSide / longest) {
    return fail(ErrorCode::kUsage, "{} rays per side of a voxel on a grid of {} voxels exceed {}",
                rays, longest, kMaxGridSide);
  }
  if (options.samples > 1) {
    return fail(ErrorCode::kUsage, "samples and rays of voxels cannot be combined");
  }
  if (options.surface || !options.solid) {
    return fail(ErrorCode::kUsage, "rays of voxels need a solid voxelization without its surface");
  }
  return {};
}

Result<void> check_samples(const VoxelGrid& grid, const VoxelizeOptions& options) {
  const int samples = options.samples;
  const int longest = std::max({grid.dims.x, grid.dims.y, grid.dims.z});
  if (samples < 1 || samples > kMaxGridSide / longest) {
    return fail(ErrorCode::kUsage,
                "samples per side of a voxel must be 1 to {} on a grid of {} x {} x {}, got {}",
                kMaxGridSide / longest, grid.dims.x, grid.dims.y, grid.dims.z, samples);
  }
  if ((samples > 1 || options.rays > 0) && options.filter != nullptr &&
      options.filter->labelled()) {
    return fail(ErrorCode::kUsage, "labels cannot be combined with samples");
  }
  return check_rays(longest, options);
}

/// What is assumed of the mesh, or found out where it matters.
MeshClosedness closedness_of(const TriangleSoup& mesh, const VoxelizeOptions& options,
                             const Execution& execution) {
  const bool matters = options.solid || options.open == OpenMode::kFail;
  if (options.closedness != Closedness::kCheck || options.filter != nullptr || !matters) {
    return {options.closedness != Closedness::kAssumeOpen};
  }
  return find_closedness(mesh, options.rule == InsideRule::kParity, execution);
}

/// The solid of a mesh, slab by slab along options.axis. An open mesh is closed by caps, and what
/// its winding numbers are other than those of the closed one is added
/// (voxelize/open/winding_field.h).
class SolidSlabs {
 public:
  /// Keeps references to all arguments but `execution`.
  static Result<SolidSlabs> create(const LatticeMesh& mesh, const VoxelGrid& grid,
                                   const MeshClosedness& found, const VoxelizeOptions& options,
                                   const Execution& execution) {
    SolidSlabs result;
    const LatticeMesh* whole = &mesh;
    if (!found.closed) {
      if (auto caps = boundary_caps(mesh, found, execution); !caps.triangles.empty()) {
        result.open_ = std::make_unique<Open>(mesh, std::move(caps), grid, execution.stop);
        if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
        whole = &result.open_->whole;
        VoxelizeOptions counting = options;
        counting.source = nullptr;
        counting.statistics = false;
        counting.rays = 0;
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

  Result<void> prepare(int v_begin, int v_end, const Execution& execution) {
    if (auto done = solid_.prepare(v_begin, v_end, execution); !done || !open_) return done;
    return open_->columns.prepare(v_begin, v_end, execution);
  }

  /// Takes a slab back: the next one is made in its memory.
  void reuse(VoxelIntervals&& slab) { solid_.reuse(std::move(slab)); }

  /// @param voxels their grid, where options.rays are asked for
  Result<VoxelIntervals> slab(const VoxelGrid* voxels, int v_begin, int v_end,
                              const Execution& execution, VoxelizeReport& report) {
    auto result = voxels != nullptr
                      ? solid_.covered_slab(*voxels, v_begin, v_end, execution, report)
                      : solid_.slab(v_begin, v_end, execution, report);
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

/// The rows that are asked for, one range after another.
class RowTurns {
 public:
  /// @param next  gives them; empty: `all` at once
  RowTurns(const VoxelRows& all, const std::function<std::optional<VoxelRows>()>& next)
      : all_(all), next_(next) {}
  std::optional<VoxelRows> next() {
    if (next_) return next_();
    return std::exchange(all_, std::nullopt);
  }

 private:
  std::optional<VoxelRows> all_;
  const std::function<std::optional<VoxelRows>()>& next_;
};

/// Tiles are whole, but for the last row of them.
Result<void> check_rows(const VoxelRows& rows, const VoxelRows& all) {
  const bool whole =
      rows.begin % kTileSide == 0 && (rows.end % kTileSide == 0 || rows.end == all.end);
  if (whole && rows.begin >= all.begin && rows.begin < rows.end && rows.end <= all.end) return {};
  return fail(ErrorCode::kUsage, "rows {} to {} of {} to {} are no rows of tiles of {}", rows.begin,
              rows.end, all.begin, all.end, kTileSide);
}

/// Options that no mesh could be voxelized with.
Result<void> check_options(const VoxelGrid& grid, const VoxelizeOptions& options) {
  if (auto valid = check_grid(grid); !valid) return valid;
  if (auto valid = check_samples(grid, options); !valid) return valid;
  if (options.rows) {
    const VoxelRows all{0, grid.dims[AxisFrame(options.axis).v]};
    if (auto valid = check_rows(*options.rows, all); !valid) return valid;
  }
  if (!options.solid && !options.surface) {
    return fail(ErrorCode::kUsage, "neither solid nor surface is requested");
  }
  if (options.filter != nullptr && options.closedness == Closedness::kAssumeOpen) {
    return fail(ErrorCode::kUsage,
                "the lists of a Boolean tree are closed; OpenMode::kVote does not apply");
  }
  if (options.filter != nullptr && options.surface && options.filter->labelled()) {
    return fail(ErrorCode::kUsage, "labels need a solid voxelization without its surface");
  }
  return {};
}

/// The surface of a mesh or of a tree, slab by slab.
class ShellSlabs {
 public:
  /// Keeps references to all arguments but `execution`.
  static Result<ShellSlabs> create(const LatticeMesh& mesh, const VoxelGrid& grid,
                                   const VoxelizeOptions& options, const Execution& execution) {
    ShellSlabs result;
    result.mesh_ = &mesh;
    result.grid_ = &grid;
    result.options_ = &options;
    if (options.filter == nullptr) return result;
    auto made = TreeShell::create(mesh, grid, options, execution);
    if (!made) return tl::unexpected(made.error());
    result.tree_ = *std::move(made);
    return result;
  }
  Result<VoxelIntervals> slab(int v_begin, int v_end, const Execution& execution) {
    return tree_ ? tree_->slab(v_begin, v_end, execution)
                 : voxelize_shell(*mesh_, *grid_, options_->surface_kind, options_->axis, v_begin,
                                  v_end, execution);
  }

 private:
  const LatticeMesh* mesh_ = nullptr;
  const VoxelGrid* grid_ = nullptr;
  const VoxelizeOptions* options_ = nullptr;
  std::optional<TreeShell> tree_;
};

/// What is asked of a mesh, slab by slab: its solid, its surface, or both.
class Slabs {
 public:
  /// Keeps references to all arguments but `execution`.
  static Result<Slabs> create(const LatticeMesh& mesh, const VoxelGrid& grid,
                              const MeshClosedness& found, const VoxelizeOptions& options,
                              const Execution& execution) {
    Slabs result(grid, options.axis);
    const bool open_surface = !found.closed && options.open == OpenMode::kSurface;
    if (options.surface || open_surface) {
      auto made = ShellSlabs::create(mesh, grid, options, execution);
      if (!made) return tl::unexpected(made.error());
      result.shell_ = *std::move(made);
    }
    if (options.solid && !open_surface) {
      auto made = SolidSlabs::create(mesh, grid, found, options, execution);
      if (!made) return tl::unexpected(made.error());
      result.solid_ = *std::move(made);
    }
    return result;
  }

  /// Before slabs of rows [v_begin, v_end) are asked for.
  Result<void> prepare(int v_begin, int v_end, const Execution& execution) {
    return solid_ ? solid_->prepare(v_begin, v_end, execution) : Result<void>();
  }

  /// See SolidSlabs.
  void reuse(VoxelIntervals&& slab) {
    if (solid_) solid_->reuse(std::move(slab));
  }

  Result<VoxelIntervals> slab(const VoxelGrid* voxels, int v_begin, int v_end,
                              const Execution& execution, VoxelizeReport& report) {
    auto solid = solid_ ? solid_->slab(voxels, v_begin, v_end, execution, report)
                        : VoxelIntervals(*grid_, axis_, v_begin, v_end);
    if (!solid || !shell_) return solid;
    auto shell = shell_->slab(v_begin, v_end, execution);
    return shell && solid_ ? union_intervals(*solid, *shell, execution) : std::move(shell);
  }

 private:
  Slabs(const VoxelGrid& grid, Axis axis) : grid_(&grid), axis_(axis) {}

  const VoxelGrid* grid_;
  Axis axis_;
  std::optional<SolidSlabs> solid_;
  std::optional<ShellSlabs> shell_;
};

/// Takes a finished slab over.
using OwningSink = std::function<Result<void>(VoxelIntervals&&)>;

/// The work of both entry points: slabs, or one, go to `sink` in increasing v.
/// @param asked the grid of the result; inside, `grid` is that of the samples
Result<VoxelizeReport> run(const TriangleSoup& mesh, const VoxelGrid& asked,
                           const VoxelizeOptions& options, const Execution& execution,
                           bool in_slabs, const OwningSink& sink) {
  if (auto valid = check_options(asked, options); !valid) return tl::unexpected(valid.error());
  const VoxelGrid grid = refined(asked, fine(options));
  const auto lattice = snap_to_lattice(mesh, grid, execution);
  if (!lattice) return tl::unexpected(lattice.error());
  Execution quiet = execution;  // inner phases do not report progress of their own
  quiet.progress = {};
  VoxelizeReport report;
  const MeshClosedness found = closedness_of(mesh, options, quiet);
  report.closed = found.closed;
  if (!report.closed && options.open == OpenMode::kFail) {
    return fail(ErrorCode::kGeometry, "the mesh is not closed");
  }
  if (!report.closed && options.open == OpenMode::kSurface && options.rays > 0) {
    return fail(ErrorCode::kGeometry,
                "the mesh is not closed, and its surface alone has no filled fraction");
  }
  auto slabs = Slabs::create(*lattice, grid, found, options, quiet);
  if (!slabs) return tl::unexpected(slabs.error());

  SetChecksum checksum(asked);
  const VoxelRows all = options.rows.value_or(VoxelRows{0, asked.dims[AxisFrame(options.axis).v]});
  const int rows = grid.dims[AxisFrame(options.axis).v], columns_a_row = fine(options);
  const int step = in_slabs ? slab_rows(grid, options, execution) : rows;
  RowTurns turns(all, options.next_rows);
  while (const auto turn = turns.next()) {
    if (auto valid = check_rows(*turn, all); !valid) return tl::unexpected(valid.error());
    const int last = turn->end * columns_a_row;
    if (auto done = slabs->prepare(turn->begin * columns_a_row, last, quiet); !done) {
      return tl::unexpected(done.error());
    }
    for (int v = turn->begin * columns_a_row; v < last; v += step) {
      const int end = std::min(last, v + step);
      auto slab = slabs->slab(options.rays > 0 ? &asked : nullptr, v, end, quiet, report);
      if (!slab) return tl::unexpected(slab.error());
      if (options.samples > 1) *slab = count_samples(*slab, asked, options.samples, quiet);
      if (options.statistics) {
        report.solid_voxels += slab->solid_voxels();
        report.intervals += slab->interval_count();
        checksum.add(*slab, quiet);
      }
      if (auto done = sink(std::move(*slab)); !done) return tl::unexpected(done.error());
      if (options.rays == 0) slabs->reuse(*std::move(slab));  // others are made in their own
      if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
      if (execution.progress) {
        execution.progress(static_cast<double>(end - all.begin * columns_a_row) /
                           ((all.end - all.begin) * columns_a_row));
      }
    }
  }
  if (options.statistics) {
    report.checksum = checksum.value();
    report.checksum_sum = checksum.sum();
  }
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
