#include <algorithm>
#include <bit>
#include <vector>

#include "transparency/stream/tile_stream.h"
#include "transparency/sums/seeded_random.h"
#include "transparency/sums/sum_techniques.h"

// E. Enderton, E. Sintorn, P. Shirley, D. Luebke, "Stochastic transparency" (2010): a fragment
// covers a random subset of a pixel's samples, as large as its opacity says, and each sample keeps
// its nearest fragment. Variants:
//   basic            the mean of the samples
//   alpha-corrected  scaled to the exact opacity, which a pass of its own gives
//   depth-based      the samples give the visibility of a depth; a further pass adds up all
//                    fragments by it; scaled to the exact opacity
// We differ: samples keep which fragment they see, and its colour is looked up at the end; a pixel
// whose fragments cover no sample shows the nearest one when it is alpha-corrected.

namespace strata::transparency {
namespace {

constexpr DepthItem kNothing = TileFragments::kNothing;

/// A random subset of `most` samples, as bits: each size next to opacity * most by its share, all
/// subsets of a size alike (R. Floyd's algorithm).
std::uint64_t random_samples(float opacity, unsigned most, SeededRandom random) {
  const double wanted = static_cast<double>(opacity) * most + random.unit();
  const unsigned size = std::min(most, static_cast<unsigned>(wanted));
  std::uint64_t samples = 0;
  for (unsigned last = most - size; last < most; ++last) {
    const unsigned sample = random.below(last + 1);
    samples |= std::uint64_t{1} << ((samples >> sample & 1) == 0 ? sample : last);
  }
  return samples;
}

class Stochastic {
 public:
  explicit Stochastic(const Settings& settings)
      : count_(settings.k),
        seed_(settings.seed),
        corrected_(settings.variant == "alpha-corrected"),
        depth_based_(settings.variant == "depth-based"),
        samples_(kTilePixels * std::size_t{count_}),
        arrived_(kTilePixels),
        nearest_(corrected_ ? kTilePixels : 0),
        weights_(depth_based_ ? kTilePixels : 0) {}

  void render(TileStream& stream, TileImage& image) {
    std::fill(samples_.begin(), samples_.end(), kNothing);
    std::fill(arrived_.begin(), arrived_.end(), 0u);
    std::fill(nearest_.begin(), nearest_.end(), kNothing);
    std::fill(weights_.begin(), weights_.end(), 0.0f);
    if (corrected_) {
      stream.pass([&](std::uint32_t pixel, DepthItem item) {
        image.pixels[pixel].a *= 1.0f - stream.opacity(item);
        if (stream.opacity(item) > 0.0f) nearest_[pixel] = std::min(nearest_[pixel], item);
      });
    }
    draw_samples(stream, image);
    if (depth_based_) {
      sum_visible(stream, image);
    } else {
      for_each_pixel(stream, [&](std::uint32_t pixel) { resolve(stream, image, pixel); });
    }
    Costs& costs = stream.costs();
    costs.formula_bytes = costs.allocated_bytes =
        (sizeof(DepthItem) * count_ + sizeof(std::uint32_t) +
         (corrected_     ? sizeof(DepthItem)
          : depth_based_ ? sizeof(float)
                         : 0)) *
        stream.pixel_count();
  }

 private:
  void draw_samples(TileStream& stream, TileImage& image) {
    std::uint64_t stored = 0, missed = 0;
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const float opacity = stream.opacity(item);
      if (depth_based_) image.pixels[pixel].a *= 1.0f - opacity;
      const auto u = static_cast<std::uint64_t>(stream.rect().u0) + pixel % kTileSide;
      const auto v = static_cast<std::uint64_t>(stream.rect().v0) + pixel / kTileSide;
      // By its turn and not by what it is: equal fragments cover samples of their own.
      std::uint64_t samples =
          random_samples(opacity, count_, {seed_, v << 32 | u, arrived_[pixel]++});
      missed += samples == 0 ? 1 : 0;
      DepthItem* own = samples_.data() + std::size_t{pixel} * count_;
      for (; samples != 0; samples &= samples - 1) {
        DepthItem& sample = own[std::countr_zero(samples)];
        sample = std::min(sample, item);
        ++stored;
      }
    });
    stream.costs().stored = stored;
    stream.costs().comparisons = stored;
    stream.costs().lost = depth_based_ ? 0 : missed;
  }

  void resolve(TileStream& stream, TileImage& image, std::uint32_t pixel) {
    if (arrived_[pixel] == 0) return;
    glm::vec3 sum(0.0f);
    unsigned covered = 0;
    const DepthItem* own = samples_.data() + std::size_t{pixel} * count_;
    for (unsigned i = 0; i < count_; ++i) {
      if (own[i] == kNothing) continue;
      const glm::vec4& fragment = stream.shade(own[i]);
      sum += glm::vec3(fragment) / fragment.a;
      ++covered;
    }
    glm::vec4& out = image.pixels[pixel];
    if (!corrected_) {
      const auto all = static_cast<float>(count_);
      out = {sum / all, static_cast<float>(count_ - covered) / all};
      return;
    }
    if (covered == 0 && nearest_[pixel] != kNothing) {
      const glm::vec4& fragment = stream.shade(nearest_[pixel]);
      sum = glm::vec3(fragment) / fragment.a;
      covered = 1;
    }
    if (covered > 0) out = {sum * ((1.0f - out.a) / static_cast<float>(covered)), out.a};
  }

  void sum_visible(TileStream& stream, TileImage& image) {
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const DepthItem* own = samples_.data() + std::size_t{pixel} * count_;
      unsigned seen = 0;
      for (unsigned i = 0; i < count_; ++i) seen += own[i].depth() >= item.depth() ? 1 : 0;
      if (seen == 0) return;
      const float visible = static_cast<float>(seen) / static_cast<float>(count_);
      const glm::vec4& fragment = stream.shade(item);
      image.pixels[pixel] += glm::vec4(visible * glm::vec3(fragment), 0.0f);
      weights_[pixel] += visible * fragment.a;
    });
    stream.costs().comparisons += std::uint64_t{count_} * stream.size();
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (weights_[pixel] <= 0.0f) return;
      glm::vec4& out = image.pixels[pixel];
      out = {glm::vec3(out) * ((1.0f - out.a) / weights_[pixel]), out.a};
    });
  }

  unsigned count_;
  std::uint64_t seed_;
  bool corrected_, depth_based_;
  std::vector<DepthItem> samples_;      ///< the nearest fragment of each
  std::vector<std::uint32_t> arrived_;  ///< fragments of each pixel so far
  std::vector<DepthItem> nearest_;
  std::vector<float> weights_;
};

Result<TileRenderer> make_stochastic(const FrameInfo&, const Settings& settings,
                                     const std::shared_ptr<const void>&) {
  return renderer_of<Stochastic>(settings);
}

}  // namespace

const Technique kStochastic{
    .name = "stochastic",
    .title = "Stochastic transparency: random samples",
    .paper = "Enderton, Sintorn, Shirley, Luebke 2010",
    .accuracy = Accuracy::kRandom,
    .k_means = "samples",
    .default_k = 8,
    .least_k = 1,
    .most_k = 64,
    .variants = "basic alpha-corrected depth-based",
    .memory = "8 bytes a sample and 4 more, a pixel; 8 more if alpha-corrected, 4 if depth-based",
    .fails = "noise, which falls with the root of the samples",
    .make = make_stochastic,
};

}  // namespace strata::transparency
