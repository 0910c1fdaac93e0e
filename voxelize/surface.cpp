#include "voxelize/surface.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <new>
#include <span>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "voxelize/surface_overlap.h"

namespace strata {
namespace {

using surface::Range;
using surface::Triangle;
using surface::Window;

constexpr int kSide = VoxelIntervals::kTileSide;
static_assert(kSide == surface::kWindowSide);
constexpr int kTileBits = kLatticeBits + 6;
static_assert(1 << kTileBits == kSide * kLatticeSteps);

// Bytes held by a job, against its limit.
class Budget {
 public:
  explicit Budget(std::uint64_t limit) : limit_(limit) {}
  // False once the limit is passed.
  bool add(std::uint64_t bytes) {
    const std::uint64_t held = held_.fetch_add(bytes, std::memory_order_relaxed) + bytes;
    return limit_ == 0 || held <= limit_;
  }
  void remove(std::uint64_t bytes) { held_.fetch_sub(bytes, std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t limit() const { return limit_; }

 private:
  std::uint64_t limit_;
  std::atomic<std::uint64_t> held_{0};
};

// Runs a body over tiles: progress from the calling thread only, errors as values.
template <class Body>
Result<void> for_each_tile(const Execution& execution, std::size_t count, std::uint64_t limit,
                           Body&& body) {
  const std::thread::id caller = std::this_thread::get_id();
  std::atomic<std::size_t> done{0};
  std::atomic<bool> over{false};
  try {
    parallel_for(execution, count, [&](std::size_t index, int worker) {
      if (over.load(std::memory_order_relaxed)) return;
      if (!body(index, worker)) over.store(true, std::memory_order_relaxed);
      const std::size_t finished = done.fetch_add(1, std::memory_order_relaxed) + 1;
      if (execution.progress && std::this_thread::get_id() == caller) {
        execution.progress(static_cast<double>(finished) / static_cast<double>(count));
      }
    });
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "surface voxels: out of memory");
  } catch (const std::exception& error) {
    // Threads that cannot be started are a limit; oneTBB reports them in words only.
    const bool threads = std::string_view(error.what()).find("pthread_create") != std::string::npos;
    return fail(threads ? ErrorCode::kLimit : ErrorCode::kInternal, "surface voxels: {}",
                error.what());
  }
  if (over) {
    return fail(ErrorCode::kLimit, "surface voxels: more than the memory limit of {} bytes", limit);
  }
  if (execution.stop.stop_requested()) {
    return fail(ErrorCode::kCancelled, "surface voxels: cancelled");
  }
  return {};
}

Triangle corners(const LatticeMesh& mesh, std::size_t index, AxisFrame frame) {
  Triangle triangle;
  for (int i = 0; i < 3; ++i) {
    const glm::ivec3& p = mesh.vertices[mesh.triangles[index][i]];
    triangle[static_cast<std::size_t>(i)] = {p[frame.u], p[frame.v], p[frame.w]};
  }
  return triangle;
}

// The triangles that touch each tile, in compressed sparse rows.
struct Bins {
  std::vector<std::size_t> offsets;
  std::vector<std::uint32_t> triangles;
};

struct Reference {
  std::uint32_t tile, triangle;
};

void bin_triangle(const Triangle& t, std::uint32_t index, const VoxelIntervals& slab, int depth,
                  std::vector<Reference>& out) {
  const Range u = surface::voxel_bounds(t, 0), v = surface::voxel_bounds(t, 1);
  const Range w = surface::voxel_bounds(t, 2);
  if (u.last < 0 || u.first >= slab.columns() || v.last < slab.v_begin() ||
      v.first >= slab.v_end() || w.last < 0 || w.first >= depth) {
    return;
  }
  const int base = slab.v_begin() / kSide;
  const int u0 = std::max(u.first, 0) / kSide;
  const int u1 = std::min(u.last, slab.columns() - 1) / kSide;
  const int v0 = std::max(v.first, slab.v_begin()) / kSide;
  const int v1 = std::min(v.last, slab.v_end() - 1) / kSide;
  // Tiles are cells of a coarser lattice: a large triangle enters only those it touches.
  std::vector<Range> rows;
  if (u0 != u1 && v0 != v1) {
    rows.resize(static_cast<std::size_t>(v1 - v0 + 1));
    surface::strip_ranges(t, 1, 0, kTileBits, v0, v1 + 1, rows.data());
  }
  for (int tv = v0; tv <= v1; ++tv) {
    const Range row = rows.empty() ? Range{u0, u1} : rows[static_cast<std::size_t>(tv - v0)];
    for (int tu = std::max(u0, row.first); tu <= std::min(u1, row.last); ++tu) {
      out.push_back({static_cast<std::uint32_t>((tv - base) * slab.tiles_u() + tu), index});
    }
  }
}

Result<Bins> bin_triangles(const LatticeMesh& mesh, const VoxelIntervals& slab,
                           const Execution& execution, Budget& budget) {
  constexpr std::size_t kChunk = 8192;
  const AxisFrame frame(slab.axis());
  const int depth = slab.grid().dims[frame.w];
  const std::size_t count = mesh.triangles.size();
  std::vector<std::vector<Reference>> chunks((count + kChunk - 1) / kChunk);
  Execution quiet = execution;
  quiet.progress = {};
  const Result<void> binned =
      for_each_tile(quiet, chunks.size(), budget.limit(), [&](std::size_t chunk, int) {
        const std::size_t end = std::min(count, (chunk + 1) * kChunk);
        for (std::size_t i = chunk * kChunk; i < end; ++i) {
          bin_triangle(corners(mesh, i, frame), static_cast<std::uint32_t>(i), slab, depth,
                       chunks[chunk]);
        }
        return budget.add(chunks[chunk].size() * (sizeof(Reference) + sizeof(std::uint32_t)));
      });
  if (!binned) return tl::unexpected(binned.error());

  Bins bins;
  bins.offsets.assign(
      static_cast<std::size_t>(slab.tiles_u()) * static_cast<std::size_t>(slab.tiles_v()) + 1, 0);
  for (const auto& chunk : chunks) {
    for (const Reference& reference : chunk) ++bins.offsets[reference.tile + 1];
  }
  for (std::size_t i = 1; i < bins.offsets.size(); ++i) bins.offsets[i] += bins.offsets[i - 1];
  bins.triangles.resize(bins.offsets.back());
  std::vector<std::size_t> next(bins.offsets.begin(), bins.offsets.end() - 1);
  for (auto& chunk : chunks) {
    for (const Reference& reference : chunk) {
      bins.triangles[next[reference.tile]++] = reference.triangle;
    }
    budget.remove(chunk.size() * sizeof(Reference));
    chunk = {};
  }
  return bins;
}

// Collects the runs of one tile in any order and makes intervals of them.
class RunCollector {
 public:
  void clear() { runs_.clear(), compact_at_ = kCompactAt; }
  void add(int local, int first, int last) {
    runs_.push_back({static_cast<std::uint32_t>(local),
                     {static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(last)}});
  }
  // Keeps memory in bounds when many triangles lie upon each other.
  void compact_if_large() {
    if (runs_.size() < compact_at_) return;
    finish();
    runs_.clear();
    for (std::size_t local = 0; local < VoxelIntervals::kTileColumns; ++local) {
      for (std::uint32_t i = offsets_[local]; i < offsets_[local + 1]; ++i) {
        runs_.push_back({static_cast<std::uint32_t>(local), items_[i]});
      }
    }
    compact_at_ = std::max(kCompactAt, 2 * runs_.size());
  }
  // Sorts by column, unites overlapping and touching runs.
  void finish() {
    constexpr std::size_t kColumns = VoxelIntervals::kTileColumns;
    offsets_.assign(kColumns + 1, 0);
    for (const Run& run : runs_) ++offsets_[run.local + 1];
    for (std::size_t i = 0; i < kColumns; ++i) offsets_[i + 1] += offsets_[i];
    next_.assign(offsets_.begin(), offsets_.end() - 1);
    items_.resize(runs_.size());
    for (const Run& run : runs_) items_[next_[run.local]++] = run.interval;
    std::uint32_t out = 0, begin = 0;
    for (std::size_t local = 0; local < kColumns; ++local) {
      const std::uint32_t end = offsets_[local + 1];
      offsets_[local] = out;
      std::sort(items_.begin() + begin, items_.begin() + end,
                [](Interval a, Interval b) { return a.first < b.first; });
      for (std::uint32_t i = begin; i < end; ++i) {
        if (out > offsets_[local] && items_[i].first <= items_[out - 1].last + 1) {
          items_[out - 1].last = std::max(items_[out - 1].last, items_[i].last);
        } else {
          items_[out++] = items_[i];
        }
      }
      begin = end;
    }
    offsets_[kColumns] = out;
    items_.resize(out);
  }
  [[nodiscard]] std::span<const std::uint32_t> offsets() const { return offsets_; }
  [[nodiscard]] std::span<const Interval> items() const { return items_; }
  [[nodiscard]] std::uint64_t bytes() const {
    return runs_.capacity() * sizeof(Run) + items_.capacity() * sizeof(Interval);
  }

