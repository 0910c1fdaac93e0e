#include <algorithm>
#include <cmath>
#include <vector>

#include "transparency/stream/tile_stream.h"
#include "transparency/sums/distances.h"
#include "transparency/sums/power_moments.h"
#include "transparency/sums/sum_techniques.h"

// Moment-based order-independent transparency, see power_moments.h: a pass adds up the moments of
// the absorbance over the logarithm of the distance, a second one the colours, by the transmittance
// that the moments give. The sum is normalized to the exact opacity. We differ: the exact
// transmittance is multiplied up in the second pass, so that opacity 1 is exact.

namespace strata::transparency {
namespace {

/// What a fragment absorbs is cut off here, as in the paper.
constexpr float kMostAbsorbance = 10.0f;
/// So that something is left to normalize.
constexpr double kMostInFront = 80.0;

template <std::size_t kHalf>
class MomentSums {
 public:
  explicit MomentSums(const FrameInfo& frame)
      : distances_(frame), moments_(kTilePixels), weights_(kTilePixels) {}

  void render(TileStream& stream, TileImage& image) {
    for_each_pixel(stream, [&](std::uint32_t pixel) { moments_[pixel].fill(0.0f); });
    std::fill(weights_.begin(), weights_.end(), 0.0f);
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const float opacity = stream.opacity(item);
      float power =
          opacity < 1.0f ? std::min(kMostAbsorbance, -std::log1p(-opacity)) : kMostAbsorbance;
      const float depth = distances_.logarithmic(item);
      for (float& moment : moments_[pixel]) {
        moment += power;
        power *= depth;
      }
    });
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const glm::vec4& fragment = stream.shade(item);
      if (fragment.a == 0.0f) return;
      const auto& moments = moments_[pixel];
      const double share = PowerMoments<kHalf>(moments.data())
                               .share_before(static_cast<double>(distances_.logarithmic(item)));
      const auto visible = static_cast<float>(
          std::exp(-std::min(kMostInFront, static_cast<double>(moments[0]) * share)));
      glm::vec4& out = image.pixels[pixel];
      out = {glm::vec3(out) + visible * glm::vec3(fragment), out.a * (1.0f - fragment.a)};
      weights_[pixel] += visible * fragment.a;
    });
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (weights_[pixel] <= 0.0f) return;
      glm::vec4& out = image.pixels[pixel];
      out = {glm::vec3(out) * ((1.0f - out.a) / weights_[pixel]), out.a};
    });
    Costs& costs = stream.costs();
    costs.stored = costs.merged = stream.size();
    costs.formula_bytes = costs.allocated_bytes =
        sizeof(float) * (PowerMoments<kHalf>::kCount + 1) * stream.pixel_count();
  }

 private:
  Distances distances_;
  std::vector<std::array<float, PowerMoments<kHalf>::kCount>> moments_;
  std::vector<float> weights_;
};

template <std::size_t kHalf>
TileRenderer renderer(const FrameInfo& frame) {
  return renderer_of<MomentSums<kHalf>>(frame);
}

Result<TileRenderer> make_moments(const FrameInfo& frame, const Settings& settings,
                                  const std::shared_ptr<const void>&) {
  switch (settings.k) {
    case 4:
      return renderer<2>(frame);
    case 6:
      return renderer<3>(frame);
    case 8:
      return renderer<4>(frame);
    default:
      return fail(ErrorCode::kUsage, "moments: the moments must be 4, 6 or 8, got {}", settings.k);
  }
}

}  // namespace

const Technique kMoments{
    .name = "moments",
    .title = "Moment-based transparency: power moments",
    .paper = "Muenstermann, Krumpen, Klein, Peters 2018",
    .accuracy = Accuracy::kBounded,
    .k_means = "moments",
    .default_k = 4,
    .least_k = 4,
    .most_k = 8,
    .memory = "4 bytes a moment and 8 more, a pixel",
    .fails = "where opacity rises in more steps than half the moments: they are smoothed",
    .make = make_moments,
};

}  // namespace strata::transparency
