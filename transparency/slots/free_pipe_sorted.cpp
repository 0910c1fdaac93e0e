#include <algorithm>
#include <limits>
#include <vector>

#include "transparency/slots/slot_techniques.h"
#include "transparency/stream/tile_stream.h"

// F. Liu, M.-C. Huang, X.-H. Liu, E.-H. Wu, "FreePipe: a programmable parallel rendering
// architecture for efficient multi-fragment effects" (2010), the scheme that sorts by atomicMin:
// a fragment goes through the slots of its pixel, leaves the lesser in each and takes the greater
// on, until a slot was empty. The nearest k stay, in order. Equal ones go on, so that both stay.

namespace strata::transparency {
namespace {

constexpr std::uint64_t kFreePipeSortedSlotBytes = 8;
constexpr std::uint64_t kFreePipeSortedEmpty = std::numeric_limits<std::uint64_t>::max();

class SortedSlots {
 public:
  explicit SortedSlots(unsigned k) : k_(k), slots_(std::size_t{k} * kTilePixels) {}

  void render(TileStream& stream, TileImage& image) {
    Costs& costs = stream.costs();
    costs.formula_bytes = costs.allocated_bytes =
        kFreePipeSortedSlotBytes * k_ * stream.pixel_count();
    std::fill_n(slots_.begin(),
                std::size_t{k_} * kTileSide * static_cast<std::size_t>(stream.height()),
                kFreePipeSortedEmpty);
    std::uint64_t exchanges = 0;
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      std::uint64_t carry = item.bits;
      std::uint64_t* slot = slots_.data() + std::size_t{pixel} * k_;
      for (std::uint64_t* const end = slot + k_; slot != end; ++slot) {
        const std::uint64_t old = *slot;
        *slot = std::min(old, carry);  // the paper's atomicMin
        carry = std::max(old, carry);
        ++exchanges;
        if (old == kFreePipeSortedEmpty) break;
      }
    });
    costs.stored = stream.size();
    costs.comparisons = exchanges;
    for_each_pixel(stream, [&](std::uint32_t pixel) { blend(stream, pixel, image); });
    costs.lost = stream.size() - costs.kept;
  }

 private:
  void blend(TileStream& stream, std::uint32_t pixel, TileImage& image) const {
    const std::uint64_t* const slots = slots_.data() + std::size_t{pixel} * k_;
    if (slots[0] == kFreePipeSortedEmpty) return;
    FrontToBack sum;
    std::uint64_t layers = 0;
    while (layers < k_ && slots[layers] != kFreePipeSortedEmpty) {
      sum.add(stream.shade(DepthItem(slots[layers])));
      ++layers;
    }
    stream.costs().kept += layers;
    stream.costs().most_layers = std::max(stream.costs().most_layers, layers);
    image.pixels[pixel] = sum.result();
  }

  unsigned k_;
  std::vector<std::uint64_t> slots_;  ///< k of each pixel, increasing
};

Result<TileRenderer> make_free_pipe_sorted(const FrameInfo&, const Settings& settings,
                                           const std::shared_ptr<const void>&) {
  return renderer_of<SortedSlots>(settings.k);
}

}  // namespace

const Technique kFreePipeSorted{
    .name = "freepipe-sorted",
    .title = "FreePipe, sorted by atomic minima: the nearest k",
    .paper = "Liu, Huang, Liu, Wu 2010",
    .accuracy = Accuracy::kBounded,
    .k_means = "slots",
    .default_k = 8,
    .least_k = 1,
    .most_k = 1024,
    .memory = "8 bytes a slot",
    .fails = "pixels with more layers than slots lose the farthest",
    .make = make_free_pipe_sorted,
};

}  // namespace strata::transparency
