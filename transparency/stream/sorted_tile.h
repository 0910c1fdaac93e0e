#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "strata/hashbuffer/depth_list_store.h"
#include "transparency/stream/tile_stream.h"

namespace strata::transparency {

/// The sorted depth lists of a tile, exact: count, sum up, store, sort. Keeps its arrays from tile
/// to tile.
class SortedTile {
 public:
  /// Two geometry passes.
  void build(TileStream& stream) {
    ends_.fill(0);
    stream.pass([&](std::uint32_t pixel, DepthItem) { ++ends_[pixel + 1]; });
    std::uint32_t sum = 0;
    most_layers_ = 0;
    for (std::uint32_t& end : ends_) {
      most_layers_ = std::max(most_layers_, end);
      const std::uint32_t count = end;
      end = sum;
      sum += count;
    }
    items_.resize(sum);
    stream.pass([&](std::uint32_t pixel, DepthItem item) { items_[ends_[pixel + 1]++] = item; });
    for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
      detail::sort_list(items_.data() + ends_[pixel], items_.data() + ends_[pixel + 1]);
    }
  }

  /// Front to back.
  [[nodiscard]] std::span<const DepthItem> list(std::uint32_t pixel) const {
    return std::span(items_).subspan(ends_[pixel], ends_[pixel + 1] - ends_[pixel]);
  }
  [[nodiscard]] std::uint64_t size() const { return items_.size(); }
  [[nodiscard]] std::uint32_t most_layers() const { return most_layers_; }

 private:
  /// Element p + 1: the count of pixel p, then the begin of its list, then the end.
  std::array<std::uint32_t, kTilePixels + 1> ends_{};
  std::vector<DepthItem> items_;
  std::uint32_t most_layers_ = 0;
};

}  // namespace strata::transparency
