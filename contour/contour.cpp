#include "strata/contour/contour.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#include "contour/block_mesh.h"
#include "contour/block_points.h"
#include "contour/cell_blocks.h"
#include "contour/grid_crossings.h"
#include "core/share_of.h"
#include "strata/mesh/diagnose.h"
#include "strata/raster/lattice_mesh.h"
#include "strata/voxelize/grid_fit.h"
#include "voxelize/open/boundary_caps.h"
#include "voxelize/open/winding_field.h"

namespace strata {
namespace {

using namespace contouring;

/// A mesh that is closed by caps, and where its winding numbers are other than those of the caps.
struct Capped {
  Capped(const LatticeMesh& mesh, BoundaryCaps&& caps, const VoxelGrid& grid,
         const std::stop_token& stop)
      : triangles(mesh.triangles.begin(), mesh.triangles.end()),
        field(mesh, std::span(caps.triangles).first(caps.doubtful), grid, stop) {
    triangles.insert(triangles.end(), caps.triangles.begin(), caps.triangles.end());
    whole = {mesh.vertices, triangles};
  }
  std::vector<glm::uvec3> triangles;  ///< the mesh's and the caps
  LatticeMesh whole;
  WindingField field;
};

Result<void> check_options(const VoxelGrid& grid, const ContourOptions& options) {
  if (auto valid = check_grid(grid); !valid) return valid;
  if (options.open == OpenMode::kSurface) {
    return fail(ErrorCode::kUsage, "a contour is of a solid; OpenMode::kSurface has none");
  }
  if (options.filter != nullptr && options.closedness == Closedness::kAssumeOpen) {
    return fail(ErrorCode::kUsage,
                "the lists of a Boolean tree are closed; OpenMode::kVote does not apply");
  }
  if (options.filter != nullptr && options.filter->labelled()) {
    return fail(ErrorCode::kUsage, "a contour takes lists without labels");
  }
  return {};
}

/// What is assumed of the mesh, or found out.
bool counts_as_closed(const TriangleSoup& mesh, const ContourOptions& options,
                      const Execution& execution) {
  if (options.closedness != Closedness::kCheck || options.filter != nullptr) {
    return options.closedness != Closedness::kAssumeOpen;
  }
  if (is_closed(mesh, execution)) return true;
  return options.rule == InsideRule::kParity && diagnose(mesh, execution).even;
}

std::vector<Plane> planes_of(const LatticeMesh& mesh, const Execution& execution) {
  std::vector<Plane> planes(mesh.triangles.size());
  constexpr std::size_t kChunk = 1 << 14;
  parallel_for(execution, (planes.size() + kChunk - 1) / kChunk, [&](std::size_t chunk, int) {
    for (std::size_t t = chunk * kChunk; t < std::min(planes.size(), (chunk + 1) * kChunk); ++t) {
      const glm::uvec3& corners = mesh.triangles[t];
      planes[t] =
          plane_of(glm::dvec3(mesh.vertices[corners.x]), glm::dvec3(mesh.vertices[corners.y]),
                   glm::dvec3(mesh.vertices[corners.z]));
    }
  });
  return planes;
}

/// The sizes of a mesh.
struct MeshSizes {
  std::uint64_t vertices = 0, triangles = 0;
};

/// Places the vertices of all cells, and numbers all vertices and triangles.
Result<MeshSizes> number(CellBlocks& blocks, const LatticeMesh& mesh, const VoxelGrid& grid,
                         const Execution& execution, ContourReport& report) {
  const std::vector<Plane> planes = planes_of(mesh, execution);
  std::atomic<std::uint64_t> clamped{0};
  parallel_for(execution, blocks.count(), [&](std::size_t n, int) {
    clamped += place_points(blocks.block(n), blocks.neighbours(n), blocks.place(n), grid, planes);
  });
  report.clamped_vertices = clamped;
  std::vector<std::unique_ptr<StripFinder>> strips(
      static_cast<std::size_t>(execution.thread_count()));
  parallel_for(execution, blocks.count(), [&](std::size_t n, int worker) {
    auto& finder = strips[static_cast<std::size_t>(worker)];
    if (!finder) finder = std::make_unique<StripFinder>();
    choose_shapes(blocks.neighbours(n), *finder);
  });
  parallel_for(execution, blocks.count(),
               [&](std::size_t n, int) { number_vertices(blocks.block(n)); });
  parallel_for(execution, blocks.count(),
               [&](std::size_t n, int) { count_block(blocks.block(n), blocks.neighbours(n)); });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  MeshSizes sizes;
  for (std::size_t n = 0; n < blocks.count(); ++n) {
    CellBlock& block = blocks.block(n);
    block.first_vertex = sizes.vertices;
    block.first_triangle = sizes.triangles;
    sizes.vertices += block.vertices();
    sizes.triangles += block.triangles;
  }
  if (sizes.vertices > std::numeric_limits<std::uint32_t>::max()) {
    return fail(ErrorCode::kLimit,
                "the contour needs {} vertices, but a mesh may have {}; a coarser grid needs fewer",
                sizes.vertices, std::numeric_limits<std::uint32_t>::max());
  }
  return sizes;
}

void add_counts(CellBlocks& blocks, ContourReport& report) {
  for (std::size_t n = 0; n < blocks.count(); ++n) {
    const CellBlock& block = blocks.block(n);
    report.crossings += block.crossings.size();
    report.cells += block.cells;
    report.ambiguous_cells += block.ambiguous;
    report.middle_vertices += block.middles;
    report.fans += block.fans;
    for (const Strip& strip : block.strips) report.merged_crossings += strip.length * strip.width;
    report.guessed_crossings += block.guessed;
  }
}

/// What is left of a memory limit.
std::uint64_t memory_left(const Execution& execution, std::uint64_t held) {
  if (execution.memory_limit == 0) return std::numeric_limits<std::uint64_t>::max();
  return execution.memory_limit - std::min(execution.memory_limit, held);
}

/// From the lists of a closed mesh, or of one with a field, to triangles.
Result<ContourMesh> contour_lattice(const LatticeMesh& mesh, const VoxelGrid& grid,
                                    const GridCrossings::Settings& settings,
                                    const Execution& execution) {
  Execution quiet = execution;
  quiet.progress = {};
  ContourMesh result;
  std::optional<CellBlocks> blocks;
  {
    const auto crossings =
        GridCrossings::collect(mesh, grid, settings, detail::share_of(execution, 0.0, 0.5));
    if (!crossings) return tl::unexpected(crossings.error());
    result.report.lost_crossings = crossings->lost();
    const std::uint64_t held = crossings->memory_bytes() + mesh.triangles.size() * sizeof(Plane);
    auto made = CellBlocks::create(*crossings, quiet, memory_left(execution, held));
    if (!made) return tl::unexpected(made.error());
    blocks = *std::move(made);
  }
  const auto sizes = number(*blocks, mesh, grid, quiet, result.report);
  if (!sizes) return tl::unexpected(sizes.error());
  add_counts(*blocks, result.report);
  const std::uint64_t needed =
      sizes->vertices * sizeof(glm::dvec3) + sizes->triangles * sizeof(glm::uvec3);
  const std::uint64_t left = memory_left(execution, blocks->memory_bytes());
  if (needed > left) {
    return fail(ErrorCode::kLimit,
                "the contour has {} triangles, which need {} bytes, but the memory limit of {} "
                "bytes leaves {}",
                sizes->triangles, needed, execution.memory_limit, left);
  }
  result.mesh.positions.resize(sizes->vertices);
  result.mesh.triangles.resize(sizes->triangles);
  const Execution last = detail::share_of(execution, 0.5, 1.0);
  parallel_for(execution, blocks->count(), [&](std::size_t n, int worker) {
    const BlockNeighbours neighbours = blocks->neighbours(n);
    BlockMesh(neighbours, blocks->place(n), grid)
        .write(result.mesh.positions, result.mesh.triangles);
    if (last.progress && worker == 0) {
      last.progress(static_cast<double>(n) / static_cast<double>(blocks->count()));
    }
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  if (sizes->triangles > 0) result.mesh.parts.emplace_back();
  return result;
}

Result<ContourMesh> run(const TriangleSoup& mesh, const VoxelGrid& grid,
                        const ContourOptions& options, const Execution& execution) {
  if (auto valid = check_options(grid, options); !valid) return tl::unexpected(valid.error());
  Execution quiet = execution;
  quiet.progress = {};
  const auto lattice = snap_to_lattice(mesh, grid, quiet);
  if (!lattice) return tl::unexpected(lattice.error());
  const bool closed = counts_as_closed(mesh, options, quiet);
  if (!closed && options.open == OpenMode::kFail) {
    return fail(ErrorCode::kGeometry, "the mesh is not closed");
  }
  std::unique_ptr<Capped> capped;
  if (!closed) {
    if (auto caps = boundary_caps(*lattice, {}, quiet); !caps.triangles.empty()) {
      capped = std::make_unique<Capped>(*lattice, std::move(caps), grid, execution.stop);
    }
  }
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  auto result =
      contour_lattice(capped ? capped->whole : *lattice, grid,
                      {options.rule, options.filter, capped ? &capped->field : nullptr}, execution);
  if (result) result->report.closed = closed;
  if (result && execution.progress) execution.progress(1.0);
  return result;
}

}  // namespace

Result<ContourMesh> contour(const TriangleSoup& mesh, const VoxelGrid& grid,
                            const ContourOptions& options, const Execution& execution) {
  try {
    return run(mesh, grid, options, execution);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "out of memory for the contour on a grid of {} x {} x {}",
                grid.dims.x, grid.dims.y, grid.dims.z);
  }
}

}  // namespace strata
