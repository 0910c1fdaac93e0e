#include <array>
#include <limits>

#include "transparency/peeling/peeling_techniques.h"
#include "transparency/stream/tile_stream.h"

// C. Everitt, "Interactive order-independent transparency" (2001): each geometry pass keeps the
// nearest fragment of a pixel behind the one that the pass before kept, and blends it from the
// front. We compare (depth, exit, triangle) and count equal fragments, so that coplanar ones stay.
// A pixel whose transmittance is exactly 0 is finished: what lies behind adds exactly nothing.

namespace strata::transparency {
namespace {

/// Two depth keys, the layer's colour and the sum of all layers.
constexpr std::uint64_t kPixelBytes = 2 * 8 + 2 * 16;
constexpr std::uint64_t kFinished = std::numeric_limits<std::uint64_t>::max();

class DepthPeeler {
 public:
  explicit DepthPeeler(unsigned most_passes)
      : most_passes_(most_passes == 0 ? kMostPasses : most_passes) {}

  void render(TileStream& stream, TileImage& image) {
    Costs& costs = stream.costs();
    costs.formula_bytes = costs.allocated_bytes = kPixelBytes * stream.pixel_count();
    if (stream.size() == 0) return;
    begin_.fill(0);
    sum_.fill({});
    layers_.fill(0);
    for (bool more = true; more && stream.passes() < most_passes_;) {
      const std::uint64_t behind = find(stream);
      const std::uint64_t peeled = blend(stream);
      costs.comparisons += stream.size() + behind;
      costs.stored += peeled;
      more = left_ > 0;
    }
    costs.kept = costs.stored;
    costs.lost = left_;
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (layers_[pixel] == 0) return;
      costs.most_layers = std::max<std::uint64_t>(costs.most_layers, layers_[pixel]);
      image.pixels[pixel] = sum_[pixel].result();
    });
  }

 private:
  /// The nearest fragment of each pixel behind those peeled. @return how many lie behind
  std::uint64_t find(TileStream& stream) {
    nearest_.fill(kFinished);
    equal_.fill(0);
    behind_.fill(0);
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      if (item.bits < begin_[pixel]) return;
      ++behind_[pixel];
      if (item.bits < nearest_[pixel]) {
        nearest_[pixel] = item.bits;
        equal_[pixel] = 1;
      } else if (item.bits == nearest_[pixel]) {
        ++equal_[pixel];
      }
    });
    std::uint64_t sum = 0;
    for (const std::uint32_t count : behind_) sum += count;
    return sum;
  }
  /// Blends what was found. @return fragments blended
  std::uint64_t blend(TileStream& stream) {
    std::uint64_t peeled = 0;
    left_ = 0;
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (equal_[pixel] == 0) return;
      const DepthItem item(nearest_[pixel]);
      const glm::vec4& colour = stream.shade(item);
      for (std::uint32_t i = 0; i < equal_[pixel]; ++i) sum_[pixel].add(colour);
      peeled += equal_[pixel];
      layers_[pixel] += equal_[pixel];
      const bool saturated = sum_[pixel].transmittance == 0.0f;
      begin_[pixel] = saturated ? kFinished : item.bits + 1;
      if (!saturated) left_ += behind_[pixel] - equal_[pixel];
    });
    return peeled;
  }

  unsigned most_passes_;
  std::uint64_t left_ = 0;  ///< fragments that are still to be peeled
  std::array<std::uint64_t, kTilePixels> begin_, nearest_;
  std::array<std::uint32_t, kTilePixels> equal_, behind_, layers_;
  std::array<FrontToBack, kTilePixels> sum_;
};

Result<TileRenderer> make_depth_peeling(const FrameInfo&, const Settings& settings,
                                        const std::shared_ptr<const void>&) {
  return renderer_of<DepthPeeler>(settings.k);
}

}  // namespace

const Technique kDepthPeeling{
    .name = "depth-peeling",
    .title = "Depth peeling, front to back",
    .paper = "Everitt 2001",
    .k_means = "passes",
    .least_k = 1,
    .most_k = kMostPasses,
    .memory = "48 bytes a pixel",
    .fails = "a geometry pass for each layer; fewer passes than layers lose the farthest layers",
    .make = make_depth_peeling,
};

}  // namespace strata::transparency
