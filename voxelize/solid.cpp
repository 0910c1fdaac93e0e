#include "voxelize/solid.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <utility>

#include "strata/hashbuffer/build_ldi.h"

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

struct SolidVoxelizer::Worker {
  Worker(const VoxelizeOptions& options, const TileListFilter* filters)
      : keys({.store = options.store, .offsets = options.offsets}),
        items({.store = options.store, .offsets = options.offsets}),
        filter(filters != nullptr ? filters->worker() : nullptr) {}
  KeyTileBuilder keys;
  ItemTileBuilder items;
  std::unique_ptr<TileListFilter::Worker> filter;
  TileCutter cutter;
  TileIntervals intervals;
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
  } else {
    auto bins = bin_triangles(mesh, result.target_, execution);
    if (!bins) return tl::unexpected(bins.error());
    result.bins_ = std::move(*bins);
  }
  for (int i = 0; i < execution.thread_count(); ++i) {
    result.workers_.push_back(std::make_shared<Worker>(options, filter));
  }
  return result;
}

template <class Builder>
Result<void> SolidVoxelizer::run_tile(Builder& builder, Worker& worker, int tu, int tv, int v_begin,
                                      VoxelIntervals& out, const Execution& execution) const {
  using Key = typename Builder::Key;
  const auto triangles = bins_.tile(tu, tv);
  if (triangles.empty()) {
    if (field_ != nullptr) walk(no_lists<Key>(), worker, tu, tv, v_begin, out, execution);
    return {};
  }
  const auto start = std::chrono::steady_clock::now();
  const auto lists = builder.build(*mesh_, target_, triangles, tu, tv);
  if (!lists) return tl::unexpected(lists.error());
  const auto built = std::chrono::steady_clock::now();
  worker.report.lists_ms += milliseconds_between(start, built);
  walk(lists->fragments > 0 ? *lists : no_lists<Key>(), worker, tu, tv, v_begin, out, execution);
  worker.report.intervals_ms += milliseconds_between(built, std::chrono::steady_clock::now());
  return {};
}

/// Lists to intervals.
template <class Key>
void SolidVoxelizer::walk(const TileLists<Key>& lists, Worker& worker, int tu, int tv, int v_begin,
                          VoxelIntervals& out, const Execution& execution) const {
  TileIntervals& tile = worker.intervals;
  std::span<const WindingStep> steps;
  if (field_ != nullptr) {
    steps = field_->steps(target_.axis, tu, tv, execution.stop, worker.winding);
  }
  if (lists.fragments == 0 && steps.empty()) return;
  if constexpr (std::is_same_v<Key, DepthItem>) {
    // Without a worker the lists have gone through the filter already.
    const auto& filtered = worker.filter ? worker.filter->apply(lists) : lists;
    if (options_.filter != nullptr && options_.filter->labelled()) {
      walk_labelled_tile(filtered, options_.statistics, tile);
    } else {
      walk_tile(filtered, options_.rule, options_.statistics, tile);
    }
  } else {
    walk_tile(lists, options_.rule, options_.statistics, tile);
  }
  if (!steps.empty()) add_winding_steps(lists, options_.rule, steps, tile);
  if (tile.offsets.back() > 0) {
    out.set_tile(tu, tv - v_begin / kTileSide, tile.offsets,
                 std::span<const Interval>(tile.items).first(tile.offsets.back()), tile.labels);
  }
  VoxelizeReport& report = worker.report;
  if (options_.source == nullptr) report.crossings += lists.fragments;
  report.unbalanced_columns += tile.unbalanced;
  report.negative_columns += tile.negative;
  report.max_depth_complexity = std::max(report.max_depth_complexity, tile.max_depth);
  for (std::size_t i = 0; i < report.depth_histogram.size(); ++i) {
    report.depth_histogram[i] += tile.histogram[i];
  }
}

/// All tiles of a slab from the lists of a source, some rows of tiles after another.
Result<void> SolidVoxelizer::run_source(int v_begin, const Execution& execution,
                                        VoxelIntervals& out) const {
  const int v_end = out.v_end(), step = options_.source->rows_at_once(target_);
  for (int v = v_begin; v < v_end; v += step) {
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
    parallel_for(execution, static_cast<std::size_t>(out.tiles_u() * tiles_v),
                 [&](std::size_t index, int worker_index) {
                   Worker& worker = *workers_[static_cast<std::size_t>(worker_index)];
                   const int tu = static_cast<int>(index) % out.tiles_u();
                   const int tv = v / kTileSide + static_cast<int>(index) / out.tiles_u();
                   const auto begin = std::chrono::steady_clock::now();
                   const auto lists = worker.cutter.cut(*rows, v, tu, tv);
                   walk(lists, worker, tu, tv, v_begin, out, execution);
                   worker.report.intervals_ms +=
                       milliseconds_between(begin, std::chrono::steady_clock::now());
                 });
    if (execution.stop.stop_requested()) break;
  }
  return {};
}

Result<VoxelIntervals> SolidVoxelizer::slab(int v_begin, int v_end, const Execution& execution,
                                            VoxelizeReport& report) {
  VoxelIntervals result(*grid_, target_.axis, v_begin, v_end);
  const int first_tile_row = v_begin / kTileSide;
  const auto tiles =
      static_cast<std::size_t>(result.tiles_u()) * static_cast<std::size_t>(result.tiles_v());
  std::mutex failure_mutex;
  Result<void> status;
  for (auto& worker : workers_) worker->report = {};
  if (options_.source != nullptr) status = run_source(v_begin, execution, result);
  const std::size_t own_tiles = options_.source != nullptr ? 0 : tiles;
  parallel_for(execution, own_tiles, [&](std::size_t index, int worker_index) {
    Worker& worker = *workers_[static_cast<std::size_t>(worker_index)];
    const int tu = static_cast<int>(index) % result.tiles_u();
    const int tv = static_cast<int>(index) / result.tiles_u() + first_tile_row;
    const auto done = target_.depth_limit <= kMaxDepthKeyLimit && options_.filter == nullptr
                          ? run_tile(worker.keys, worker, tu, tv, v_begin, result, execution)
                          : run_tile(worker.items, worker, tu, tv, v_begin, result, execution);
    if (!done) {
      const std::lock_guard lock(failure_mutex);
      if (status) status = done;
    }
  });
  if (!status) return tl::unexpected(status.error());
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
  return result;
}

}  // namespace strata
