#include <optional>

#include "strata/hashbuffer/hash_buffer.h"
#include "transparency/lists/blend_list.h"
#include "transparency/lists/list_bytes.h"
#include "transparency/lists/list_techniques.h"

// S. Lefebvre, S. Hornus, A. Lasram, "HA-Buffer" (2013), section 4.5: a fragment that meets, on its
// way to a cell, enough opacity or k fragments of its pixel in front of it is dropped.
// We differ: each fragment in front is counted once, opacity is a product of transmittances, and
// the list ends by the same rule, so that the picture does not depend on what was dropped.

namespace strata::transparency {
namespace {

/// Opacity of [exit:1 | triangle:31].
struct OpacityOfFace {
  const glm::vec4* colours = nullptr;
  float operator()(std::uint32_t payload) const {
    return colours[static_cast<std::size_t>(payload & 0x7fffffffu) << 1 | payload >> 31].a;
  }
};

/// The table of tiles of one size.
template <class Record, class Opacity>
class CulledTable {
 public:
  using Buffer = HashBuffer<Record, Exclusive, Opacity>;

  Result<void> begin(const TileStream& stream, const HashBufferOptions& options, Opacity opacity) {
    if (buffer_ && buffer_->width() == stream.width() && buffer_->height() == stream.height()) {
      return buffer_->resize(options.cells);
    }
    auto made = Buffer::create(stream.width(), stream.height(), options, opacity);
    if (!made) return tl::unexpected(made.error());
    buffer_.emplace(std::move(*made));
    return {};
  }
  Buffer& buffer() { return *buffer_; }

 private:
  std::optional<Buffer> buffer_;
};

template <class Opacity>
class CulledRenderer {
 public:
  CulledRenderer(const Settings& settings, Opacity opacity)
      : load_(settings.load), opacity_(opacity) {
    options_.seed = settings.seed;
    options_.opacity_threshold = settings.opacity_threshold;
    options_.keep_nearest = settings.k;
    if (settings.variant == "random") options_.offsets = OffsetKind::kRandom;
    if (settings.variant == "farthest-point") options_.offsets = OffsetKind::kFarthestPoint;
  }

  Result<void> render(TileStream& stream, TileImage& image) {
    options_.cells = std::max(stream.pixel_count(), list_bytes::cells_at(load_, stream.size()));
    auto done = attempt(table_, stream, image, false);
    if (!done) return tl::unexpected(done.error());
    if (*done) return {};
    done = attempt(deep_, stream, image, true);
    if (!done) return tl::unexpected(done.error());
    return {};
  }

 private:
  /// @param last  fragments beyond the ages stay outside of the table
  template <class Record>
  Result<bool> attempt(CulledTable<Record, Opacity>& table, TileStream& stream, TileImage& image,
                       bool last) {
    if (auto begun = table.begin(stream, options_, opacity_); !begun) {
      return tl::unexpected(begun.error());
    }
    auto& buffer = table.buffer();
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      buffer.insert(static_cast<int>(pixel % kTileSide), static_cast<int>(pixel / kTileSide),
                    item.depth(), item.payload());
    });
    const bool fits_deep = stream.frame().colours.size() / 2 <= std::size_t{1} << 29;
    if (!last && buffer.failures() > 0 && fits_deep) return false;
    if (auto complete = buffer.finish(); !complete) return tl::unexpected(complete.error());
    Costs& costs = stream.costs();
    costs.kept = buffer.stored() + buffer.failures();
    costs.stored += stream.size() - buffer.dropped();
    costs.allocated_bytes = list_bytes::hash_table(buffer.cells().size(), buffer.max_ages().size(),
                                                   64, sizeof(buffer.max_ages()[0]));
    costs.formula_bytes =
        list_bytes::hash_table(options_.cells,
                               list_bytes::blocks(static_cast<std::uint64_t>(stream.width()),
                                                  static_cast<std::uint64_t>(stream.height())),
                               64, Record::kAgeBits > 8 ? 2u : 1u);
    blend(buffer, stream, image);
    costs.lost = stream.size() - visible_;
    return true;
  }

  template <class Buffer>
  void blend(const Buffer& buffer, TileStream& stream, TileImage& image) {
    std::uint64_t most = 0;
    visible_ = 0;
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      FrontToBack sum;
      std::uint64_t layers = 0;
      buffer.for_each(static_cast<int>(pixel % kTileSide), static_cast<int>(pixel / kTileSide),
                      [&](DepthItem item) {
                        sum.add(stream.colour(item));
                        ++layers;
                      });
      if (layers == 0) return;
      image.pixels[pixel] = sum.result();
      most = std::max(most, layers);
      visible_ += layers;
    });
    stream.costs().most_layers = most;
    stream.count_shaded(visible_);
  }

  double load_;
  Opacity opacity_;
  HashBufferOptions options_;
  CulledTable<Record64, Opacity> table_;
  CulledTable<Record64Deep, Opacity> deep_;
  std::uint64_t visible_ = 0;
};

Result<TileRenderer> make_culled(const FrameInfo& frame, const Settings& settings,
                                 const std::shared_ptr<const void>&) {
  Settings unbounded = settings;
  unbounded.k = 0;
  return renderer_of<CulledRenderer<OpacityOfFace>>(unbounded, OpacityOfFace{frame.colours.data()});
}

Result<TileRenderer> make_nearest(const FrameInfo&, const Settings& settings,
                                  const std::shared_ptr<const void>&) {
  return renderer_of<CulledRenderer<NoOpacity>>(settings, NoOpacity{});
}

constexpr std::string_view kHashCulledOffsets = "plane-first random farthest-point";

}  // namespace

const Technique kHash64Culled{
    .name = "ha64-culled",
    .title = "HA-buffer that drops fragments behind enough opacity",
    .paper = "Lefebvre, Hornus, Lasram 2013",
    .accuracy = Accuracy::kBounded,
    .variants = kHashCulledOffsets,
    .memory = "8 bytes a cell, one cell a pixel or fragments / load; 1 byte a 64 pixels",
    .fails =
        "leaves out what lies behind the opacity threshold; drops little if drawn back to front",
    .make = make_culled,
};
const Technique kHash64Nearest{
    .name = "ha64-nearest",
    .title = "HA-buffer that keeps the k nearest fragments of a pixel",
    .paper = "Lefebvre, Hornus, Lasram 2013",
    .accuracy = Accuracy::kBounded,
    .k_means = "fragments",
    .default_k = 8,
    .least_k = 1,
    .most_k = 1024,
    .variants = kHashCulledOffsets,
    .memory = "8 bytes a cell, one cell a pixel or fragments / load; 1 byte a 64 pixels",
    .fails = "loses all fragments behind the k-th",
    .make = make_nearest,
};

}  // namespace strata::transparency
