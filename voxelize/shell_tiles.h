#pragma once

// What makes the surface voxels of one tile. Used by surface.cpp and tree_surface.cpp; not part of
// the library's interface.

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <exception>
#include <new>
#include <span>
#include <string_view>
#include <thread>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/voxelize/intervals.h"
#include "strata/voxelize/voxelize.h"
#include "voxelize/overlap/shell_overlap.h"

namespace strata::shell {

/// Bytes held by a job, against its limit.
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

/// Runs a body over tiles: progress from the calling thread only, errors as values. @param job
/// begins their messages
template <class Body>
Result<void> for_each_tile(const Execution& execution, std::size_t count, std::uint64_t limit,
                           Body&& body, std::string_view job = "surface voxels") {
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
    return fail(ErrorCode::kLimit, "{}: out of memory", job);
  } catch (const std::exception& error) {
    // Threads that cannot be started are a limit; oneTBB reports them in words only.
    const bool threads = std::string_view(error.what()).find("pthread_create") != std::string::npos;
    return fail(threads ? ErrorCode::kLimit : ErrorCode::kInternal, "{}: {}", job, error.what());
  }
  if (over) {
    return fail(ErrorCode::kLimit, "{}: more than the memory limit of {} bytes", job, limit);
  }
  if (execution.stop.stop_requested()) {
    return fail(ErrorCode::kCancelled, "{}: cancelled", job);
  }
  return {};
}

/// A triangle in the frame of the image.
[[nodiscard]] Triangle corners(const LatticeMesh& mesh, std::size_t index, AxisFrame frame);

/// The triangles that touch each tile, in compressed sparse rows.
struct Bins {
  std::vector<std::size_t> offsets;
  std::vector<std::uint32_t> triangles;
};

/// In each tile the triangles come in their order. @param margin  triangles within this many
/// lattice steps of a tile are its own, too, and some others
Result<Bins> bin_by_tile(const LatticeMesh& mesh, const VoxelIntervals& slab,
                         const Execution& execution, Budget& budget, int margin = 0);

/// Collects the runs of one tile in any order and makes intervals of them.
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
  void finish();
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

/// The columns of tile (tu, tv) of a slab.
[[nodiscard]] Window window_of(const VoxelIntervals& slab, int tu, int tv);

/// Adds the voxels of one triangle in the window to the collector.
void collect(const Triangle& triangle, const Window& window, SurfaceKind kind,
             RunCollector& collector);

}  // namespace strata::shell
