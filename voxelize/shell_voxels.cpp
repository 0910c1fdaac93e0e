#include "voxelize/shell_voxels.h"

#include <algorithm>
#include <new>
#include <span>
#include <vector>

#include "voxelize/shell_tiles.h"

namespace strata {
namespace {

using shell::Bins;
using shell::Budget;
using shell::for_each_tile;
using shell::RunCollector;

constexpr int kSide = VoxelIntervals::kTileSide;

// Copies one column's intervals.
void append(std::span<const Interval> column, std::vector<Interval>& items) {
  items.insert(items.end(), column.begin(), column.end());
}

void append_union(std::span<const Interval> a, std::span<const Interval> b,
                  std::vector<Interval>& items) {
  const std::size_t start = items.size();
  while (!a.empty() || !b.empty()) {
    const bool take_a = b.empty() || (!a.empty() && a.front().first <= b.front().first);
    auto& source = take_a ? a : b;
    const Interval next = source.front();
    source = source.subspan(1);
    if (items.size() > start && next.first <= items.back().last + 1) {
      items.back().last = std::max(items.back().last, next.last);
    } else {
      items.push_back(next);
    }
  }
}

}  // namespace

Result<VoxelIntervals> voxelize_shell(const LatticeMesh& mesh, const VoxelGrid& grid,
                                      SurfaceKind kind, Axis axis, int v_begin, int v_end,
                                      const Execution& execution) {
  try {
    const AxisFrame frame(axis);
    VoxelIntervals slab(grid, axis, v_begin, v_end);
    Budget budget(execution.memory_limit);
    const Result<Bins> bins = shell::bin_by_tile(mesh, slab, execution, budget);
    if (!bins) return tl::unexpected(bins.error());

    std::vector<RunCollector> collectors(static_cast<std::size_t>(execution.thread_count()));
    const Result<void> done = for_each_tile(
        execution, bins->offsets.size() - 1, budget.limit(), [&](std::size_t tile, int worker) {
          if (bins->offsets[tile] == bins->offsets[tile + 1]) return true;
          RunCollector& collector = collectors[static_cast<std::size_t>(worker)];
          const std::uint64_t held = collector.bytes();
          collector.clear();
          const int tu = static_cast<int>(tile) % slab.tiles_u();
          const int tv = static_cast<int>(tile) / slab.tiles_u();
          const shell::Window window = shell::window_of(slab, tu, tv);
          for (std::size_t i = bins->offsets[tile]; i < bins->offsets[tile + 1]; ++i) {
            collect(shell::corners(mesh, bins->triangles[i], frame), window, kind, collector);
            collector.compact_if_large();
          }
          collector.finish();
          if (!collector.items().empty()) {
            slab.set_tile(tu, tv, collector.offsets(), collector.items());
          }
          return budget.add(collector.bytes() - held + collector.items().size_bytes() +
                            collector.offsets().size_bytes());
        });
    if (!done) return tl::unexpected(done.error());
    return slab;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "surface voxels: out of memory");
  }
}

Result<VoxelIntervals> union_intervals(const VoxelIntervals& a, const VoxelIntervals& b,
                                       const Execution& execution) {
  if (a.grid() != b.grid() || a.axis() != b.axis() || a.v_begin() != b.v_begin() ||
      a.v_end() != b.v_end()) {
    return fail(ErrorCode::kUsage, "union of voxel sets on different grids, axes or rows");
  }
  try {
    VoxelIntervals result(a.grid(), a.axis(), a.v_begin(), a.v_end());
    struct Scratch {
      std::vector<std::uint32_t> offsets;
      std::vector<Interval> items;
    };
    std::vector<Scratch> scratch(static_cast<std::size_t>(execution.thread_count()));
    const std::size_t count =
        static_cast<std::size_t>(a.tiles_u()) * static_cast<std::size_t>(a.tiles_v());
    const auto unite = [&](std::size_t tile, int worker) {
      const int tu = static_cast<int>(tile) % a.tiles_u();
      const int tv = static_cast<int>(tile) / a.tiles_u();
      if (a.tile_empty(tu, tv) && b.tile_empty(tu, tv)) return true;
      auto& [offsets, items] = scratch[static_cast<std::size_t>(worker)];
      offsets.assign(1, 0);
      items.clear();
      for (int local = 0; local < kSide * kSide; ++local) {
        const int u = tu * kSide + local % kSide, v = a.v_begin() + tv * kSide + local / kSide;
        if (u < a.columns() && v < a.v_end()) {
          const auto column_a = a.column(u, v), column_b = b.column(u, v);
          if (column_a.empty() || column_b.empty()) {
            append(column_a.empty() ? column_b : column_a, items);
          } else {
            append_union(column_a, column_b, items);
          }
        }
        offsets.push_back(static_cast<std::uint32_t>(items.size()));
      }
      result.set_tile(tu, tv, offsets, items);
      return true;
    };
    const Result<void> done = for_each_tile(execution, count, 0, unite, "union of voxel sets");
    if (!done) return tl::unexpected(done.error());
    return result;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "union of voxel sets: out of memory");
  }
}

}  // namespace strata
