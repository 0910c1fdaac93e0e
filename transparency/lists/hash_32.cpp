#include "strata/hashbuffer/resize_policy.h"
#include "transparency/lists/blend_list.h"
#include "transparency/lists/list_techniques.h"
#include "transparency/lists/tile_hash.h"

// S. Lefebvre, S. Hornus, A. Lasram, "HA-Buffer" (2013), with records of 32 bits: age and depth.
// They hold no colour. We add a geometry pass in which each fragment finds the records of its depth
// and claims one: the table is unique, and fragments of one depth are put in order by their payload
// (surface, triangle), the smallest first.

namespace strata::transparency {
namespace {

constexpr std::uint32_t kFree = 0xffffffffu;  ///< larger than every payload of a fragment

class Hash32Renderer {
 public:
  explicit Hash32Renderer(const Settings& settings) : settings_(settings) {
    if (settings.variant == "random") kind_ = OffsetKind::kRandom;
    if (settings.variant == "farthest-point") kind_ = OffsetKind::kFarthestPoint;
  }

  Result<void> render(TileStream& stream, TileImage& image) {
    std::uint64_t cells =
        std::max(stream.pixel_count(), list_bytes::cells_at(settings_.load, stream.size()));
    Costs& costs = stream.costs();
    for (;;) {
      const std::uint64_t failures = insert(stream, cells);
      costs.stored += stream.size() - failures;
      if (failures == 0) break;
      costs.comparisons += table_.ages() + failures * table_.age_limit();
      table_.clear();
      if (stream.size() < cells / 2) return render_deep(stream, image);
      cells = rebuilt_cells(stream.size(), cells);
    }
    payloads_.assign(cells, kFree);
    stream.pass([&](std::uint32_t pixel, DepthItem item) { claim(pixel, item); });
    blend(stream, image);
    costs.allocated_bytes = table_.bytes() + cells * sizeof(std::uint32_t);
    costs.formula_bytes = list_bytes::hash_table(cells, table_.blocks(), 32 + 32);
    costs.kept = stream.size();
    table_.clear();
    return {};
  }

 private:
  std::uint64_t insert(TileStream& stream, std::uint64_t cells) {
    table_.begin(stream, cells, kind_, settings_.seed);
    stream.pass(
        [&](std::uint32_t pixel, DepthItem item) { table_.insert<Exclusive>(pixel, item, [] {}); });
    return table_.failures();
  }

  /// Goes along the records of one depth with the larger payload.
  void claim(std::uint32_t pixel, DepthItem item) {
    std::uint32_t payload = item.payload();
    std::uint64_t comparisons = 0;
    table_.for_each(pixel, [&](std::size_t cell, std::uint32_t record, unsigned) {
      ++comparisons;
      if (Record32::depth(record) != item.depth()) return true;
      if (payload < payloads_[cell]) std::swap(payload, payloads_[cell]);
      return payload != kFree;
    });
    comparisons_ += comparisons;
  }

  void blend(TileStream& stream, TileImage& image) {
    std::uint64_t most = 0, shaded = 0;
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      FrontToBack4 sum;
      std::uint64_t layers = 0;
      table_.for_each(pixel, [&](std::size_t cell, std::uint32_t record, unsigned age) {
        const std::uint64_t depth = Record32::depth(record);
        sum.add(stream.colour(DepthItem(depth << 32 | payloads_[cell])));
        ++layers;
        comparisons_ += age;
        return true;
      });
      if (layers == 0) return;
      sum.write(image.pixels[pixel]);
      most = std::max(most, layers);
      shaded += layers;
    });
    Costs& costs = stream.costs();
    costs.most_layers = most;
    costs.comparisons += std::exchange(comparisons_, 0);
    stream.count_shaded(shaded);
  }

  /// More than 255 layers: the tile goes to records of 64 bits.
  Result<void> render_deep(TileStream& stream, TileImage& image) {
    if (!deep_) {
      auto made = kHash64.make(stream.frame(), settings_, nullptr);
      if (!made) return tl::unexpected(made.error());
      deep_ = std::move(*made);
    }
    return deep_(stream, image);
  }

  Settings settings_;
  OffsetKind kind_ = OffsetKind::kPlaneFirst;
  TileHash<Record32> table_;
  std::vector<std::uint32_t> payloads_;
  std::uint64_t comparisons_ = 0;
  TileRenderer deep_;
};

Result<TileRenderer> make_hash_32(const FrameInfo&, const Settings& settings,
                                  const std::shared_ptr<const void>&) {
  return renderer_of<Hash32Renderer>(settings);
}

}  // namespace

const Technique kHash32{
    .name = "ha32",
    .title = "HA-buffer with 32-bit records: depths first, surfaces claimed in a second pass",
    .paper = "Lefebvre, Hornus, Lasram 2013",
    .variants = "plane-first random farthest-point",
    .memory = "4 bytes a cell for depths, 4 for surfaces; 1 byte a 64 pixels",
    .fails = "tiles with more than 255 layers go to ha64",
    .make = make_hash_32,
};

}  // namespace strata::transparency
