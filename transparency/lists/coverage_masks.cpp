#include <bit>

#include "transparency/lists/blend_list.h"
#include "transparency/lists/list_techniques.h"

// L. Carpenter, "The A-buffer, an antialiased hidden surface method" (1984): the samples of a pixel
// that a triangle covers are one fragment with a mask and a range of depths. Fragments are blended
// front to back, a mask region at a time.
// We differ: where the order of two fragments may change from sample to sample, because surfaces
// cross inside of the pixel, a second geometry pass gets the depth of each sample. (Carpenter
// estimates the visible shares from the ranges.)

namespace strata::transparency {
namespace {

constexpr std::uint32_t kEnd = 0xffffffffu;

/// The samples of a pixel that one triangle covers.
struct MaskFragment {
  std::uint64_t mask = 0;
  std::uint32_t payload = 0;  ///< [exit:1 | triangle:31]
  std::uint32_t nearest = 0, farthest = 0;
  std::uint32_t next = kEnd;
};
static_assert(sizeof(MaskFragment) == 24);

/// A fragment of a sample, for pixels in which surfaces cross.
struct SampleFragment {
  std::uint32_t sample = 0;
  DepthItem item;
};
constexpr std::uint64_t kSampleFragmentBytes = sizeof(std::uint32_t) + sizeof(DepthItem);

/// Samples with the same fragments so far.
struct Region {
  std::uint64_t mask = 0;
  bool empty = true;
  FrontToBack4 sum;
};

class CoverageMasks {
 public:
  Result<void> render(TileStream& stream, TileImage& image) {
    across_ = static_cast<std::uint32_t>(stream.frame().across);
    down_ = static_cast<std::uint32_t>(stream.frame().down);
    heads_.assign(kTilePixels / (across_ * down_), kEnd);
    fragments_.clear();
    Costs& costs = stream.costs();
    stream.pass([this](std::uint32_t sample, DepthItem item) { add(sample, item); });
    costs.stored = costs.kept = fragments_.size();
    costs.merged = stream.size() - fragments_.size();
    crossing_.assign(heads_.size(), 0);
    bool crosses = false;
    for (std::uint32_t pixel = 0; pixel < heads_.size(); ++pixel) {
      if (heads_[pixel] == kEnd) continue;
      gather(pixel);
      costs.most_layers = std::max<std::uint64_t>(costs.most_layers, list_.size());
      if (cross()) {
        crosses = true;
        crossing_[pixel] = 1;
      } else {
        stream.count_shaded(list_.size());
        blend(stream, image, pixel);
      }
    }
    samples_.clear();
    if (crosses) blend_samples(stream, image);
    costs.comparisons += std::exchange(comparisons_, 0);
    const std::uint64_t pixels = stream.pixel_count() / (across_ * down_);
    costs.formula_bytes = costs.allocated_bytes = sizeof(std::uint32_t) * pixels +
                                                  sizeof(MaskFragment) * fragments_.size() +
                                                  kSampleFragmentBytes * samples_.size();
    return {};
  }

 private:
  [[nodiscard]] std::uint32_t pixel_of(std::uint32_t sample) const {
    const std::uint32_t u = sample % kTileSide / across_, v = sample / kTileSide / down_;
    return v * (kTileSide / across_) + u;
  }
  /// Sample `bit` of a pixel.
  [[nodiscard]] std::uint32_t sample_of(std::uint32_t pixel, std::uint32_t bit) const {
    const std::uint32_t columns = kTileSide / across_;
    return (pixel / columns * down_ + bit / across_) * kTileSide + pixel % columns * across_ +
           bit % across_;
  }

  void add(std::uint32_t sample, DepthItem item) {
    std::uint32_t& head = heads_[pixel_of(sample)];
    const std::uint32_t u = sample % kTileSide % across_, v = sample / kTileSide % down_;
    const std::uint64_t bit = std::uint64_t{1} << (v * across_ + u);
    const std::uint32_t depth = item.depth();
    if (across_ * down_ > 1) {
      for (std::uint32_t at = head; at != kEnd; at = fragments_[at].next) {
        MaskFragment& fragment = fragments_[at];
        if (fragment.payload != item.payload() || (fragment.mask & bit) != 0) continue;
        fragment.mask |= bit;
        fragment.nearest = std::min(fragment.nearest, depth);
        fragment.farthest = std::max(fragment.farthest, depth);
        return;
      }
    }
    fragments_.push_back({bit, item.payload(), depth, depth, head});
    head = static_cast<std::uint32_t>(fragments_.size() - 1);
  }

