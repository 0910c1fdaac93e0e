#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <vector>

#include "transparency/slots/counted_sort.h"
#include "transparency/slots/slot_techniques.h"
#include "transparency/stream/tile_stream.h"

// F. Liu, M.-C. Huang, X.-H. Liu, E.-H. Wu, "Efficient depth peeling via bucket sort" (2009): a
// pixel's range of depths is divided into K buckets, as many as the channels of eight targets, and
// MIN blending keeps the nearest fragment of each; buckets are in order as they are. The adaptive
// form first marks the occupied of about 1024 bins, and gives each its own bucket while there are
// enough. The papers draw a bounding box to learn the range; we draw the scene.
// Further passes recover what was lost: each keeps the nearest behind those that were kept.
// Where fragments meet in a bucket, the papers lose all but the nearest; the survey by Maule et al.
// (2011) merges them: the newcomer lies before or behind all that came earlier.

namespace strata::transparency {
namespace {

constexpr unsigned kMostBuckets = 32, kBins = 1024, kWords = kBins / 64;
constexpr std::uint64_t kBucketBytes = 8, kMergedBytes = 16, kRangeBytes = 8;
/// Of repeated passes: where the next begins, how many are equal; a pixel and a key.
constexpr std::uint64_t kRepeatedBytes = 8 + 4, kKeptBytes = 4 + 8;
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

/// The occupied bins of a pixel, and how many lie before each word of them.
struct Histogram {
  std::array<std::uint64_t, kWords> bits;
  std::array<std::uint16_t, kWords> before;
  std::uint32_t all;

  void sum_up() {
    all = 0;
    for (unsigned word = 0; word < kWords; ++word) {
      before[word] = static_cast<std::uint16_t>(all);
      all += static_cast<std::uint32_t>(std::popcount(bits[word]));
    }
  }
  /// Occupied bins before this one.
  [[nodiscard]] std::uint32_t rank(unsigned bin) const {
    const std::uint64_t below = bits[bin / 64] & ((std::uint64_t{1} << bin % 64) - 1);
    return before[bin / 64] + static_cast<std::uint32_t>(std::popcount(below));
  }
};

enum class Collisions : std::uint8_t { kLose, kMerge, kRepeat };

class Buckets {
 public:
  Buckets(unsigned k, bool adaptive, Collisions collisions)
      : k_(k),
        bins_(kBins / k * k),
        adaptive_(adaptive),
        collisions_(collisions),
        nearest_(std::size_t{k} * kTilePixels) {
    if (collisions == Collisions::kMerge) merged_.resize(nearest_.size());
    if (collisions == Collisions::kRepeat) {
      begins_.resize(nearest_.size());
      equal_.resize(nearest_.size());
    }
    if (adaptive) occupied_.resize(kTilePixels);
  }

  void render(TileStream& stream, TileImage& image) {
    Costs& costs = stream.costs();
    const bool merge = collisions_ == Collisions::kMerge;
    const bool repeat = collisions_ == Collisions::kRepeat;
    const std::uint64_t bucket_bytes =
        kBucketBytes + (merge ? kMergedBytes : 0) + (repeat ? kRepeatedBytes : 0);
    costs.formula_bytes = costs.allocated_bytes =
        (bucket_bytes * k_ + kRangeBytes + (adaptive_ ? sizeof(Histogram) : 0)) *
            stream.pixel_count() +
        (repeat ? kKeptBytes * stream.size() : 0);
    if (stream.size() == 0) return;
    ranges_.fill({});
    stream.pass([&](std::uint32_t pixel, DepthItem item) { ranges_[pixel].include(item.depth()); });
    if (adaptive_) mark(stream);
    if (repeat) {
      route_all(stream);
      blend_all(stream, image);
      return;
    }
    std::fill_n(nearest_.begin(), used(stream), kEmpty);
    if (merge) {
      stream.pass([&](std::uint32_t pixel, DepthItem item) { put_merged(stream, pixel, item); });
    } else {
      stream.pass([&](std::uint32_t pixel, DepthItem item) {
        std::uint64_t& nearest = nearest_[bucket(pixel, item)];
        nearest = std::min(nearest, item.bits);
      });
    }
    for_each_pixel(stream, [&](std::uint32_t pixel) { blend(stream, pixel, image); });
    costs.stored = costs.comparisons = stream.size();
    (merge ? costs.merged : costs.lost) = stream.size() - costs.kept;
  }

