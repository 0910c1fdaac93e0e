#include "voxelize/output/transposed.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <vector>

namespace strata {
namespace {

constexpr int kTile = VoxelIntervals::kTileSide;
constexpr std::size_t kTileColumns = VoxelIntervals::kTileColumns;

std::size_t size(int value) { return static_cast<std::size_t>(value); }

/// A column of the set as it comes: intervals and labels, or none.
struct ColumnView {
  std::span<const Interval> items;
  std::span<const std::uint32_t> labels;

  [[nodiscard]] std::uint32_t label(std::size_t i) const { return labels.empty() ? 1 : labels[i]; }
  friend bool operator==(const ColumnView& a, const ColumnView& b) {
    return std::ranges::equal(a.items, b.items) && std::ranges::equal(a.labels, b.labels);
  }
};

/// Walks along a column: the label at a place, and up to where it stays.
class Cursor {
 public:
  explicit Cursor(const ColumnView& column) : column_(column) {}
  /// @pre called with increasing places
  std::uint32_t at(int place, int& until) {
    while (next_ < column_.items.size() && column_.items[next_].end() <= place) ++next_;
    if (next_ == column_.items.size()) return 0;
    const Interval& item = column_.items[next_];
    if (item.begin() > place) {
      until = std::min(until, item.begin());
      return 0;
    }
    until = std::min(until, item.end());
    return column_.label(next_);
  }

 private:
  const ColumnView& column_;
  std::size_t next_ = 0;
};

/// One set along another axis, 64 rows of the axis that neither of the two is at a time. Such a
/// block is a row of tiles of the result.
class Transposer {
 public:
  Transposer(const VoxelIntervals& set, VoxelIntervals& result, bool labelled)
      : set_(set),
        result_(result),
        labelled_(labelled),
        from_(static_cast<int>(set.axis())),
        to_(static_cast<int>(result.axis())),
        fixed_(3 - from_ - to_),
        begin_(size(set.grid().dims[from_])) {}

  void block(int index, const Execution& execution) {
    runs_.clear();
    const int first = index * kTile;
    const int last = std::min(first + kTile, set_.grid().dims[fixed_]);
    for (int row = first; row < last; ++row) {
      if (execution.stop.stop_requested()) return;
      sweep(row);
    }
    if (!runs_.empty()) store(index);
  }

 private:
  struct Run {
    std::uint32_t column = 0;  // of the block: tile * kTileColumns + place in the tile
    Interval interval;
    std::uint32_t label = 0;
  };

  [[nodiscard]] ColumnView column(int row, int step) const {
    const AxisFrame frame(set_.axis());
    const int u = frame.u == to_ ? step : row, v = frame.v == to_ ? step : row;
    return {set_.column(u, v), set_.column_labels(u, v)};
  }

  // Steps from column to column along the new axis. A run of it begins or ends where the label of a
  // place changes.
  void sweep(int row) {
    ColumnView before;
    const int steps = set_.grid().dims[to_];
    for (int step = 0; step <= steps; ++step) {
      const ColumnView now = step < steps ? column(row, step) : ColumnView{};
      if (!(before == now)) compare(before, now, row, step);
      before = now;
    }
  }

  void compare(const ColumnView& before, const ColumnView& now, int row, int step) {
    Cursor old_labels(before), new_labels(now);
    const int places = set_.grid().dims[from_];
    for (int place = 0, until; place < places; place = until) {
      until = places;
      const std::uint32_t was = old_labels.at(place, until), is = new_labels.at(place, until);
      if (was == is) continue;
      for (int i = place; i < until; ++i) {
        if (was != 0) {
          runs_.push_back(
              {column_of(row, i), {begin_[size(i)], static_cast<std::uint16_t>(step - 1)}, was});
        }
        begin_[size(i)] = static_cast<std::uint16_t>(step);
      }
    }
  }

  [[nodiscard]] std::uint32_t column_of(int row, int place) const {
    const bool row_is_v = AxisFrame(result_.axis()).v == fixed_;
    const int u = row_is_v ? place : row, v = row_is_v ? row : place;
    return static_cast<std::uint32_t>(size(place / kTile) * kTileColumns +
                                      size(v % kTile * kTile + u % kTile));
  }

  // Sorts the runs by column; those of a column have come in their order.
  void store(int index) {
    const bool row_is_v = AxisFrame(result_.axis()).v == fixed_;
    const int tiles = row_is_v ? result_.tiles_u() : result_.tiles_v();
    ends_.assign(size(tiles) * kTileColumns + 1, 0);
    for (const Run& run : runs_) ++ends_[run.column + 1];
    for (std::size_t i = 1; i < ends_.size(); ++i) ends_[i] += ends_[i - 1];
    items_.resize(runs_.size());
    labels_.resize(labelled_ ? runs_.size() : 0);
    for (const Run& run : runs_) {
      const std::uint32_t at = ends_[run.column]++;  // ends up as the begin of the next column
      items_[at] = run.interval;
      if (labelled_) labels_[at] = run.label;
    }
    std::vector<std::uint32_t> offsets(kTileColumns + 1);
    for (int tile = 0; tile < tiles; ++tile) {
      const std::size_t first = size(tile) * kTileColumns;
      const std::uint32_t begin = first == 0 ? 0 : ends_[first - 1];
      for (std::size_t i = 1; i <= kTileColumns; ++i) offsets[i] = ends_[first + i - 1] - begin;
      const std::size_t count = offsets.back();
      if (count == 0) continue;
      result_.set_tile(
          row_is_v ? tile : index, row_is_v ? index : tile, offsets,
          std::span(items_).subspan(begin, count),
          labelled_ ? std::span(labels_).subspan(begin, count) : std::span<std::uint32_t>());
    }
  }

  const VoxelIntervals& set_;
  VoxelIntervals& result_;
  bool labelled_;
  int from_, to_, fixed_;             // axes
  std::vector<std::uint16_t> begin_;  // by place along the old axis: where its run has begun
  std::vector<Run> runs_;
  std::vector<std::uint32_t> ends_, labels_;
  std::vector<Interval> items_;
};

}  // namespace

VoxelIntervals transposed(const VoxelIntervals& set, Axis axis, const Execution& execution) {
  VoxelIntervals result(set.grid(), axis);
  const AxisFrame frame(axis);
  if (axis == set.axis()) {
    for (int tv = 0; tv < set.tiles_v(); ++tv) {
      for (int tu = 0; tu < set.tiles_u(); ++tu) {
        const auto tile = set.tile(tu, tv);
        if (!tile.items.empty()) result.set_tile(tu, tv, tile.offsets, tile.items, tile.labels);
      }
    }
    return result;
  }
  const bool labelled = set.has_labels();
  const int fixed = 3 - static_cast<int>(axis) - static_cast<int>(set.axis());
  std::vector<std::unique_ptr<Transposer>> workers(size(execution.thread_count()));
  parallel_for(execution, size((set.grid().dims[fixed] + kTile - 1) / kTile),
               [&](std::size_t index, int worker) {
                 auto& transposer = workers[size(worker)];
                 if (!transposer) transposer = std::make_unique<Transposer>(set, result, labelled);
                 transposer->block(static_cast<int>(index), execution);
               });
  return result;
}

}  // namespace strata
