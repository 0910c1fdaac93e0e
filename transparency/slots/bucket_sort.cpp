#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <vector>

#include "transparency/slots/slot_techniques.h"
#include "transparency/stream/tile_stream.h"

// F. Liu, M.-C. Huang, X.-H. Liu, E.-H. Wu, "Efficient depth peeling via bucket sort" (2009): a
// pixel's range of depths is divided into K buckets, as many as the channels of eight targets, and
// MIN blending keeps the nearest fragment of each; buckets are in order as they are. The adaptive
// form first marks the occupied of about 1024 bins, and gives each its own bucket while there are
// enough. The papers draw a bounding box to learn the range; we draw the scene.
// Where fragments meet in a bucket, the papers lose all but the nearest; the survey by Maule et al.
// (2011) merges them: the newcomer lies before or behind all that came earlier.

namespace strata::transparency {
namespace {

constexpr unsigned kMostBuckets = 32, kBins = 1024, kWords = kBins / 64;
constexpr std::uint64_t kBucketBytes = 8, kMergedBytes = 16, kRangeBytes = 8;
constexpr std::uint64_t kEmpty = std::numeric_limits<std::uint64_t>::max();

struct Range {
  std::uint32_t low = std::numeric_limits<std::uint32_t>::max(), high = 0;

  void include(std::uint32_t depth) {
    low = std::min(low, depth);
    high = std::max(high, depth);
  }
  /// Which of `parts` equal parts holds the depth.
  [[nodiscard]] unsigned part(std::uint32_t depth, unsigned parts) const {
    if (high == low) return 0;
    return std::min(parts - 1,
                    static_cast<unsigned>(std::uint64_t{parts} * (depth - low) / (high - low)));
  }
};

class Buckets {
 public:
  Buckets(unsigned k, bool adaptive, bool merge)
      : k_(k),
        bins_(kBins / k * k),
        adaptive_(adaptive),
        merge_(merge),
        nearest_(std::size_t{k} * kTilePixels) {
    if (merge) merged_.resize(nearest_.size());
    if (adaptive) occupied_.resize(kTilePixels);
  }

  void render(TileStream& stream, TileImage& image) {
    Costs& costs = stream.costs();
    const std::uint64_t bucket_bytes = kBucketBytes + (merge_ ? kMergedBytes : 0);
    costs.formula_bytes = costs.allocated_bytes =
        (bucket_bytes * k_ + kRangeBytes + (adaptive_ ? kBins / 8 : 0)) * stream.pixel_count();
    if (stream.size() == 0) return;
    ranges_.fill({});
    stream.pass([&](std::uint32_t pixel, DepthItem item) { ranges_[pixel].include(item.depth()); });
    if (adaptive_) mark(stream);
    std::fill_n(nearest_.begin(),
                std::size_t{k_} * kTileSide * static_cast<std::size_t>(stream.height()), kEmpty);
    if (merge_) {
      stream.pass([&](std::uint32_t pixel, DepthItem item) { put_merged(stream, pixel, item); });
    } else {
      stream.pass([&](std::uint32_t pixel, DepthItem item) {
        std::uint64_t& nearest = nearest_[bucket(pixel, item)];
        nearest = std::min(nearest, item.bits);
      });
    }
    for_each_pixel(stream, [&](std::uint32_t pixel) { blend(stream, pixel, image); });
    costs.stored = costs.comparisons = stream.size();
    (merge_ ? costs.merged : costs.lost) = stream.size() - costs.kept;
  }

