#include <array>
#include <limits>

#include "transparency/peeling/peeling_techniques.h"
#include "transparency/stream/tile_stream.h"

// L. Bavoil, K. Myers, "Order independent transparency with dual depth peeling" (2008): MAX
// blending on (-nearest, farthest) finds both ends of what is left of a pixel in one pass, in which
// the ends that the pass before found are blended, one from the front, one from the back. We
// compare (depth, exit, triangle) and count equal fragments: a pass peels one of them at each end,
// so that the layers meet in the middle whatever is equal.

namespace strata::transparency {
namespace {

/// Two pairs of depth keys, the sum of the front and that of the back.
constexpr std::uint64_t kDualPeelingPixelBytes = 2 * 2 * 8 + 2 * 16;
constexpr std::uint64_t kNone = std::numeric_limits<std::uint64_t>::max();

/// The first and the last fragment of those in a range, and how many equal each.
struct Ends {
  std::uint64_t low = kNone, high = 0;
  std::uint32_t lows = 0, highs = 0;

  [[nodiscard]] bool none() const { return lows == 0; }
  void include(std::uint64_t bits) {
    if (bits < low) {
      low = bits;
      lows = 1;
    } else if (bits == low) {
      ++lows;
    }
    if (bits > high || highs == 0) {
      high = bits;
      highs = 1;
    } else if (bits == high) {
      ++highs;
    }
  }
  /// Takes one fragment off each end, the only one off the front. @param inner  what lies strictly
  /// between the ends
  void peel(const Ends& inner) {
    if (low == high) {
      lows = highs = lows > 2 ? lows - 2 : 0;
      return;
    }
    --lows, --highs;
    const Ends old = *this;
    if (old.lows == 0) {
      low = inner.none() ? old.high : inner.low;
      lows = inner.none() ? old.highs : inner.lows;
    }
    if (old.highs == 0) {
      high = inner.none() ? old.low : inner.high;
      highs = inner.none() ? old.lows : inner.highs;
    }
  }
};

class DualPeeler {
 public:
  explicit DualPeeler(unsigned most_passes)
      : most_passes_(most_passes == 0 ? kMostPasses : most_passes) {}

  void render(TileStream& stream, TileImage& image) {
    Costs& costs = stream.costs();
    costs.formula_bytes = costs.allocated_bytes = kDualPeelingPixelBytes * stream.pixel_count();
    if (stream.size() == 0) return;
    ends_.fill({});
    layers_.fill(0);
    front_.fill({});
    back_.fill({});
    stream.pass([&](std::uint32_t pixel, DepthItem item) { ends_[pixel].include(item.bits); });
    costs.comparisons += 2 * stream.size();
    for (bool more = true; more && stream.passes() < most_passes_;) {
      find_inner(stream);
      more = blend(stream);
    }
    costs.kept = costs.stored;
    costs.lost = stream.size() - costs.stored;
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (layers_[pixel] == 0) return;
      costs.most_layers = std::max<std::uint64_t>(costs.most_layers, layers_[pixel]);
      const FrontToBack& front = front_[pixel];
      image.pixels[pixel] = glm::vec4(front.colour + front.transmittance * back_[pixel].colour,
                                      front.transmittance * back_[pixel].transmittance);
    });
  }

 private:
  void find_inner(TileStream& stream) {
    inner_.fill({});
    std::uint64_t inside = 0;
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const Ends& ends = ends_[pixel];
      if (item.bits <= ends.low || item.bits >= ends.high) return;
      ++inside;
      inner_[pixel].include(item.bits);
    });
    stream.costs().comparisons += 2 * (stream.size() + inside);
  }
  /// Blends one fragment at each end. @return whether any is left
  bool blend(TileStream& stream) {
    bool left = false;
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      Ends& ends = ends_[pixel];
      if (ends.none()) return;
      front_[pixel].add(stream.shade(DepthItem(ends.low)));
      std::uint32_t peeled = 1;
      if (ends.low != ends.high || ends.lows > 1) {
        back_[pixel].add(stream.shade(DepthItem(ends.high)));
        peeled = 2;
      }
      layers_[pixel] += peeled;
      stream.costs().stored += peeled;
      ends.peel(inner_[pixel]);
      if (ends.none()) {
        ends = {};
      } else {
        left = true;
      }
    });
    return left;
  }

  unsigned most_passes_;
  std::array<Ends, kTilePixels> ends_, inner_;
  std::array<std::uint32_t, kTilePixels> layers_;
  std::array<FrontToBack, kTilePixels> front_;
  std::array<BackToFront, kTilePixels> back_;
};

Result<TileRenderer> make_dual_peeling(const FrameInfo&, const Settings& settings,
                                       const std::shared_ptr<const void>&) {
  return renderer_of<DualPeeler>(settings.k);
}

}  // namespace

const Technique kDualPeeling{
    .name = "dual-peeling",
    .title = "Dual depth peeling, from both ends",
    .paper = "Bavoil, Myers 2008",
    .blending = Blending::kFromBothEnds,
    .k_means = "passes",
    .least_k = 2,
    .most_k = kMostPasses,
    .memory = "64 bytes a pixel",
    .fails = "a geometry pass for two layers and one more; fewer passes lose the middle layers",
    .make = make_dual_peeling,
};

}  // namespace strata::transparency
