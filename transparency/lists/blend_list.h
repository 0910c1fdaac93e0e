#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "transparency/stream/tile_stream.h"

// What techniques do with the fragments of a pixel that they gathered.

namespace strata::transparency {

/// Sorts a list front to back: by insertion if it is short. @return comparisons
inline std::uint64_t sort_counted(DepthItem* begin, DepthItem* end) {
  constexpr std::ptrdiff_t kInsertionSortLimit = 32;
  std::uint64_t comparisons = 0;
  if (end - begin > kInsertionSortLimit) {
    std::sort(begin, end, [&comparisons](DepthItem a, DepthItem b) {
      ++comparisons;
      return a < b;
    });
    return comparisons;
  }
  for (DepthItem* next = begin; next != end; ++next) {
    const DepthItem item = *next;
    DepthItem* place = next;
    for (; place != begin && item < place[-1]; --place) *place = place[-1];
    comparisons += static_cast<std::uint64_t>(next - place) + (place != begin ? 1 : 0);
    *place = item;
  }
  return comparisons;
}

/// A sorted list, front to back.
inline glm::vec4 blend_sorted(TileStream& stream, std::span<const DepthItem> list) {
  FrontToBack sum;
  for (const DepthItem item : list) sum.add(stream.colour(item));
  stream.count_shaded(list.size());
  return sum.result();
}

/// Sorts and blends the lists of a tile's pixels, one after the other.
class ListBlender {
 public:
  /// The list of the next pixel, empty.
  std::vector<DepthItem>& begin() {
    list_.clear();
    return list_;
  }
  /// Writes the pixel, and counts what that costs.
  void finish(TileStream& stream, TileImage& image, std::uint32_t pixel) {
    if (list_.empty()) return;
    Costs& costs = stream.costs();
    costs.comparisons += sort_counted(list_.data(), list_.data() + list_.size());
    costs.most_layers = std::max<std::uint64_t>(costs.most_layers, list_.size());
    costs.kept += list_.size();
    image.pixels[pixel] = blend_sorted(stream, list_);
  }

 private:
  std::vector<DepthItem> list_;
};

}  // namespace strata::transparency
