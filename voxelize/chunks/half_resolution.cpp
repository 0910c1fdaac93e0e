#include "voxelize/chunks/half_resolution.h"

#include <algorithm>
#include <utility>

namespace strata {
namespace {

constexpr int kTile = VoxelIntervals::kTileSide;

/// The labels along a column, from the left.
class ColumnLabels {
 public:
  ColumnLabels() = default;
  ColumnLabels(const VoxelIntervals& slab, int u, int v, std::uint32_t full)
      : items_(slab.column(u, v)), labels_(slab.column_labels(u, v)), full_(full) {}

  /// The label of voxel x, which does not decrease from call to call.
  std::uint32_t at(int x) {
    while (next_ < items_.size() && items_[next_].end() <= x) ++next_;
    if (next_ == items_.size() || items_[next_].begin() > x) return 0;
    return labels_.empty() ? full_ : labels_[next_];
  }
  /// The first voxel after that of the last call whose label may differ.
  [[nodiscard]] int change(int x, int end) const {
    if (next_ == items_.size()) return end;
    return items_[next_].begin() > x ? items_[next_].begin() : items_[next_].end();
  }

 private:
  std::span<const Interval> items_;
  std::span<const std::uint32_t> labels_;
  std::uint32_t full_ = 1;
  std::size_t next_ = 0;
};

}  // namespace

VoxelGrid HalfResolution::grid_of(VoxelGrid grid) {
  grid.dims = (grid.dims + 1) / 2;
  grid.voxel_size *= 2.0;
  return grid;
}

HalfResolution::HalfResolution(const VoxelGrid& grid, HalfRule rule, std::uint32_t full)
    : rule_(rule), full_(full), set_(grid_of(grid), Axis::kX) {}

std::uint32_t HalfResolution::combine(std::uint32_t (&labels)[8]) const {
  if (rule_ == HalfRule::kSum) {
    std::uint32_t sum = 0;
    for (const std::uint32_t label : labels) sum += label;
    return sum;
  }
  std::sort(std::begin(labels), std::end(labels));
  if (rule_ == HalfRule::kAny) return labels[7] != 0 ? 1 : 0;
  std::uint32_t best = 0;
  int most = 0;
  for (int i = 0; i < 8;) {
    int past = i + 1;
    while (past < 8 && labels[past] == labels[i]) ++past;
    if (labels[i] != 0 && past - i > most) best = labels[i], most = past - i;
    i = past;
  }
  return best;
}

void HalfResolution::merge(const VoxelIntervals& slab, int u, int v, Rows& rows) const {
  ColumnLabels columns[4];
  for (int i = 0; i < 4; ++i) {
    const int at_u = 2 * u + i % 2, at_v = 2 * v + i / 2;
    if (at_u < slab.columns() && at_v < slab.v_end()) {
      columns[i] = ColumnLabels(slab, at_u, at_v, full_);
    }
  }
  const int length = slab.grid().dims.x;
  const std::size_t first = rows.items.size();
  const auto put = [&](int begin, int end, std::uint32_t label) {
    if (label == 0) return;
    const bool joins = rows.items.size() > first && rows.items.back().end() == begin &&
                       rows.labels.back() == label;
    if (joins) {
      rows.items.back().last = static_cast<std::uint16_t>(end - 1);
      return;
    }
    rows.items.push_back({static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(end - 1)});
    rows.labels.push_back(label);
  };
  for (int x = 0; x < length;) {
    std::uint32_t labels[8];
    int change = length;
    for (int i = 0; i < 4; ++i) {
      labels[i] = columns[i].at(x);
      change = std::min(change, columns[i].change(x, length));
    }
    const int cell = x / 2;
    if (change >= x + 2) {  // the same for some cells
      std::copy_n(labels, 4, labels + 4);
      const int past = change / 2;
      put(cell, past, combine(labels));
      x = 2 * past;
      continue;
    }
    for (int i = 0; i < 4; ++i) labels[4 + i] = x + 1 < length ? columns[i].at(x + 1) : 0;
    put(cell, cell + 1, combine(labels));
    x += 2;
  }
}

void HalfResolution::add_row(const VoxelIntervals& slab, int v, int first_u, int last_u,
                             Rows& rows) const {
  for (int u = first_u; u < first_u + kTile; ++u) {
    if (u < last_u) merge(slab, u, v, rows);
    rows.offsets.push_back(static_cast<std::uint32_t>(rows.items.size()));
  }
}

void HalfResolution::add(const VoxelIntervals& slab) {
  const int tiles = set_.tiles_u(), columns = set_.columns();
  if (pending_.empty()) pending_.resize(static_cast<std::size_t>(tiles));
  const int end = (slab.v_end() + 1) / 2;
  for (int v = slab.v_begin() / 2; v < end; ++v) {
    const bool last = v % kTile == kTile - 1 || v + 1 == set_.v_end();
    for (int tu = 0; tu < tiles; ++tu) {
      Rows& rows = pending_[static_cast<std::size_t>(tu)];
      if (rows.offsets.empty()) rows.offsets.push_back(0);
      add_row(slab, v, tu * kTile, std::min(columns, (tu + 1) * kTile), rows);
      if (!last) continue;
      rows.offsets.resize(VoxelIntervals::kTileColumns + 1,
                          static_cast<std::uint32_t>(rows.items.size()));
      if (rule_ == HalfRule::kAny) rows.labels.clear();
      if (!rows.items.empty()) {
        set_.set_tile(tu, v / kTile, rows.offsets, rows.items, rows.labels);
      }
      rows = {};
    }
  }
}

}  // namespace strata