  void gather(std::uint32_t pixel) {
    list_.clear();
    for (std::uint32_t at = heads_[pixel]; at != kEnd; at = fragments_[at].next) {
      list_.push_back(fragments_[at]);
    }
    std::sort(list_.begin(), list_.end(), [this](const MaskFragment& a, const MaskFragment& b) {
      ++comparisons_;
      if (a.nearest != b.nearest) return a.nearest < b.nearest;
      return a.payload != b.payload ? a.payload < b.payload : a.mask < b.mask;
    });
  }
  /// Whether the order of the list may be wrong at a sample.
  [[nodiscard]] bool cross() {
    for (std::size_t i = 0; i < list_.size(); ++i) {
      const MaskFragment& front = list_[i];
      for (std::size_t j = i + 1; j < list_.size(); ++j) {
        const MaskFragment& behind = list_[j];
        ++comparisons_;
        if (behind.nearest > front.farthest) break;
        const bool in_order = behind.nearest == front.farthest && front.payload <= behind.payload;
        if (!in_order && (front.mask & behind.mask) != 0) return true;
      }
    }
    return false;
  }

  void blend(const TileStream& stream, TileImage& image, std::uint32_t pixel) {
    regions_.assign(1, {~std::uint64_t{0}, true, {}});
    for (const MaskFragment& fragment : list_) {
      const glm::vec4& colour =
          stream.colour(DepthItem(std::uint64_t{fragment.nearest} << 32 | fragment.payload));
      for (std::size_t i = 0, count = regions_.size(); i < count; ++i) {
        const std::uint64_t inside = regions_[i].mask & fragment.mask;
        if (inside == 0) continue;
        const std::uint64_t outside = regions_[i].mask & ~fragment.mask;
        if (outside != 0) {
          regions_.push_back(regions_[i]);
          regions_.back().mask = outside;
        }
        regions_[i].mask = inside;
        regions_[i].empty = false;
        regions_[i].sum.add(colour);
      }
    }
    for (const Region& region : regions_) {
      if (region.empty) continue;
      for (std::uint64_t mask = region.mask; mask != 0; mask &= mask - 1) {
        const auto bit = static_cast<std::uint32_t>(std::countr_zero(mask));
        region.sum.write(image.pixels[sample_of(pixel, bit)]);
      }
    }
  }

  /// The pixels in which surfaces cross, sample by sample.
  void blend_samples(TileStream& stream, TileImage& image) {
    stream.pass([this](std::uint32_t sample, DepthItem item) {
      if (crossing_[pixel_of(sample)] != 0) samples_.push_back({sample, item});
    });
    std::sort(samples_.begin(), samples_.end(),
              [this](const SampleFragment& a, const SampleFragment& b) {
                ++comparisons_;
                return a.sample != b.sample ? a.sample < b.sample : a.item < b.item;
              });
    for (std::size_t i = 0; i < samples_.size();) {
      const std::uint32_t sample = samples_[i].sample;
      FrontToBack4 sum;
      for (; i < samples_.size() && samples_[i].sample == sample; ++i) {
        sum.add(stream.colour(samples_[i].item));
      }
      sum.write(image.pixels[sample]);
    }
    stream.count_shaded(samples_.size());
  }

  std::uint32_t across_ = 1, down_ = 1;  ///< samples of a pixel
  std::vector<std::uint32_t> heads_;     ///< of pixels, not of samples
  std::vector<MaskFragment> fragments_, list_;
  std::vector<std::uint8_t> crossing_;
  std::vector<SampleFragment> samples_;
  std::vector<Region> regions_;
  std::uint64_t comparisons_ = 0;
};

Result<TileRenderer> make_coverage_masks(const FrameInfo&, const Settings&,
                                         const std::shared_ptr<const void>&) {
  return renderer_of<CoverageMasks>();
}

}  // namespace

const Technique kCoverageMasks{
    .name = "a-buffer-masks",
    .title = "A-buffer whose fragments are triangles with masks of the samples of a pixel",
    .paper = "Carpenter 1984",
    .memory =
        "24 bytes a triangle's part of a pixel, 4 a pixel; 12 a sample's fragment in pixels "
        "where surfaces cross",
    .fails = "pixels in which surfaces cross need a second geometry pass",
    .make = make_coverage_masks,
};

}  // namespace strata::transparency
