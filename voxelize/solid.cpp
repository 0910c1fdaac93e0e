#include "voxelize/solid.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <optional>
#include <type_traits>
#include <utility>

#include "strata/hashbuffer/build_ldi.h"
#include "voxelize/coverage.h"

namespace strata {
namespace {

/// The lists of a tile without crossings.
template <class Key>
TileLists<Key> no_lists() {
  static constexpr std::uint32_t kNone[kTilePixels + 1] = {};
  TileLists<Key> lists;
  lists.offsets = kNone;
  return lists;
}

double milliseconds_between(std::chrono::steady_clock::time_point from,
                            std::chrono::steady_clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

}  // namespace

/// Where the tiles of rows [v_begin, v_end) go.
struct SolidVoxelizer::Output {
  int v_begin = 0, v_end = 0;
  VoxelIntervals* intervals = nullptr;
  CoverageTiles* coverage = nullptr;  ///< or there

  [[nodiscard]] int tile_row(int tv) const { return tv - v_begin / kTileSide; }
};

struct SolidVoxelizer::Worker {
  Worker(const VoxelizeOptions& options, const TileListFilter* filters, int length)
      : keys({.store = options.store, .offsets = options.offsets}),
        items({.store = options.store, .offsets = options.offsets}),
        filter(filters != nullptr ? filters->worker() : nullptr) {
    if (options.rays > 0) coverage.emplace(options.rays, length / options.rays);
  }
  KeyTileBuilder keys;
  ItemTileBuilder items;
  std::unique_ptr<TileListFilter::Worker> filter;
  TileLists<DepthItem> filtered;
  TileCutter cutter;
  TileIntervals intervals;
  std::optional<CoverageWalker> coverage;
  WindingField::Scratch winding;
  VoxelizeReport report;
};

Result<SolidVoxelizer> SolidVoxelizer::create(const LatticeMesh& mesh, const VoxelGrid& grid,
                                              Axis axis, const VoxelizeOptions& options,
                                              const Execution& execution,
                                              const WindingField* field) {
  SolidVoxelizer result;
  result.mesh_ = &mesh;
  result.grid_ = &grid;
  result.field_ = field;
  result.options_ = options;
  result.target_ = raster_target(grid, axis);
  const TileListFilter* filter = options.filter;
  if (options.source != nullptr) {
    if (auto set = options.source->set_mesh(mesh); !set) return tl::unexpected(set.error());
    if (filter != nullptr && options.source->use_filter(*filter)) filter = nullptr;
  }
  const int length = grid.dims[AxisFrame(axis).w];
  for (int i = 0; i < execution.thread_count(); ++i) {
    result.workers_.push_back(std::make_shared<Worker>(options, filter, length));
  }
  return result;
}

Result<void> SolidVoxelizer::prepare(int v_begin, int v_end, const Execution& execution) {
  if (options_.source != nullptr) return {};
  auto bins = bin_triangles(*mesh_, target_, {v_begin, v_end}, execution);
  if (!bins) return tl::unexpected(bins.error());
  bins_ = std::move(*bins);
  return {};
}

template <class Builder>
Result<void> SolidVoxelizer::run_tile(Builder& builder, Worker& worker, int tu, int tv, Output& out,
                                      const Execution& execution) const {
  using Key = typename Builder::Key;
  const auto triangles = bins_.tile(tu, tv);
  if (triangles.empty()) {
    if (field_ != nullptr) walk(no_lists<Key>(), worker, tu, tv, out, execution);
    return {};
  }
  const auto start = std::chrono::steady_clock::now();
  const auto lists = builder.build(*mesh_, target_, triangles, tu, tv);
  if (!lists) return tl::unexpected(lists.error());
  const auto built = std::chrono::steady_clock::now();
  worker.report.lists_ms += milliseconds_between(start, built);
  walk(lists->fragments > 0 ? *lists : no_lists<Key>(), worker, tu, tv, out, execution);
  worker.report.intervals_ms += milliseconds_between(built, std::chrono::steady_clock::now());
  return {};
}

/// Lists to intervals, or to the filled part of voxels.
template <class Key>
void SolidVoxelizer::walk(const TileLists<Key>& lists, Worker& worker, int tu, int tv, Output& out,
                          const Execution& execution) const {
  TileIntervals& tile = worker.intervals;
  std::span<const WindingStep> steps;
  if (field_ != nullptr) {
    steps = field_->steps(target_.axis, tu, tv, execution.stop, worker.winding);
  }
  if (lists.fragments == 0 && steps.empty()) return;
  const bool statistics = options_.statistics;
  // Without a worker the lists have gone through the filter already.
  const TileLists<Key>* filtered = &lists;
  if constexpr (std::is_same_v<Key, DepthItem>) {
    if (worker.filter) filtered = &(worker.filtered = worker.filter->apply(lists));
  }
  if (out.coverage == nullptr || !steps.empty()) {
    if constexpr (std::is_same_v<Key, DepthItem>) {
      if (options_.filter != nullptr && options_.filter->labelled()) {
        walk_labelled_tile(*filtered, statistics, tile);
      } else {
        walk_tile(*filtered, options_.rule, statistics, tile);
      }
    } else {
      walk_tile(*filtered, options_.rule, statistics, tile);
    }
    if (!steps.empty()) add_winding_steps(lists, options_.rule, steps, tile);
  }
  if (out.coverage != nullptr) {
    TileCounts counted;
    worker.coverage->walk(*filtered, options_.rule, statistics, steps, tile,
                          steps.empty() ? tile.counts : counted,
                          out.coverage->piece(tu, out.tile_row(tv)));
  } else if (tile.offsets.back() > 0) {
    out.intervals->set_tile(tu, out.tile_row(tv), tile.offsets,
                            std::span<const Interval>(tile.items).first(tile.offsets.back()),
                            tile.labels);
  }
  VoxelizeReport& report = worker.report;
  if (options_.source == nullptr) report.crossings += lists.fragments;
  report.unbalanced_columns += tile.counts.unbalanced;
  report.negative_columns += tile.counts.negative;
  report.max_depth_complexity = std::max(report.max_depth_complexity, tile.counts.max_depth);
  for (std::size_t i = 0; i < report.depth_histogram.size(); ++i) {
    report.depth_histogram[i] += tile.counts.histogram[i];
  }
}

/// All tiles of a slab from the lists of a source, some rows of tiles after another.
Result<void> SolidVoxelizer::run_source(const Execution& execution, Output& out) const {
  const int tiles_u = (target_.width + kTileSide - 1) / kTileSide;
  const int v_end = out.v_end, step = options_.source->rows_at_once(target_);
  for (int v = out.v_begin; v < v_end; v += step) {
    const auto start = std::chrono::steady_clock::now();
    const int end = std::min(v_end, v + step);
    const auto rows = options_.source->lists(target_, v, end);
    if (!rows) return tl::unexpected(rows.error());
    workers_.front()->report.crossings += options_.source->crossings();
    // Time of this thread alone, where the others' is divided by their number.
    workers_.front()->report.lists_ms +=
        milliseconds_between(start, std::chrono::steady_clock::now()) *
        static_cast<double>(workers_.size());
    const int tiles_v = (end - v + kTileSide - 1) / kTileSide;
    parallel_for(execution, static_cast<std::size_t>(tiles_u * tiles_v),
                 [&](std::size_t index, int worker_index) {
                   Worker& worker = *workers_[static_cast<std::size_t>(worker_index)];
                   const int tu = static_cast<int>(index) % tiles_u;
                   const int tv = v / kTileSide + static_cast<int>(index) / tiles_u;
                   const auto begin = std::chrono::steady_clock::now();
                   const auto lists = worker.cutter.cut(*rows, v, tu, tv);
                   walk(lists, worker, tu, tv, out, execution);
                   worker.report.intervals_ms +=
                       milliseconds_between(begin, std::chrono::steady_clock::now());
                 });
    if (execution.stop.stop_requested()) break;
  }
  return {};
}

Result<VoxelIntervals> SolidVoxelizer::slab(int v_begin, int v_end, const Execution& execution,
                                            VoxelizeReport& report) {
  VoxelIntervals result(*grid_, target_.axis, v_begin, v_end, std::move(spent_));
  Output out{v_begin, v_end, &result, nullptr};
  if (auto done = run(out, execution, report); !done) return tl::unexpected(done.error());
  return result;
}

Result<VoxelIntervals> SolidVoxelizer::covered_slab(const VoxelGrid& voxels, int v_begin, int v_end,
                                                    const Execution& execution,
                                                    VoxelizeReport& report) {
  CoverageTiles tiles(voxels, target_.axis, options_.rays, v_begin, v_end);
  Output out{v_begin, v_end, nullptr, &tiles};
  if (auto done = run(out, execution, report); !done) return tl::unexpected(done.error());
  return tiles.merged(execution, report.filled_steps);
}

Result<void> SolidVoxelizer::run(Output& out, const Execution& execution, VoxelizeReport& report) {
  const int first_tile_row = out.v_begin / kTileSide;
  const int tiles_u = (target_.width + kTileSide - 1) / kTileSide;
  const int tiles_v = (out.v_end - out.v_begin + kTileSide - 1) / kTileSide;
  const auto tiles = static_cast<std::size_t>(tiles_u) * static_cast<std::size_t>(tiles_v);
  std::mutex failure_mutex;
  Result<void> status;
  for (auto& worker : workers_) worker->report = {};
  if (options_.source != nullptr) status = run_source(execution, out);
  const std::size_t own_tiles = options_.source != nullptr ? 0 : tiles;
  parallel_for(execution, own_tiles, [&](std::size_t index, int worker_index) {
    Worker& worker = *workers_[static_cast<std::size_t>(worker_index)];
    const int tu = static_cast<int>(index) % tiles_u;
    const int tv = static_cast<int>(index) / tiles_u + first_tile_row;
    const auto done = target_.depth_limit <= kMaxDepthKeyLimit && options_.filter == nullptr
                          ? run_tile(worker.keys, worker, tu, tv, out, execution)
                          : run_tile(worker.items, worker, tu, tv, out, execution);
    if (!done) {
      const std::lock_guard lock(failure_mutex);
      if (status) status = done;
    }
  });
  if (!status) return status;
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  const auto used = static_cast<double>(workers_.size());
  for (const auto& worker : workers_) {
    const VoxelizeReport& part = worker->report;
    report.crossings += part.crossings;
    report.unbalanced_columns += part.unbalanced_columns;
    report.negative_columns += part.negative_columns;
    report.max_depth_complexity = std::max(report.max_depth_complexity, part.max_depth_complexity);
    for (std::size_t i = 0; i < report.depth_histogram.size(); ++i) {
      report.depth_histogram[i] += part.depth_histogram[i];
    }
    report.lists_ms += part.lists_ms / used;
    report.intervals_ms += part.intervals_ms / used;
  }
  report.rebuilt_tiles = 0;
  for (const auto& worker : workers_) {
    report.rebuilt_tiles += worker->keys.rebuilt_tiles() + worker->items.rebuilt_tiles();
  }
  return {};
}

}  // namespace strata