 private:
  /// Buckets of the rows of the tile.
  [[nodiscard]] std::size_t used(const TileStream& stream) const {
    return std::size_t{k_} * kTileSide * static_cast<std::size_t>(stream.height());
  }
  /// Passes until all fragments are kept.
  void route_all(TileStream& stream) {
    kept_.clear();
    std::fill_n(begins_.begin(), used(stream), 0);
    while (kept_.size() < stream.size()) {
      std::fill_n(nearest_.begin(), used(stream), kEmpty);
      stream.pass([&](std::uint32_t pixel, DepthItem item) {
        const std::size_t at = bucket(pixel, item);
        if (item.bits < begins_[at] || item.bits > nearest_[at]) return;
        equal_[at] = item.bits == nearest_[at] ? equal_[at] + 1 : 1;
        nearest_[at] = item.bits;
      });
      stream.costs().comparisons += stream.size();
      for (std::size_t at = 0, end = used(stream); at < end; ++at) {
        if (nearest_[at] == kEmpty) continue;
        begins_[at] = nearest_[at] + 1;
        kept_.insert(kept_.end(), equal_[at],
                     {static_cast<std::uint32_t>(at / k_), DepthItem(nearest_[at])});
      }
    }
  }
  /// Buckets and passes are in order: lists of pixels are sorted but for where passes meet.
  void blend_all(TileStream& stream, TileImage& image) {
    std::stable_sort(kept_.begin(), kept_.end(),
                     [](const Kept& a, const Kept& b) { return a.pixel < b.pixel; });
    Costs& costs = stream.costs();
    costs.stored = costs.kept = kept_.size();
    for (std::size_t begin = 0, end = 0; begin < kept_.size(); begin = end) {
      list_.clear();
      for (; end < kept_.size() && kept_[end].pixel == kept_[begin].pixel; ++end) {
        list_.push_back(kept_[end].item);
      }
      costs.comparisons += counted_sort(list_.data(), list_.data() + list_.size());
      costs.most_layers = std::max<std::uint64_t>(costs.most_layers, list_.size());
      FrontToBack sum;
      for (const DepthItem item : list_) sum.add(stream.shade(item));
      image.pixels[kept_[begin].pixel] = sum.result();
    }
  }

  /// The bins of each pixel that hold a depth.
  void mark(TileStream& stream) {
    for_each_pixel(stream, [&](std::uint32_t pixel) { occupied_[pixel].bits.fill(0); });
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const unsigned bin = ranges_[pixel].part(item.depth(), bins_);
      occupied_[pixel].bits[bin / 64] |= std::uint64_t{1} << bin % 64;
    });
    for_each_pixel(stream, [&](std::uint32_t pixel) { occupied_[pixel].sum_up(); });
  }
  [[nodiscard]] std::size_t bucket(std::uint32_t pixel, DepthItem item) const {
    const std::size_t first = std::size_t{pixel} * k_;
    if (!adaptive_) return first + ranges_[pixel].part(item.depth(), k_);
    const unsigned bin = ranges_[pixel].part(item.depth(), bins_);
    const Histogram& occupied = occupied_[pixel];
    const std::uint32_t rank = occupied.rank(bin);
    return first + (occupied.all <= k_ ? rank : rank * k_ / occupied.all);
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
      if (collisions_ == Collisions::kMerge) {
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

  struct Kept {
    std::uint32_t pixel;
    DepthItem item;
  };

  unsigned k_, bins_;
  bool adaptive_;
  Collisions collisions_;
  std::array<Range, kTilePixels> ranges_;
  std::vector<std::uint64_t> nearest_;  ///< of each bucket, k a pixel
  std::vector<std::uint64_t> begins_;   ///< the least that is not kept yet, of the same
  std::vector<std::uint32_t> equal_;    ///< how many are the nearest, of the same
  std::vector<Kept> kept_;
  std::vector<DepthItem> list_;
  std::vector<FrontToBack> merged_;  ///< the same
  std::vector<Histogram> occupied_;
};

Collisions collisions_of(const Settings& settings) {
  if (settings.variant == "merge") return Collisions::kMerge;
  return settings.variant == "repeat" ? Collisions::kRepeat : Collisions::kLose;
}

template <bool adaptive>
Result<TileRenderer> make_bucket_sort(const FrameInfo&, const Settings& settings,
                                      const std::shared_ptr<const void>&) {
  return renderer_of<Buckets>(settings.k, adaptive, collisions_of(settings));
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
    .variants = "lose merge repeat",
    .memory = "8 bytes a bucket (merge: 24, repeat: 20), 8 a pixel; repeat: 12 a fragment",
    .fails =
        "fragments that meet in a bucket: all but the nearest are lost, or merged as they come",
    .make = make_bucket_sort<false>,
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
    .variants = "lose merge repeat",
    .memory = "8 bytes a bucket (merge: 24, repeat: 20), 176 a pixel; repeat: 12 a fragment",
    .fails = "fragments of one bin, 1/1024 of a pixel's range; more occupied bins than buckets",
    .make = make_bucket_sort<true>,
};

}  // namespace strata::transparency
