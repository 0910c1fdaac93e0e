#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "transparency/stream/short_sort.h"
#include "transparency/stream/tile_stream.h"

namespace strata::transparency {

/// The sorted depth lists of a tile, exact: count, sum up, store, sort. Keeps its arrays from tile
/// to tile.
class SortedTile {
 public:
  /// Two geometry passes.
  void build(TileStream& stream) {
    store(stream);
    for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
      sort_items(items_.data() + ends_[pixel] - counts_[pixel], items_.data() + ends_[pixel]);
    }
  }
  /// The same, but the lists are in submission order.
  void store(TileStream& stream) {
    counts_.fill(0);
    most_layers_ = 0;
    size_ = 0;
    if (stream.size() == 0) {
      ends_.fill(0);
      stream.count_pass(0);
      return stream.count_pass(0);
    }
    std::uint32_t* counts = counts_.data();
    stream.pass([counts](std::uint32_t pixel, DepthItem) { ++counts[pixel]; });
    std::uint32_t sum = 0;
    for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
      ends_[pixel] = sum;
      sum += counts[pixel];
      most_layers_ = std::max(most_layers_, counts[pixel]);
    }
    if (items_.size() < sum) items_.resize(sum);
    size_ = sum;
    std::uint32_t* ends = ends_.data();
    DepthItem* items = items_.data();
    stream.pass([=](std::uint32_t pixel, DepthItem item) { items[ends[pixel]++] = item; });
  }
  [[nodiscard]] std::uint32_t count(std::uint32_t pixel) const { return counts_[pixel]; }
  [[nodiscard]] std::span<const DepthItem> list(std::uint32_t pixel) const {
    return {items_.data() + begin(pixel), counts_[pixel]};
  }
  /// To be sorted by the caller.
  [[nodiscard]] DepthItem* stored(std::uint32_t pixel) { return items_.data() + begin(pixel); }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] std::uint32_t most_layers() const { return most_layers_; }

 private:
  [[nodiscard]] std::size_t begin(std::uint32_t pixel) const {
    return ends_[pixel] - counts_[pixel];
  }

  /// Of each pixel: the fragments, and the begin of its list, which moves to the end.
  std::array<std::uint32_t, kTilePixels> counts_{}, ends_{};
  std::vector<DepthItem> items_;
  std::size_t size_ = 0;
  std::uint32_t most_layers_ = 0;
};

}  // namespace strata::transparency
