#include <array>
#include <limits>
#include <vector>

#include "transparency/peeling/peeling_techniques.h"
#include "transparency/stream/tile_stream.h"

// W. Mark, K. Proudfoot, "The F-buffer: a rasterization-order FIFO buffer for multi-pass rendering"
// (2001): the geometry is rasterized once, into a FIFO. Each pass over the FIFO blends the nearest
// fragment of each pixel, from the front, and forwards all others. What is forwarded takes the
// places that were read, and its nearest fragments are found on the way.

namespace strata::transparency {
namespace {

/// A record is a pixel and a key; a pixel has two depth maps and the sum of its layers.
constexpr std::uint64_t kRecordBytes = 4 + 8, kFBufferPixelBytes = 2 * 8 + 16;
constexpr std::uint64_t kFBufferNone = std::numeric_limits<std::uint64_t>::max();

class FBuffer {
 public:
  void render(TileStream& stream, TileImage& image) {
    Costs& costs = stream.costs();
    costs.formula_bytes = costs.allocated_bytes =
        kRecordBytes * stream.size() + kFBufferPixelBytes * stream.pixel_count();
    if (stream.size() == 0) return;
    rasterize(stream);
    sum_.fill({});
    layers_.fill(0);
    while (count_ > 0) recirculate(stream);
    costs.kept = stream.size();
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (layers_[pixel] == 0) return;
      costs.most_layers = std::max<std::uint64_t>(costs.most_layers, layers_[pixel]);
      image.pixels[pixel] = sum_[pixel].result();
    });
  }

 private:
  void rasterize(TileStream& stream) {
    count_ = 0;
    pixels_.resize(std::max(pixels_.size(), stream.size()));
    items_.resize(pixels_.size());
    next_.fill(kFBufferNone);
    stream.pass([&](std::uint32_t pixel, DepthItem item) { forward(pixel, item); });
    stream.costs().stored += count_;
    stream.costs().comparisons += count_;
  }
  void forward(std::uint32_t pixel, DepthItem item) {
    pixels_[count_] = pixel;
    items_[count_++] = item;
    next_[pixel] = std::min(next_[pixel], item.bits);
  }
  /// One pass over the FIFO.
  void recirculate(TileStream& stream) {
    const std::size_t count = count_;
    count_ = 0;
    nearest_ = next_;
    next_.fill(kFBufferNone);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t pixel = pixels_[i];
      const DepthItem item = items_[i];
      if (item.bits == nearest_[pixel]) {
        nearest_[pixel] = kFBufferNone;  // one a pass, the first of equal ones
        sum_[pixel].add(stream.shade(item));
        ++layers_[pixel];
      } else {
        forward(pixel, item);
      }
    }
    stream.costs().stored += count_;
    stream.costs().comparisons += count + count_;
  }

  std::size_t count_ = 0;  ///< records in the FIFO
  std::vector<std::uint32_t> pixels_;
  std::vector<DepthItem> items_;
  std::array<std::uint64_t, kTilePixels> nearest_, next_;
  std::array<std::uint32_t, kTilePixels> layers_;
  std::array<FrontToBack, kTilePixels> sum_;
};

Result<TileRenderer> make_f_buffer(const FrameInfo&, const Settings&,
                                   const std::shared_ptr<const void>&) {
  return renderer_of<FBuffer>();
}

}  // namespace

const Technique kFBuffer{
    .name = "f-buffer",
    .title = "F-buffer: fragments recirculate, the nearest leave first",
    .paper = "Mark, Proudfoot 2001",
    .memory = "12 bytes a fragment, 32 a pixel",
    .fails = "each fragment is read once for each layer before it: time grows with depth squared",
    .make = make_f_buffer,
};

}  // namespace strata::transparency
