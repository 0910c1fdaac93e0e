#include "transparency/lists/blend_list.h"
#include "transparency/lists/list_bytes.h"
#include "transparency/lists/list_techniques.h"

// L. Bavoil et al. and M. Maule et al. (2014), the "3D buffer": each pixel has an array of k slots
// and a count; a fragment takes the next slot. Those behind the last slot are lost.

namespace strata::transparency {
namespace {

class FixedArray {
 public:
  void build(TileStream& stream, std::uint32_t slots) {
    slots_ = slots;
    counts_.assign(kTilePixels, 0);
    items_.resize(std::max(items_.size(), std::size_t{slots} * kTilePixels));
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const std::uint32_t slot = counts_[pixel]++;
      if (slot < slots) items_[std::size_t{pixel} * slots + slot] = item;
    });
  }
  [[nodiscard]] std::uint32_t count(std::uint32_t pixel) const { return counts_[pixel]; }
  void gather(std::uint32_t pixel, std::vector<DepthItem>& list) const {
    const DepthItem* first = items_.data() + std::size_t{pixel} * slots_;
    list.insert(list.end(), first, first + std::min(counts_[pixel], slots_));
  }

 private:
  std::uint32_t slots_ = 0;
  std::vector<std::uint32_t> counts_;
  std::vector<DepthItem> items_;
};

/// Fragments of the deepest pixel. Not a geometry pass: the paper sets the number by hand.
std::uint32_t deepest(const TileStream& stream, std::vector<std::uint32_t>& counts) {
  counts.assign(kTilePixels, 0);
  std::uint32_t most = 0;
  for (const std::uint32_t pixel : stream.pixels()) most = std::max(most, ++counts[pixel]);
  return most;
}

struct State {
  FixedArray array;
  ListBlender blender;
  std::vector<std::uint32_t> counts;
};

/// settings.k is 0 where the deepest pixel says how many slots there are.
Result<TileRenderer> make_fixed_array(const FrameInfo&, const Settings& settings,
                                      const std::shared_ptr<const void>&) {
  return [state = std::make_shared<State>(), k = settings.k](TileStream& stream,
                                                             TileImage& image) -> Result<void> {
    Costs& costs = stream.costs();
    const std::uint32_t slots = k != 0 ? k : deepest(stream, state->counts);
    state->array.build(stream, slots);
    costs.formula_bytes = list_bytes::fixed(stream.pixel_count(), slots);
    costs.allocated_bytes =
        stream.pixel_count() * (slots * sizeof(DepthItem) + sizeof(std::uint32_t));
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      const std::uint32_t count = state->array.count(pixel);
      if (count == 0) return;
      costs.lost += count - std::min(count, slots);
      state->array.gather(pixel, state->blender.begin());
      state->blender.finish(stream, image, pixel);
    });
    costs.stored = costs.kept;
    return {};
  };
}

}  // namespace

const Technique kFixedArray{
    .name = "b3d",
    .title = "Fixed array: as many slots a pixel as the deepest pixel of the tile has fragments",
    .paper = "Maule, Comba, Torchelsen, Bastos 2014",
    .memory = "8 bytes a slot, 4 a pixel; k slots a pixel",
    .fails = "slots of shallow and empty pixels are wasted",
    .make = make_fixed_array,
};
const Technique kFixedArrayBounded{
    .name = "b3d-k",
    .title = "Fixed array of k slots a pixel",
    .paper = "Maule, Comba, Torchelsen, Bastos 2014",
    .accuracy = Accuracy::kBounded,
    .k_means = "slots",
    .default_k = 8,
    .least_k = 1,
    .most_k = 1024,
    .memory = "8 bytes a slot, 4 a pixel; k slots a pixel",
    .fails = "loses the fragments of a pixel that come after the k-th, wherever they lie",
    .make = make_fixed_array,
};

}  // namespace strata::transparency
