#include "voxelize/volume/tile_runs.h"

#include <algorithm>

namespace strata {

void TileRuns::sort_by_column() {
  offsets_.assign(VoxelIntervals::kTileColumns + 1, 0);
  bool in_order = true;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    ++offsets_[pieces_[i].local + 1u];
    in_order = in_order && (i == 0 || pieces_[i - 1].local <= pieces_[i].local);
  }
  for (std::size_t c = 0; c < VoxelIntervals::kTileColumns; ++c) offsets_[c + 1] += offsets_[c];
  if (in_order) {
    sorted_.swap(pieces_);
    return;
  }
  sorted_.resize(pieces_.size());
  for (const Piece& piece : pieces_) sorted_[offsets_[piece.local]++] = piece;
  for (std::size_t c = VoxelIntervals::kTileColumns; c > 0; --c) offsets_[c] = offsets_[c - 1];
  offsets_[0] = 0;
}

// Makes the pieces of a column disjoint and increasing, voxel by voxel: the last one wins.
void TileRuns::flatten(std::size_t begin, std::size_t end) {
  std::uint16_t lowest = 0xffff, highest = 0;
  for (std::size_t i = begin; i < end; ++i) {
    lowest = std::min(lowest, sorted_[i].first);
    highest = std::max(highest, sorted_[i].last);
  }
  constexpr std::uint64_t kNone = ~std::uint64_t{0};
  std::vector<std::uint64_t> column(static_cast<std::size_t>(highest - lowest) + 1, kNone);
  for (std::size_t i = begin; i < end; ++i) {
    std::fill(column.begin() + (sorted_[i].first - lowest),
              column.begin() + (sorted_[i].last - lowest) + 1, sorted_[i].label);
  }
  for (std::size_t z = 0; z < column.size();) {
    std::size_t past = z + 1;
    while (past < column.size() && column[past] == column[z]) ++past;
    if (column[z] != kNone) {
      items_.push_back(
          {static_cast<std::uint16_t>(lowest + z), static_cast<std::uint16_t>(lowest + past - 1)});
      labels_.push_back(static_cast<std::uint32_t>(column[z]));
    }
    z = past;
  }
}

void TileRuns::take_column(std::size_t begin, std::size_t end, bool labels) {
  bool sorted = true;
  for (std::size_t i = begin + 1; i < end; ++i) {
    sorted = sorted && sorted_[i].first > sorted_[i - 1].last;
  }
  if (!labels && !sorted) {
    for (std::size_t i = begin; i < end; ++i) sorted_[i].label = 1;
  }
  if (!sorted) return flatten(begin, end);
  const std::size_t first = items_.size();
  for (std::size_t i = begin; i < end; ++i) {
    const Piece& piece = sorted_[i];
    const bool goes_on = items_.size() > first && items_.back().end() == piece.first &&
                         (!labels || labels_.back() == piece.label);
    if (goes_on) {
      items_.back().last = piece.last;
      continue;
    }
    items_.push_back({piece.first, piece.last});
    labels_.push_back(piece.label);
  }
}

void TileRuns::store(VoxelIntervals& set, int tu, int tv, bool labels) {
  if (pieces_.empty()) return;
  sort_by_column();
  items_.clear();
  labels_.clear();
  std::uint32_t begin = 0;
  for (std::size_t c = 0; c < VoxelIntervals::kTileColumns; ++c) {
    const std::uint32_t end = offsets_[c + 1];
    offsets_[c] = static_cast<std::uint32_t>(items_.size());
    take_column(begin, end, labels);
    begin = end;
  }
  offsets_[VoxelIntervals::kTileColumns] = static_cast<std::uint32_t>(items_.size());
  if (labels) {
    set.set_tile(tu, tv, offsets_, items_, labels_);
  } else {
    set.set_tile(tu, tv, offsets_, items_);
  }
  pieces_.clear();
  sorted_.clear();
}

}  // namespace strata
