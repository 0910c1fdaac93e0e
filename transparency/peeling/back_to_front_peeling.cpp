#include <array>

#include "transparency/peeling/peeling_techniques.h"
#include "transparency/stream/tile_stream.h"

// A. Mammen, "Transparency and antialiasing algorithms implemented with the virtual pixel maps
// technique" (1989): after the opaque objects, each geometry pass finds the farthest fragment of a
// pixel that lies before the one blended last, and blends it over what is there; the pass that
// changes no pixel is the last. Reverse depth peeling (N. Thibieroz 2008) is the same with one
// colour target less: it blends in place, and a query tells that no layer is left. We compare
// (depth, exit, triangle) and count equal fragments, so that coplanar ones stay.

namespace strata::transparency {
namespace {

/// How the two differ.
struct Kind {
  std::uint64_t pixel_bytes;
  bool ends_unchanged;  ///< the last pass finds nothing
};
/// Two depth keys and two colours; two depth keys and one colour.
constexpr Kind kMaps{2 * 8 + 2 * 16, true}, kReverse{2 * 8 + 16, false};

class BackPeeler {
 public:
  BackPeeler(const Kind& kind, unsigned most_passes)
      : kind_(kind), most_passes_(most_passes == 0 ? kMostPasses : most_passes) {}

  void render(TileStream& stream, TileImage& image) {
    Costs& costs = stream.costs();
    costs.formula_bytes = costs.allocated_bytes = kind_.pixel_bytes * stream.pixel_count();
    if (stream.size() == 0) return;
    for_each_pixel(stream, [&](std::uint32_t pixel) { end_[pixel] = stream.opaque(pixel).bits; });
    sum_.fill({});
    layers_.fill(0);
    std::uint64_t left = stream.size();
    for (bool more = true; more && stream.passes() < most_passes_;) {
      const std::uint64_t before = find(stream), peeled = blend(stream);
      costs.comparisons += stream.size() + before;
      costs.stored += peeled;
      left -= peeled;
      more = kind_.ends_unchanged ? peeled > 0 : left > 0;
    }
    costs.kept = costs.stored;
    costs.lost = left;
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (layers_[pixel] == 0) return;
      costs.most_layers = std::max<std::uint64_t>(costs.most_layers, layers_[pixel]);
      image.pixels[pixel] = sum_[pixel].result();
    });
  }

 private:
  /// The farthest fragment of each pixel before those blended. @return how many lie before
  std::uint64_t find(TileStream& stream) {
    farthest_.fill(0);
    equal_.fill(0);
    std::uint64_t before = 0;
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      if (item.bits >= end_[pixel]) return;
      ++before;
      if (item.bits > farthest_[pixel] || equal_[pixel] == 0) {
        farthest_[pixel] = item.bits;
        equal_[pixel] = 1;
      } else if (item.bits == farthest_[pixel]) {
        ++equal_[pixel];
      }
    });
    return before;
  }
  /// Blends what was found. @return fragments blended
  std::uint64_t blend(TileStream& stream) {
    std::uint64_t peeled = 0;
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (equal_[pixel] == 0) return;
      const glm::vec4& colour = stream.shade(DepthItem(farthest_[pixel]));
      for (std::uint32_t i = 0; i < equal_[pixel]; ++i) sum_[pixel].add(colour);
      peeled += equal_[pixel];
      layers_[pixel] += equal_[pixel];
      end_[pixel] = farthest_[pixel];
    });
    return peeled;
  }

  Kind kind_;
  unsigned most_passes_;
  std::array<std::uint64_t, kTilePixels> end_, farthest_;
  std::array<std::uint32_t, kTilePixels> equal_, layers_;
  std::array<BackToFront, kTilePixels> sum_;
};

template <const Kind& kind>
Result<TileRenderer> make_back_to_front_peeling(const FrameInfo&, const Settings& settings,
                                                const std::shared_ptr<const void>&) {
  return renderer_of<BackPeeler>(kind, settings.k);
}

}  // namespace

const Technique kVirtualPixelMaps{
    .name = "virtual-pixel-maps",
    .title = "Virtual pixel maps: peeling from back to front",
    .paper = "Mammen 1989",
    .blending = Blending::kBackToFront,
    .k_means = "passes",
    .least_k = 1,
    .most_k = kMostPasses,
    .memory = "48 bytes a pixel",
    .fails = "a geometry pass for each layer and one more; fewer passes lose the nearest layers",
    .make = make_back_to_front_peeling<kMaps>,
};

const Technique kReversePeeling{
    .name = "reverse-peeling",
    .title = "Reverse depth peeling: from back to front, blended in place",
    .paper = "Thibieroz 2008",
    .blending = Blending::kBackToFront,
    .k_means = "passes",
    .least_k = 1,
    .most_k = kMostPasses,
    .memory = "32 bytes a pixel",
    .fails = "a geometry pass for each layer; fewer passes lose the nearest layers",
    .make = make_back_to_front_peeling<kReverse>,
};

}  // namespace strata::transparency
