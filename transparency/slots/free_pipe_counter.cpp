#include <algorithm>
#include <array>
#include <vector>

#include "transparency/slots/counted_sort.h"
#include "transparency/slots/slot_techniques.h"
#include "transparency/stream/tile_stream.h"

// F. Liu, M.-C. Huang, X.-H. Liu, E.-H. Wu, "FreePipe: a programmable parallel rendering
// architecture for efficient multi-fragment effects" (2010), the scheme with a counter: a fragment
// takes the slot that its pixel's counter names, and a pass over the screen sorts. What comes when
// all slots are taken is lost, near or far.

namespace strata::transparency {
namespace {

constexpr std::uint64_t kSlotBytes = 8, kCounterBytes = 4;

class CountedSlots {
 public:
  explicit CountedSlots(unsigned k) : k_(k), slots_(std::size_t{k} * kTilePixels) {}

  void render(TileStream& stream, TileImage& image) {
    Costs& costs = stream.costs();
    costs.formula_bytes = costs.allocated_bytes =
        (kSlotBytes * k_ + kCounterBytes) * stream.pixel_count();
    counters_.fill(0);
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const std::uint32_t place = counters_[pixel]++;
      if (place < k_) slots_[std::size_t{pixel} * k_ + place] = item;
    });
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (counters_[pixel] == 0) return;
      const std::uint32_t layers = std::min(counters_[pixel], k_);
      DepthItem* const begin = slots_.data() + std::size_t{pixel} * k_;
      costs.comparisons += counted_sort(begin, begin + layers);
      costs.kept += layers;
      costs.most_layers = std::max<std::uint64_t>(costs.most_layers, counters_[pixel]);
      FrontToBack sum;
      for (std::uint32_t i = 0; i < layers; ++i) sum.add(stream.shade(begin[i]));
      image.pixels[pixel] = sum.result();
    });
    costs.stored = costs.kept;
    costs.lost = stream.size() - costs.kept;
  }

 private:
  unsigned k_;
  std::vector<DepthItem> slots_;  ///< k of each pixel
  std::array<std::uint32_t, kTilePixels> counters_;
};

Result<TileRenderer> make_free_pipe_counter(const FrameInfo&, const Settings& settings,
                                            const std::shared_ptr<const void>&) {
  return renderer_of<CountedSlots>(settings.k);
}

}  // namespace

const Technique kFreePipeCounter{
    .name = "freepipe-counter",
    .title = "FreePipe with a counter: the first k, sorted afterwards",
    .paper = "Liu, Huang, Liu, Wu 2010",
    .accuracy = Accuracy::kBounded,
    .k_means = "slots",
    .default_k = 16,
    .least_k = 1,
    .most_k = 1024,
    .memory = "8 bytes a slot, 4 a pixel",
    .fails = "pixels with more layers than slots lose those that came last, near or far",
    .make = make_free_pipe_counter,
};

}  // namespace strata::transparency
