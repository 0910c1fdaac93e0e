#include "transparency/lists/list_techniques.h"
#include "transparency/stream/sorted_tile.h"

// M. Maule, J. Comba, R. Torchelsen, R. Bastos, "Memory-optimized order-independent transparency
// with Dynamic Fragment Buffer" (2014): a geometry pass counts the fragments of each pixel, a
// prefix sum gives each pixel its place, a second pass stores, and each pixel sorts its own.

namespace strata::transparency {
namespace {

/// A fragment takes the 8 bytes of its record; a pixel its count and its base, 4 each.
constexpr std::uint64_t kFragmentBytes = 8, kPixelBytes = 8;

Result<TileRenderer> make(const FrameInfo&, const Settings&, const std::shared_ptr<const void>&) {
  return [lists = std::make_shared<SortedTile>()](TileStream& stream,
                                                  TileImage& image) -> Result<void> {
    lists->build(stream);
    Costs& costs = stream.costs();
    costs.stored = costs.kept = lists->size();
    costs.most_layers = lists->most_layers();
    costs.formula_bytes = costs.allocated_bytes =
        kFragmentBytes * lists->size() + kPixelBytes * stream.pixel_count();
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      const auto list = lists->list(pixel);
      if (list.empty()) return;
      FrontToBack sum;
      for (const DepthItem item : list) sum.add(stream.shade(item));
      image.pixels[pixel] = sum.result();
    });
    return {};
  };
}

}  // namespace

const Technique kCountScan{
    .name = "count-scan",
    .title = "Dynamic fragment buffer: count, scan, store, sort",
    .paper = "Maule, Comba, Torchelsen, Bastos 2014",
    .memory = "8 bytes a fragment, 8 a pixel",
    .fails = "two geometry passes even where nothing is drawn",
    .make = make,
};

}  // namespace strata::transparency
