#include "voxelize/tree_shell.h"

#include <algorithm>
#include <mutex>
#include <utility>

#include "hashbuffer/tile_builder.h"
#include "strata/hashbuffer/build_ldi.h"
#include "voxelize/shell_tiles.h"

namespace strata {

using shell::Bins;
using shell::Budget;

/// The scratch of one thread, and its work on one tile.
struct TreeShell::Worker {
  explicit Worker(const VoxelizeOptions& options)
      : builder({.store = options.store, .offsets = options.offsets}),
        filter(options.filter->worker()) {}

  /// The runs of each solid's faces, column by column.
  void find_faces(const LatticeMesh& mesh, std::span<const std::uint32_t> triangles,
                  const shell::Window& window, AxisFrame frame, const VoxelizeOptions& options);
  /// What the filter keeps of them. @return whether there is any
  bool keep(const TileLists<DepthItem>& lists);
  [[nodiscard]] std::uint64_t bytes() const {
    return collector.bytes() + found.capacity() * sizeof(Found) +
           faces.capacity() * sizeof(FaceRun) + items.capacity() * sizeof(Interval);
  }

  struct Found {
    std::uint32_t local = 0;
    FaceRun run;
  };
  ItemTileBuilder builder;
  std::unique_ptr<TileListFilter::Worker> filter;
  shell::RunCollector collector;
  std::vector<Found> found;
  std::vector<FaceRun> faces;  // by column
  std::vector<std::uint32_t> first_face;
  std::vector<VoxelRun> kept;
  std::vector<std::uint32_t> offsets;
  std::vector<Interval> items;
};

void TreeShell::Worker::find_faces(const LatticeMesh& mesh,
                                   std::span<const std::uint32_t> triangles,
                                   const shell::Window& window, AxisFrame frame,
                                   const VoxelizeOptions& options) {
  found.clear();
  for (std::size_t i = 0; i < triangles.size();) {
    const std::uint32_t solid = options.filter->solid_of(triangles[i]);
    collector.clear();
    for (; i < triangles.size() && options.filter->solid_of(triangles[i]) == solid; ++i) {
      shell::collect(shell::corners(mesh, triangles[i], frame), window, options.surface_kind,
                     collector);
      collector.compact_if_large();
    }
    collector.finish();
    const auto ends = collector.offsets();
    for (std::uint32_t local = 0; local < VoxelIntervals::kTileColumns; ++local) {
      for (std::uint32_t k = ends[local]; k < ends[local + 1]; ++k) {
        const Interval run = collector.items()[k];
        found.push_back({local, {solid, run.first, run.last}});
      }
    }
  }
  first_face.assign(VoxelIntervals::kTileColumns + 1, 0);
  for (const Found& one : found) ++first_face[one.local + 1];
  for (std::size_t i = 1; i < first_face.size(); ++i) first_face[i] += first_face[i - 1];
  faces.resize(found.size());
  std::vector<std::uint32_t> next(first_face.begin(), first_face.end() - 1);
  for (const Found& one : found) faces[next[one.local]++] = one.run;
}

bool TreeShell::Worker::keep(const TileLists<DepthItem>& lists) {
  offsets.assign(1, 0);
  items.clear();
  for (std::size_t local = 0; local < VoxelIntervals::kTileColumns; ++local) {
    const std::uint32_t begin = first_face[local], end = first_face[local + 1];
    if (begin != end) {
      kept.clear();
      filter->surface(lists, local, std::span(faces).subspan(begin, end - begin), kept);
      for (const VoxelRun run : kept) {
        items.push_back(
            {static_cast<std::uint16_t>(run.first), static_cast<std::uint16_t>(run.last)});
      }
    }
    offsets.push_back(static_cast<std::uint32_t>(items.size()));
  }
  return !items.empty();
}

Result<TreeShell> TreeShell::create(const LatticeMesh& mesh, const VoxelGrid& grid,
                                    const VoxelizeOptions& options, const Execution& execution) {
  TreeShell result;
  result.mesh_ = &mesh;
  result.grid_ = &grid;
  result.options_ = options;
  result.target_ = raster_target(grid, options.axis);
  auto bins = bin_triangles(mesh, result.target_, execution);
  if (!bins) return tl::unexpected(bins.error());
  result.bins_ = std::move(*bins);
  for (int i = 0; i < execution.thread_count(); ++i) {
    result.workers_.push_back(std::make_shared<Worker>(options));
  }
  return result;
}

Result<VoxelIntervals> TreeShell::slab(int v_begin, int v_end, const Execution& execution) {
  try {
    const AxisFrame frame(options_.axis);
    VoxelIntervals slab(*grid_, options_.axis, v_begin, v_end);
    Budget budget(execution.memory_limit);
    const Result<Bins> bins = shell::bin_by_tile(*mesh_, slab, execution, budget);
    if (!bins) return tl::unexpected(bins.error());
    const std::vector<std::uint32_t> no_offsets(kTilePixels + 1, 0);
    TileLists<DepthItem> no_lists;  // of a tile whose pixel centres no triangle covers
    no_lists.offsets = no_offsets.data();
    std::mutex failure_mutex;
    Result<void> status;
    const auto make_tile = [&](std::size_t tile, int worker_index) {
      const std::size_t begin = bins->offsets[tile], end = bins->offsets[tile + 1];
      if (begin == end) return true;
      Worker& worker = *workers_[static_cast<std::size_t>(worker_index)];
      const std::uint64_t held = worker.bytes();
      const int tu = static_cast<int>(tile) % slab.tiles_u();
      const int tv = static_cast<int>(tile) / slab.tiles_u();
      worker.find_faces(*mesh_, std::span(bins->triangles).subspan(begin, end - begin),
                        shell::window_of(slab, tu, tv), frame, options_);
      const int row = v_begin / kTileSide + tv;
      const auto covering = bins_.tile(tu, row);
      TileLists<DepthItem> lists = no_lists;
      if (!covering.empty()) {
        const auto built = worker.builder.build(*mesh_, target_, covering, tu, row);
        if (!built) {
          const std::lock_guard lock(failure_mutex);
          if (status) status = tl::unexpected(built.error());
          return true;
        }
        if (built->fragments > 0) lists = *built;
      }
      if (!worker.keep(lists)) return true;
      slab.set_tile(tu, tv, worker.offsets, worker.items);
      const std::uint64_t now = worker.bytes();
      return budget.add((now > held ? now - held : 0) + worker.items.size() * sizeof(Interval) +
                        worker.offsets.size() * sizeof(std::uint32_t));
    };
    const Result<void> done =
        shell::for_each_tile(execution, bins->offsets.size() - 1, budget.limit(), make_tile);
    if (!status) return tl::unexpected(status.error());
    if (!done) return tl::unexpected(done.error());
    return slab;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "surface voxels: out of memory");
  }
}

}  // namespace strata
