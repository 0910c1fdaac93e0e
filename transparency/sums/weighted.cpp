#include <cmath>
#include <vector>

#include "transparency/stream/tile_stream.h"
#include "transparency/sums/sum_techniques.h"

// Blending without an order. H. Meshkin, "Sort-independent alpha blending" (2007): a weighted sum.
// L. Bavoil, K. Myers, "Order independent transparency with dual depth peeling" (2008): a weighted
// average. Fragments of opacity 0 are left out: the average would count them.

namespace strata::transparency {
namespace {

void count_costs(TileStream& stream, std::uint64_t added, std::uint64_t pixel_bytes) {
  Costs& costs = stream.costs();
  costs.stored = costs.merged = added;
  costs.formula_bytes = costs.allocated_bytes = pixel_bytes * stream.pixel_count();
}

Result<TileRenderer> make_sum(const FrameInfo&, const Settings&,
                              const std::shared_ptr<const void>&) {
  return [](TileStream& stream, TileImage& image) -> Result<void> {
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const glm::vec4& fragment = stream.shade(item);
      image.pixels[pixel] += glm::vec4(glm::vec3(fragment), -fragment.a);
    });
    count_costs(stream, stream.size(), sizeof(glm::vec4));
    return {};
  };
}

struct AverageSums {
  glm::vec4 sum{0.0f};  ///< of premultiplied colours, and of opacities
  std::uint32_t count = 0;
};

Result<TileRenderer> make_average(const FrameInfo&, const Settings&,
                                  const std::shared_ptr<const void>&) {
  return [all = std::make_shared<std::vector<AverageSums>>(kTilePixels)](
             TileStream& stream, TileImage& image) -> Result<void> {
    for_each_pixel(stream, [&](std::uint32_t pixel) { (*all)[pixel] = AverageSums(); });
    std::uint64_t added = 0;
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const glm::vec4& fragment = stream.shade(item);
      if (fragment.a == 0.0f) return;
      ++added;
      AverageSums& sums = (*all)[pixel];
      sums.sum += fragment;
      ++sums.count;
    });
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      const AverageSums& sums = (*all)[pixel];
      if (sums.count == 0) return;
      const auto n = static_cast<float>(sums.count);
      const float through = std::pow(std::max(0.0f, 1.0f - sums.sum.a / n), n);
      image.pixels[pixel] = {glm::vec3(sums.sum) * ((1.0f - through) / sums.sum.a), through};
    });
    count_costs(stream, added, sizeof(AverageSums));
    return {};
  };
}

}  // namespace

const Technique kWeightedSum{
    .name = "weighted-sum",
    .title = "Weighted sum",
    .paper = "Meshkin 2007",
    .accuracy = Accuracy::kBounded,
    .memory = "16 bytes a pixel",
    .fails =
        "where the opacities of a pixel add up to more than 1: the background's weight is "
        "negative",
    .make = make_sum,
};

const Technique kWeightedAverage{
    .name = "weighted-average",
    .title = "Weighted average",
    .paper = "Bavoil, Myers 2008",
    .accuracy = Accuracy::kBounded,
    .memory = "20 bytes a pixel",
    .fails = "where the fragments of a pixel differ in colour or opacity: their order is not known",
    .make = make_average,
};

}  // namespace strata::transparency