 private:
  static constexpr std::size_t kCompactAt = std::size_t{1} << 20;
  struct Run {
    std::uint32_t local;
    Interval interval;
  };
  std::vector<Run> runs_;
  std::vector<std::uint32_t> offsets_, next_;
  std::vector<Interval> items_;
  std::size_t compact_at_ = kCompactAt;
};

// Adds the voxels of one triangle in the window to the collector.
void collect(const Triangle& triangle, const Window& window, SurfaceKind kind,
             RunCollector& collector) {
  const auto local = [&](int u, int v) {
    return (v - window.v_begin) * kSide + (u - window.u_begin);
  };
  if (kind == SurfaceKind::kConservative) {
    surface::conservative_runs(triangle, window, [&](int u, int v, int first, int last) {
      collector.add(local(u, v), first, last);
    });
    return;
  }
  surface::SegmentTest test(triangle, kind == SurfaceKind::k26);
  surface::conservative_runs(triangle, window, [&](int u, int v, int first, int last) {
    test.runs(u, v, first, last,
              [&](int begin, int end) { collector.add(local(u, v), begin, end); });
  });
}

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

Result<VoxelIntervals> voxelize_surface(const LatticeMesh& mesh, const VoxelGrid& grid,
                                        SurfaceKind kind, Axis axis, int v_begin, int v_end,
                                        const Execution& execution) {
  try {
    const AxisFrame frame(axis);
    VoxelIntervals slab(grid, axis, v_begin, v_end);
    Budget budget(execution.memory_limit);
    const Result<Bins> bins = bin_triangles(mesh, slab, execution, budget);
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
          const Window window{tu * kSide, std::min((tu + 1) * kSide, slab.columns()),
                              v_begin + tv * kSide, std::min(v_begin + (tv + 1) * kSide, v_end),
                              grid.dims[frame.w]};
          for (std::size_t i = bins->offsets[tile]; i < bins->offsets[tile + 1]; ++i) {
            collect(corners(mesh, bins->triangles[i], frame), window, kind, collector);
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
    const Result<void> done = for_each_tile(execution, count, 0, [&](std::size_t tile, int worker) {
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
    });
    if (!done) return tl::unexpected(done.error());
    return result;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "union of voxel sets: out of memory");
  }
}

}  // namespace strata
