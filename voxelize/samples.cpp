#include "voxelize/samples.h"

#include <algorithm>
#include <vector>

namespace strata {
namespace {

constexpr int kSide = VoxelIntervals::kTileSide;

std::size_t size(int value) { return static_cast<std::size_t>(value); }

/// How many samples are solid in the voxels of a column: a step function along it, kept as the
/// places where it changes. There are few: the columns of its samples are alike.
class ColumnCounts {
 public:
  explicit ColumnCounts(int samples) : samples_(samples) {}

  void clear() { changes_.clear(); }

  /// Adds a column of samples.
  void add(std::span<const Interval> column) {
    last_ = 0;
    for (const Interval& item : column) {
      const int first = item.begin() / samples_, last = (item.end() - 1) / samples_;
      if (first == last) {
        change(first, item.length());
        change(first + 1, -item.length());
        continue;
      }
      const int head = (first + 1) * samples_ - item.begin(), tail = item.end() - last * samples_;
      change(first, head);
      change(first + 1, samples_ - head);
      change(last, tail - samples_);
      change(last + 1, -tail);
    }
  }

  /// Appends intervals, each of one count > 0.
  void emit(std::vector<Interval>& items, std::vector<std::uint32_t>& labels) const {
    int count = 0;
    for (std::size_t i = 0; i < changes_.size(); ++i) {
      if (changes_[i].by == 0) continue;
      if (count > 0) items.back().last = static_cast<std::uint16_t>(changes_[i].at - 1);
      count += changes_[i].by;
      if (count == 0) continue;
      items.push_back({static_cast<std::uint16_t>(changes_[i].at), 0});
      labels.push_back(static_cast<std::uint32_t>(count));
    }
  }

 private:
  struct Change {
    int at = 0, by = 0;
  };

  // The places come in increasing order, but for a step of one, so the search goes on from the
  // last.
  void change(int at, int by) {
    while (last_ > 0 && changes_[last_ - 1].at >= at) --last_;
    while (last_ < changes_.size() && changes_[last_].at < at) ++last_;
    if (last_ == changes_.size() || changes_[last_].at != at) {
      changes_.insert(changes_.begin() + static_cast<std::ptrdiff_t>(last_), {at, 0});
    }
    changes_[last_].by += by;
  }

  int samples_;
  std::vector<Change> changes_;  // in increasing order
  std::size_t last_ = 0;
};

struct Worker {
  ColumnCounts counts;
  std::vector<std::uint32_t> offsets, labels;
  std::vector<Interval> items;
};

/// Whether any tile of samples above a tile of voxels is not empty.
bool any_samples(const VoxelIntervals& fine, int tu, int tv, int samples) {
  for (int v = tv * samples; v < std::min((tv + 1) * samples, fine.tiles_v()); ++v) {
    for (int u = tu * samples; u < std::min((tu + 1) * samples, fine.tiles_u()); ++u) {
      if (!fine.tile_empty(u, v)) return true;
    }
  }
  return false;
}

void count_tile(const VoxelIntervals& fine, int samples, int tu, int tv, Worker& worker,
                VoxelIntervals& result) {
  worker.offsets.assign(1, 0);
  worker.items.clear();
  worker.labels.clear();
  for (int local = 0; local < kSide * kSide; ++local) {
    const int u = tu * kSide + local % kSide;
    const int v = result.v_begin() + tv * kSide + local / kSide;
    if (u < result.columns() && v < result.v_end()) {
      worker.counts.clear();
      for (int row = v * samples; row < (v + 1) * samples; ++row) {
        for (int column = u * samples; column < (u + 1) * samples; ++column) {
          worker.counts.add(fine.column(column, row));
        }
      }
      worker.counts.emit(worker.items, worker.labels);
    }
    worker.offsets.push_back(static_cast<std::uint32_t>(worker.items.size()));
  }
  if (!worker.items.empty()) {
    result.set_tile(tu, tv, worker.offsets, worker.items, worker.labels);
  }
}

}  // namespace

VoxelGrid refined(const VoxelGrid& grid, int samples) {
  VoxelGrid fine = grid;
  fine.dims *= samples;
  fine.voxel_size /= samples;
  return fine;
}

VoxelIntervals count_samples(const VoxelIntervals& fine, const VoxelGrid& grid, int samples,
                             const Execution& execution) {
  VoxelIntervals result(grid, fine.axis(), fine.v_begin() / samples, fine.v_end() / samples);
  std::vector<Worker> workers(size(execution.thread_count()),
                              Worker{ColumnCounts(samples), {}, {}, {}});
  parallel_for(execution, size(result.tiles_u()) * size(result.tiles_v()),
               [&](std::size_t index, int worker) {
                 const int tu = static_cast<int>(index) % result.tiles_u();
                 const int tv = static_cast<int>(index) / result.tiles_u();
                 if (!any_samples(fine, tu, tv, samples)) return;
                 count_tile(fine, samples, tu, tv, workers[size(worker)], result);
               });
  return result;
}

}  // namespace strata
