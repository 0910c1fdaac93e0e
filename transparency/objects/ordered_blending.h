#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "transparency/stream/ordered_replay.h"
#include "transparency/stream/tile_stream.h"

namespace strata::transparency {

/// Draws tiles in an order, each fragment over what is there.
class OrderedBlending {
 public:
  static constexpr std::uint64_t kPixelBytes = 16;

  /// @param rank  of a fragment (pixel, item); the least is drawn first
  /// @param order_bytes  of the order, for the whole picture
  template <class Rank>
  void render(TileStream& stream, TileImage& image, std::uint64_t order_bytes, Rank&& rank) {
    Costs& costs = stream.costs();
    costs.formula_bytes = kPixelBytes * stream.pixel_count();
    if (is_first_tile(stream)) costs.formula_bytes += order_bytes;
    costs.allocated_bytes = costs.formula_bytes;
    layers_.fill(0);
    replay_.pass(stream, rank, [&](std::uint32_t pixel, DepthItem item) {
      const glm::vec4& colour = stream.shade(item);
      glm::vec4& sum = image.pixels[pixel];
      const float through = 1.0f - colour.a;
      sum = glm::vec4(glm::vec3(colour) + through * glm::vec3(sum), sum.a * through);
      ++layers_[pixel];
    });
    costs.most_layers = *std::max_element(layers_.begin(), layers_.end());
  }

 private:
  OrderedReplay replay_;
  std::array<std::uint32_t, kTilePixels> layers_;
};

}  // namespace strata::transparency
