#include <atomic>

#include "transparency/lists/blend_list.h"
#include "transparency/lists/list_bytes.h"
#include "transparency/lists/list_techniques.h"
#include "transparency/stream/sorted_tile.h"

// M. Maule, J. Comba, R. Torchelsen, R. Bastos, "Memory-optimized order-independent transparency
// with Dynamic Fragment Buffer" (2014): a geometry pass counts the fragments of each pixel, a
// prefix sum gives each pixel its place, a second pass stores, and each pixel sorts its own.

namespace strata::transparency {
namespace {

Result<TileRenderer> make_count_scan(const FrameInfo&, const Settings&,
                                     const std::shared_ptr<const void>&) {
  return [lists = std::make_shared<SortedTile>()](TileStream& stream,
                                                  TileImage& image) -> Result<void> {
    lists->store(stream);
    Costs& costs = stream.costs();
    costs.stored = costs.kept = lists->size();
    costs.most_layers = lists->most_layers();
    costs.formula_bytes = costs.allocated_bytes =
        list_bytes::count_scan(stream.pixel_count(), lists->size());
    if (lists->size() == 0) return {};
    std::uint64_t comparisons = 0;
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      const std::uint32_t count = lists->count(pixel);
      if (count == 0) return;
      comparisons += blend_list(stream, lists->stored(pixel), count, image.pixels[pixel]);
    });
    costs.comparisons = comparisons;
    stream.count_shaded(lists->size());
    return {};
  };
}

/// The sum of a_i c_i t(z_i), with t(z) the transmittance strictly in front of z.
glm::vec4 blend_transmittance(TileStream& stream, std::span<const DepthItem> list) {
  glm::vec3 colour(0.0f);
  float in_front = 1.0f, with_group = 1.0f;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (i > 0 && list[i].depth() != list[i - 1].depth()) in_front = with_group;
    const glm::vec4& fragment = stream.shade(list[i]);
    colour += in_front * glm::vec3(fragment);
    with_group *= 1.0f - fragment.a;
  }
  return {colour, with_group};
}

Result<TileRenderer> make_transmittance(const FrameInfo&, const Settings&,
                                        const std::shared_ptr<const void>&) {
  return [lists = std::make_shared<SortedTile>()](TileStream& stream,
                                                  TileImage& image) -> Result<void> {
    lists->build(stream);
    Costs& costs = stream.costs();
    costs.stored = costs.kept = lists->size();
    costs.most_layers = lists->most_layers();
    costs.formula_bytes = costs.allocated_bytes =
        list_bytes::count_scan(stream.pixel_count(), lists->size());
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      const auto list = lists->list(pixel);
      if (!list.empty()) image.pixels[pixel] = blend_transmittance(stream, list);
    });
    return {};
  };
}

/// Room for the fragments of a whole frame.
struct FixedRoom {
  std::uint64_t capacity = 0;
  mutable std::atomic<std::uint64_t> used{0};
};
constexpr std::uint64_t kRoomOfPixel = 8;  ///< fragments

Result<std::shared_ptr<const void>> prepare_fixed_room(const FrameInfo& frame, const Settings&,
                                                       const Execution&) {
  auto room = std::make_shared<FixedRoom>();
  room->capacity = kRoomOfPixel * static_cast<std::uint64_t>(frame.size.x) *
                   static_cast<std::uint64_t>(frame.size.y);
  return room;
}

Result<TileRenderer> make_in_fixed_room(const FrameInfo& frame, const Settings& settings,
                                        const std::shared_ptr<const void>& prepared) {
  auto inner = make_count_scan(frame, settings, nullptr);
  if (!inner) return inner;
  const auto room = std::static_pointer_cast<const FixedRoom>(prepared);
  return [renderer = *inner, room](TileStream& stream, TileImage& image) -> Result<void> {
    if ((room->used += stream.size()) > room->capacity) {
      return fail(ErrorCode::kLimit,
                  "dxdfb: the buffer holds {} fragments a pixel on average, {} of them; the frame "
                  "has more",
                  kRoomOfPixel, room->capacity);
    }
    auto done = renderer(stream, image);
    stream.costs().formula_bytes =
        list_bytes::count_scan(stream.pixel_count(), kRoomOfPixel * stream.pixel_count());
    return done;
  };
}

}  // namespace

const Technique kCountScan{
    .name = "count-scan",
    .title = "Dynamic fragment buffer: count, scan, store, sort",
    .paper = "Maule, Comba, Torchelsen, Bastos 2014",
    .memory = "8 bytes a fragment, 8 a pixel",
    .fails = "two geometry passes even where nothing is drawn",
    .make = make_count_scan,
};
const Technique kTransmittanceForm{
    .name = "transmittance",
    .title = "Sorted lists in transmittance form: equal depths do not attenuate each other",
    .paper = "Salvi, Vaidyanathan 2014",
    .accuracy = Accuracy::kBounded,
    .memory = kCountScan.memory,
    .fails = "differs from blending in order where surfaces coincide; the sum may exceed 1 there",
    .make = make_transmittance,
};
const Technique kDeepFrameBuffer{
    .name = "dxdfb",
    .title = "Deep frame buffer of the DirectX SDK: count and scan in a buffer of fixed size",
    .paper = "Maule, Comba, Torchelsen, Bastos 2014",
    .accuracy = Accuracy::kBounded,
    .memory = "72 bytes a pixel: room for 8 fragments of 8 bytes, and its count and base",
    .fails = "ends in an error if the frame has more than 8 fragments a pixel on average",
    .prepare = prepare_fixed_room,
    .make = make_in_fixed_room,
};

}  // namespace strata::transparency
