#include <array>
#include <limits>
#include <vector>

#include "transparency/peeling/peeling_techniques.h"
#include "transparency/stream/tile_stream.h"

// C. Wittenbrink, "R-buffer: a pointerless A-buffer hardware architecture" (2001): the geometry is
// rasterized once. Opaque fragments resolve in the z-buffer; the others go to the R-buffer, if no
// opaque one that came before hides them. The first pass over the R-buffer drops what an opaque
// fragment hides that came later. Each further pass blends the farthest fragment of each pixel over
// the picture, and recirculates all others, which take the places that were read.

namespace strata::transparency {
namespace {

/// A record is a pixel and a key; a pixel has the z-buffer, two depth maps and a colour.
constexpr std::uint64_t kRBufferRecordBytes = 4 + 8, kRBufferPixelBytes = 3 * 8 + 16;
constexpr std::uint64_t kNoOpaque = std::numeric_limits<std::uint64_t>::max();

class RBuffer {
 public:
  void render(TileStream& stream, TileImage& image) {
    Costs& costs = stream.costs();
    costs.formula_bytes = kRBufferPixelBytes * stream.pixel_count();
    if (stream.size() > 0) {
      rasterize(stream);
      costs.formula_bytes += kRBufferRecordBytes * count_;
      drop_hidden(stream);
      while (count_ > 0) recirculate(stream);
      for_each_pixel(stream, [&](std::uint32_t pixel) {
        if (layers_[pixel] == 0) return;
        costs.most_layers = std::max<std::uint64_t>(costs.most_layers, layers_[pixel]);
        image.pixels[pixel] = sum_[pixel].result();
      });
    }
    costs.allocated_bytes = costs.formula_bytes;
  }

 private:
  void rasterize(TileStream& stream) {
    count_ = 0;
    pixels_.resize(std::max(pixels_.size(), stream.size()));
    items_.resize(pixels_.size());
    next_.fill(0);
    opaque_.fill(kNoOpaque);
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      if (item.bits > opaque_[pixel]) return;
      if (stream.opacity(item) < 1.0f) {
        forward(pixel, item);
      } else {
        opaque_[pixel] = item.bits;
      }
    });
    stream.costs().stored += count_;
    stream.costs().comparisons += stream.size() + count_;
  }
  /// Keys are kept plus 1, so that 0 is less than all.
  void forward(std::uint32_t pixel, DepthItem item) {
    pixels_[count_] = pixel;
    items_[count_++] = item;
    next_[pixel] = std::max(next_[pixel], item.bits + 1);
  }
  /// The pass that checks again, and the opaque fragments' colours.
  void drop_hidden(TileStream& stream) {
    sum_.fill({});
    layers_.fill(0);
    next_.fill(0);
    const std::size_t count = count_;
    count_ = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (items_[i].bits < opaque_[pixels_[i]]) forward(pixels_[i], items_[i]);
    }
    stream.costs().stored += count_;
    stream.costs().comparisons += count + count_;
    stream.costs().kept += count_;
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (opaque_[pixel] == kNoOpaque) return;
      sum_[pixel].add(stream.shade(DepthItem(opaque_[pixel])));
      layers_[pixel] = 1;
      ++stream.costs().kept;
    });
  }
  /// One pass over the R-buffer.
  void recirculate(TileStream& stream) {
    const std::size_t count = count_;
    count_ = 0;
    farthest_ = next_;
    next_.fill(0);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t pixel = pixels_[i];
      const DepthItem item = items_[i];
      if (item.bits + 1 == farthest_[pixel]) {
        farthest_[pixel] = 0;  // one a pass, the first of equal ones
        sum_[pixel].add(stream.shade(item));
        ++layers_[pixel];
      } else {
        forward(pixel, item);
      }
    }
    stream.costs().stored += count_;
    stream.costs().comparisons += count + count_;
  }

  std::size_t count_ = 0;  ///< records in the R-buffer
  std::vector<std::uint32_t> pixels_;
  std::vector<DepthItem> items_;
  std::array<std::uint64_t, kTilePixels> opaque_, farthest_, next_;
  std::array<std::uint32_t, kTilePixels> layers_;
  std::array<BackToFront, kTilePixels> sum_;
};

Result<TileRenderer> make_r_buffer(const FrameInfo&, const Settings&,
                                   const std::shared_ptr<const void>&) {
  return renderer_of<RBuffer>();
}

}  // namespace

const Technique kRBuffer{
    .name = "r-buffer",
    .title = "R-buffer: fragments recirculate, the farthest leave first",
    .paper = "Wittenbrink 2001",
    .blending = Blending::kBackToFront,
    .memory = "12 bytes a fragment that is not opaque, 40 a pixel",
    .fails = "each fragment is read once for each layer behind it: time grows with depth squared",
    .make = make_r_buffer,
};

}  // namespace strata::transparency