 private:
  /// The bins of each pixel that hold a depth.
  void mark(TileStream& stream) {
    for_each_pixel(stream, [&](std::uint32_t pixel) { occupied_[pixel].fill(0); });
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const unsigned bin = ranges_[pixel].part(item.depth(), bins_);
      occupied_[pixel][bin / 64] |= std::uint64_t{1} << bin % 64;
    });
  }
  [[nodiscard]] std::size_t bucket(std::uint32_t pixel, DepthItem item) const {
    const std::size_t first = std::size_t{pixel} * k_;
    if (!adaptive_) return first + ranges_[pixel].part(item.depth(), k_);
    const unsigned bin = ranges_[pixel].part(item.depth(), bins_);
    unsigned before = 0, all = 0;
    for (unsigned word = 0; word < kWords; ++word) {
      const std::uint64_t bits = occupied_[pixel][word];
      all += static_cast<unsigned>(std::popcount(bits));
      if (word < bin / 64) before += static_cast<unsigned>(std::popcount(bits));
    }
    before += static_cast<unsigned>(
        std::popcount(occupied_[pixel][bin / 64] & ((std::uint64_t{1} << bin % 64) - 1)));
    return first + (all <= k_ ? before : before * k_ / all);
  }
  void put_merged(TileStream& stream, std::uint32_t pixel, DepthItem item) {
    const std::size_t at = bucket(pixel, item);
    const glm::vec4& colour = stream.shade(item);
    FrontToBack& there = merged_[at];
    if (nearest_[at] == kEmpty) there = {};
    if (item.bits < nearest_[at]) {
      nearest_[at] = item.bits;
      const FrontToBack behind = there;
      there = {};
      there.add(colour);
      there.colour += there.transmittance * behind.colour;
      there.transmittance *= behind.transmittance;
    } else {
      there.add(colour);
    }
  }
  void blend(TileStream& stream, std::uint32_t pixel, TileImage& image) {
    const std::size_t first = std::size_t{pixel} * k_;
    FrontToBack sum;
    std::uint64_t layers = 0;
    for (std::size_t at = first; at < first + k_; ++at) {
      if (nearest_[at] == kEmpty) continue;
      ++layers;
      if (merge_) {
        sum.colour += sum.transmittance * merged_[at].colour;
        sum.transmittance *= merged_[at].transmittance;
      } else {
        sum.add(stream.shade(DepthItem(nearest_[at])));
      }
    }
    if (layers == 0) return;
    stream.costs().kept += layers;
    stream.costs().most_layers = std::max(stream.costs().most_layers, layers);
    image.pixels[pixel] = sum.result();
  }

  unsigned k_, bins_;
  bool adaptive_, merge_;
  std::array<Range, kTilePixels> ranges_;
  std::vector<std::uint64_t> nearest_;                       ///< of each bucket, k a pixel
  std::vector<FrontToBack> merged_;                          ///< the same
  std::vector<std::array<std::uint64_t, kWords>> occupied_;  ///< a bit a bin
};

template <bool adaptive>
Result<TileRenderer> make(const FrameInfo&, const Settings& settings,
                          const std::shared_ptr<const void>&) {
  return [buckets = std::make_shared<Buckets>(settings.k, adaptive, settings.variant == "merge")](
             TileStream& stream, TileImage& image) -> Result<void> {
    buckets->render(stream, image);
    return {};
  };
}

}  // namespace

const Technique kBucketSort{
    .name = "bucket-sort",
    .title = "Bucket sort with equal buckets",
    .paper = "Liu, Huang, Liu, Wu 2009; merging: Maule, Comba, Torchelsen, Bastos 2011",
    .accuracy = Accuracy::kBounded,
    .k_means = "buckets",
    .default_k = kMostBuckets,
    .least_k = 1,
    .most_k = kMostBuckets,
    .variants = "lose merge",
    .memory = "8 bytes a bucket (merge: 24), 8 a pixel",
    .fails =
        "fragments that meet in a bucket: all but the nearest are lost, or merged as they come",
    .make = make<false>,
};

const Technique kAdaptiveBucketSort{
    .name = "adaptive-bucket-sort",
    .title = "Bucket sort, buckets by a histogram of depths",
    .paper = "Liu, Huang, Liu, Wu 2009; merging: Maule, Comba, Torchelsen, Bastos 2011",
    .accuracy = Accuracy::kBounded,
    .k_means = "buckets",
    .default_k = kMostBuckets,
    .least_k = 1,
    .most_k = kMostBuckets,
    .variants = "lose merge",
    .memory = "8 bytes a bucket (merge: 24), 136 a pixel",
    .fails = "fragments of one bin, 1/1024 of a pixel's range; more occupied bins than buckets",
    .make = make<true>,
};

}  // namespace strata::transparency
