#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "transparency/stream/lanes.h"
#include "transparency/stream/short_sort.h"
#include "transparency/stream/tile_stream.h"

// What techniques do with the fragments of a pixel that they gathered.

namespace strata::transparency {

/// The same numbers as FrontToBack, all channels at once.
class FrontToBack4 {
 public:
  void add(const glm::vec4& fragment) {
    const Lanes c = load_lanes(fragment);
    colour_ += transmittance_ * c;
    transmittance_ *= 1.0f - last_lane(c);
  }
  void write(glm::vec4& pixel) const { store_lanes(with_last(colour_, transmittance_), pixel); }

 private:
  Lanes colour_{};
  Lanes transmittance_{1.0f, 1.0f, 1.0f, 1.0f};
};

/// Sorts and blends a list. @return comparisons
inline std::uint64_t blend_list(const TileStream& stream, DepthItem* list, std::size_t count,
                                glm::vec4& pixel) {
  FrontToBack4 sum;
  const glm::vec4* colours = stream.frame().colours.data();
  const std::uint64_t comparisons =
      visit_sorted(list, count, [&](DepthItem item) { sum.add(colours[face_of(item)]); });
  sum.write(pixel);
  return comparisons;
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
    costs.most_layers = std::max<std::uint64_t>(costs.most_layers, list_.size());
    costs.kept += list_.size();
    stream.count_shaded(list_.size());
    costs.comparisons += blend_list(stream, list_.data(), list_.size(), image.pixels[pixel]);
  }

 private:
  std::vector<DepthItem> list_;
};

}  // namespace strata::transparency
