#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "transparency/slots/counted_sort.h"
#include "transparency/slots/slot_techniques.h"
#include "transparency/stream/tile_stream.h"

// K. Myers, L. Bavoil, "Stencil routed A-buffer" (2007): a picture of k samples a pixel, whose
// stencil values begin with 2, 3, .. and fall by 1 with each fragment; a fragment is written to the
// sample whose value is 2, so that the j-th fragment of a pixel lands in sample j. A further pass
// begins k higher and takes the next k. Chunks hold fragments in order of arrival: all are kept,
// and merged when the pixel is resolved. A stencil value has 8 bits, so that a sample can wait for
// 253 fragments at most: where a pixel has more, the stream is drawn in batches, each of which ends
// before the fragment that would be the 255th of a pixel.

namespace strata::transparency {
namespace {

constexpr std::uint64_t kSampleBytes = 8, kStencilBytes = 1;
constexpr unsigned kFirstValue = 2, kLastValue = 255;
constexpr unsigned kMostOfABatch = kLastValue - kFirstValue + 1;
constexpr DepthItem kNothing{std::numeric_limits<std::uint64_t>::max()};

class RoutedSamples {
 public:
  explicit RoutedSamples(unsigned k) : k_(k) {}

  void render(TileStream& stream, TileImage& image) {
    used_ = 0;
    for (std::size_t begin = 0; begin < stream.size() || used_ == 0;) {
      unsigned deepest = 0;
      const std::size_t end = batch_end(stream, begin, deepest);
      for (unsigned first = 0; first < std::max(deepest, 1u); first += k_) {
        route(stream, begin, end, first);
      }
      begin = end;
    }
    Costs& costs = stream.costs();
    costs.stored = costs.kept = stream.size();
    // A pixel's stencil values fall together: one byte tells all.
    const std::uint64_t samples = kSampleBytes * k_ * used_;
    costs.formula_bytes = (samples + kStencilBytes * k_) * stream.pixel_count();
    costs.allocated_bytes = (samples + kStencilBytes) * stream.pixel_count();
    for_each_pixel(stream, [&](std::uint32_t pixel) { resolve(stream, pixel, image); });
  }

 private:
  std::size_t batch_end(const TileStream& stream, std::size_t begin, unsigned& deepest) {
    fallen_.fill(0);
    const auto pixels = stream.pixels();
    std::size_t i = begin;
    for (; i < pixels.size(); ++i) {
      std::uint8_t& fallen = fallen_[pixels[i]];
      if (fallen == kMostOfABatch) break;
      deepest = std::max<unsigned>(deepest, ++fallen);
    }
    return i;
  }
  /// A geometry pass whose samples wait for `first`, `first` + 1 .. fragments.
  void route(TileStream& stream, std::size_t begin, std::size_t end, unsigned first) {
    if (used_ == chunks_.size()) chunks_.emplace_back(std::size_t{k_} * kTilePixels);
    std::vector<DepthItem>& chunk = chunks_[used_++];
    std::fill_n(chunk.begin(),
                std::size_t{k_} * kTileSide * static_cast<std::size_t>(stream.height()), kNothing);
    stream.count_pass(end - begin);
    fallen_.fill(0);
    const auto pixels = stream.pixels();
    const auto items = stream.items();
    for (std::size_t i = begin; i < end; ++i) {
      // The sample whose value, kFirstValue + first + sample, has fallen to kFirstValue.
      const unsigned sample = fallen_[pixels[i]]++ - first;
      if (sample < k_) chunk[std::size_t{pixels[i]} * k_ + sample] = items[i];
    }
  }
  void resolve(TileStream& stream, std::uint32_t pixel, TileImage& image) {
    list_.clear();
    for (std::size_t c = 0; c < used_; ++c) {
      const DepthItem* const samples = chunks_[c].data() + std::size_t{pixel} * k_;
      for (unsigned i = 0; i < k_ && samples[i] != kNothing; ++i) list_.push_back(samples[i]);
    }
    if (list_.empty()) return;
    Costs& costs = stream.costs();
    costs.most_layers = std::max<std::uint64_t>(costs.most_layers, list_.size());
    costs.comparisons += counted_sort(list_.data(), list_.data() + list_.size());
    FrontToBack sum;
    for (const DepthItem item : list_) sum.add(stream.shade(item));
    image.pixels[pixel] = sum.result();
  }

  unsigned k_;
  std::size_t used_ = 0;                          ///< chunks of this tile
  std::vector<std::vector<DepthItem>> chunks_;    ///< k samples of each pixel
  std::array<std::uint8_t, kTilePixels> fallen_;  ///< by how much the stencil values are less
  std::vector<DepthItem> list_;
};

Result<TileRenderer> make_stencil_routed(const FrameInfo&, const Settings& settings,
                                         const std::shared_ptr<const void>&) {
  return renderer_of<RoutedSamples>(settings.k);
}

}  // namespace

const Technique kStencilRouted{
    .name = "stencil-routed",
    .title = "Stencil-routed A-buffer, all chunks merged",
    .paper = "Myers, Bavoil 2007",
    .k_means = "samples",
    .default_k = 8,
    .least_k = 1,
    .most_k = 32,
    .memory = "9 bytes a sample of the first chunk, 8 of the others; layers / k chunks, rounded up",
    .fails = "every pixel has as many chunks as the deepest; beyond 254 layers the stream is cut",
    .make = make_stencil_routed,
};

}  // namespace strata::transparency
