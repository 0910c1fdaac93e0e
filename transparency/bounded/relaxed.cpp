#include <vector>

#include "transparency/bounded/bounded_techniques.h"
#include "transparency/bounded/rows.h"

// The single row of M. Salvi, K. Vaidyanathan, "Multi-layer alpha blending" (2014): a fragment
// nearer than all before is blended over them, any other one under them.

namespace strata::transparency {
namespace {

Result<TileRenderer> make_relaxed(const FrameInfo&, const Settings&,
                                  const std::shared_ptr<const void>&) {
  return [rows = std::make_shared<std::vector<FloatRow>>(kTilePixels)](
             TileStream& stream, TileImage& image) -> Result<void> {
    for_each_pixel(stream, [&](std::uint32_t pixel) { (*rows)[pixel] = FloatRow(); });
    std::uint64_t stored = 0, merged = 0;
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const glm::vec4& fragment = stream.shade(item);
      if (fragment.a == 0.0f) return;
      ++stored;
      FloatRow& row = (*rows)[pixel];
      merged += row.empty() ? 0 : 1;
      FloatRow added = FloatRow::of(fragment, item);
      if (!row.before(added)) std::swap(added, row);
      row.merge(added);
    });
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (!(*rows)[pixel].empty()) image.pixels[pixel] = (*rows)[pixel].value();
    });
    Costs& costs = stream.costs();
    costs.stored = costs.comparisons = stored;
    costs.merged = merged;
    costs.kept = stored - merged;
    costs.formula_bytes = costs.allocated_bytes = sizeof(FloatRow) * stream.pixel_count();
    return {};
  };
}

}  // namespace

const Technique kRelaxed{
    .name = "relaxed",
    .title = "Relaxed blending: over or under, by depth",
    .paper = "Salvi, Vaidyanathan 2014",
    .accuracy = Accuracy::kBounded,
    .memory = "24 bytes a pixel",
    .fails =
        "where a fragment lies between others that are blended already; the submission order "
        "shows",
    .make = make_relaxed,
};

}  // namespace strata::transparency
