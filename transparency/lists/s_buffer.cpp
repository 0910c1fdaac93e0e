#include "transparency/lists/blend_list.h"
#include "transparency/lists/list_bytes.h"
#include "transparency/lists/list_techniques.h"

// A. Vasilakis, I. Fudos, "S-buffer: Sparsity-aware multi-fragment rendering" (2012): fragments are
// counted and then stored, as by count and scan, but a pixel with fragments takes its place from
// one of a few shared counters, and empty pixels take nothing. Here row v has counter v mod k.

namespace strata::transparency {
namespace {

class SBuffer {
 public:
  explicit SBuffer(std::uint32_t counters) : counters_(counters), firsts_(counters) {}

  void build(TileStream& stream) {
    counts_.assign(kTilePixels, 0);
    ends_.resize(kTilePixels);
    stream.pass([counts = counts_.data()](std::uint32_t pixel, DepthItem) { ++counts[pixel]; });
    take_places(stream);
    if (items_.size() < stream.size()) items_.resize(stream.size());
    stream.pass([ends = ends_.data(), items = items_.data()](std::uint32_t pixel, DepthItem item) {
      items[ends[pixel]++] = item;
    });
  }
  [[nodiscard]] std::uint32_t count(std::uint32_t pixel) const { return counts_[pixel]; }
  [[nodiscard]] DepthItem* list(std::uint32_t pixel) {
    return items_.data() + ends_[pixel] - counts_[pixel];
  }

 private:
  void take_places(const TileStream& stream) {
    std::fill(counters_.begin(), counters_.end(), 0);
    const auto counter_of = [this](std::uint32_t pixel) {
      return pixel / kTileSide % counters_.size();
    };
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (counts_[pixel] == 0) return;
      std::uint32_t& counter = counters_[counter_of(pixel)];
      ends_[pixel] = counter;
      counter += counts_[pixel];
    });
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < counters_.size(); ++i) {
      firsts_[i] = sum;
      sum += counters_[i];
    }
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (counts_[pixel] > 0) ends_[pixel] += firsts_[counter_of(pixel)];
    });
  }

  std::vector<std::uint32_t> counters_, firsts_;  ///< fragments of a counter; where its part begins
  std::vector<std::uint32_t> counts_, ends_;      ///< of pixels
  std::vector<DepthItem> items_;
};

Result<TileRenderer> make_s_buffer(const FrameInfo&, const Settings& settings,
                                   const std::shared_ptr<const void>&) {
  return [buffer = std::make_shared<SBuffer>(settings.k), k = settings.k](
             TileStream& stream, TileImage& image) -> Result<void> {
    buffer->build(stream);
    Costs& costs = stream.costs();
    costs.stored = costs.kept = stream.size();
    costs.formula_bytes = costs.allocated_bytes =
        list_bytes::count_scan(stream.pixel_count(), stream.size()) + 2 * sizeof(std::uint32_t) * k;
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      const std::uint32_t count = buffer->count(pixel);
      if (count == 0) return;
      costs.most_layers = std::max<std::uint64_t>(costs.most_layers, count);
      costs.comparisons += blend_list(stream, buffer->list(pixel), count, image.pixels[pixel]);
    });
    stream.count_shaded(stream.size());
    return {};
  };
}

}  // namespace

const Technique kSBuffer{
    .name = "s-buffer",
    .title = "S-buffer: counted lists whose places come from a few shared counters",
    .paper = "Vasilakis, Fudos 2012",
    .k_means = "shared counters of a tile",
    .default_k = 8,
    .least_k = 1,
    .most_k = 64,
    .memory = "8 bytes a fragment, 8 a pixel, 8 a counter",
    .fails = "two geometry passes even where nothing is drawn",
    .make = make_s_buffer,
};

}  // namespace strata::transparency
