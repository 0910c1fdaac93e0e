#include <algorithm>
#include <vector>

#include "transparency/stream/tile_stream.h"
#include "transparency/sums/distances.h"
#include "transparency/sums/sum_techniques.h"

// M. McGuire, L. Bavoil, "Weighted blended order-independent transparency" (2013): the weighted
// average of all colours, nearer ones with more weight, and the exact transmittance. The weights
// are equations 7 to 10 of the paper, which wants distances of 0.1 to 500: here the view's nearest
// and farthest distance. Equation 10 takes the depth of the depth buffer, and spreads its weights
// over the whole view: it is the default.

namespace strata::transparency {
namespace {

float cube(float x) { return x * x * x; }

/// Equations 7 to 9. @param z  distance
struct Equation7 {
  static float of(float z) {
    return 10.0f / (1e-5f + z * z / 25.0f + cube(z / 200.0f) * cube(z / 200.0f));
  }
};
struct Equation8 {
  static float of(float z) {
    return 10.0f / (1e-5f + cube(z / 10.0f) + cube(z / 200.0f) * cube(z / 200.0f));
  }
};
struct Equation9 {
  static float of(float z) { return 0.03f / (1e-5f + cube(z / 200.0f) * (z / 200.0f)); }
};

template <class Equation>
struct ByDistance {
  Distances distances;
  float operator()(DepthItem item) const {
    const float z = 0.1f + 499.9f * distances.linear(item);
    return std::max(1e-2f, std::min(3e3f, Equation::of(z)));
  }
};
struct ByDepth {
  float operator()(DepthItem item) const {
    return std::max(1e-2f, 3e3f * cube(1.0f - Distances::depth(item)));
  }
};

template <class Weight>
TileRenderer renderer_weighted_blended(const Weight& weight) {
  return [weight, sums = std::make_shared<std::vector<glm::vec4>>(kTilePixels)](
             TileStream& stream, TileImage& image) -> Result<void> {
    for_each_pixel(stream, [&](std::uint32_t pixel) { (*sums)[pixel] = glm::vec4(0.0f); });
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const glm::vec4& fragment = stream.shade(item);
      (*sums)[pixel] += fragment * (fragment.a * weight(item));
      image.pixels[pixel].a *= 1.0f - fragment.a;
    });
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      const glm::vec4& sum = (*sums)[pixel];
      if (sum.a <= 0.0f) return;
      const float through = image.pixels[pixel].a;
      image.pixels[pixel] = {glm::vec3(sum) * ((1.0f - through) / sum.a), through};
    });
    Costs& costs = stream.costs();
    costs.stored = costs.merged = stream.size();
    costs.formula_bytes = costs.allocated_bytes =
        (sizeof(glm::vec4) + sizeof(float)) * stream.pixel_count();
    return {};
  };
}

Result<TileRenderer> make_weighted_blended(const FrameInfo& frame, const Settings& settings,
                                           const std::shared_ptr<const void>&) {
  const Distances distances(frame);
  if (settings.variant == "equation-7")
    return renderer_weighted_blended(ByDistance<Equation7>{distances});
  if (settings.variant == "equation-8")
    return renderer_weighted_blended(ByDistance<Equation8>{distances});
  if (settings.variant == "equation-9")
    return renderer_weighted_blended(ByDistance<Equation9>{distances});
  return renderer_weighted_blended(ByDepth());
}

}  // namespace

const Technique kWeightedBlended{
    .name = "weighted-blended",
    .title = "Weighted blended: an average with weights by depth",
    .paper = "McGuire, Bavoil 2013",
    .accuracy = Accuracy::kBounded,
    .variants = "equation-10 equation-7 equation-8 equation-9",
    .memory = "20 bytes a pixel",
    .fails = "where layers of unlike colours have high opacity: what lies behind shines through",
    .make = make_weighted_blended,
};

}  // namespace strata::transparency
