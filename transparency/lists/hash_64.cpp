#include <fmt/format.h>

#include "strata/hashbuffer/resize_policy.h"
#include "transparency/lists/blend_list.h"
#include "transparency/lists/list_techniques.h"
#include "transparency/lists/tile_hash.h"

// S. Lefebvre, S. Hornus, A. Lasram, "HA-Buffer: Coherent Hashing for single-pass A-buffer" (2013):
// the fragments of a pixel share a probe sequence, on which a maximum sorts them; a second pass
// over the pixels walks the sequences and blends.
// We differ: equal fragments are kept; traversal visits the largest age, too; a tile whose
// fragments do not fit is built again with more cells, or with records of wider ages where its
// pixels have more fragments than the record can count.

namespace strata::transparency {
namespace {

/// [age:12 | nearness:24 | payload:28]: at most 4095 layers a pixel; triangles below 2^27.
struct Record64Deepest : BasicRecord<std::uint64_t, 12, 28> {};

/// How large the table is, and what happens if it is too small.
enum class Sizing {
  kByLoad,  ///< as settings.load has it; built again if a fragment does not fit
  kFixed,   ///< settings.k cells a pixel; fragments that do not fit are lost
  kGrown,   ///< one cell a pixel at first, then as the load of the frame before demands
};

OffsetKind kind_of(const Settings& settings) {
  if (settings.variant == "random") return OffsetKind::kRandom;
  if (settings.variant == "farthest-point") return OffsetKind::kFarthestPoint;
  return OffsetKind::kPlaneFirst;
}

template <class Concurrency, Sizing sizing>
class HashRenderer {
 public:
  explicit HashRenderer(const Settings& settings) : settings_(settings), kind_(kind_of(settings)) {}

  Result<void> render(TileStream& stream, TileImage& image) {
    std::uint64_t cells = first_cells(stream);
    for (int ages = 0;;) {
      bool done = false;
      if (ages == 0) {
        done = attempt(table_, stream, image, cells);
      } else {
        if (auto good = check_triangles(stream, ages); !good) return good;
        done = ages == 1 ? attempt(deep_, stream, image, cells)
                         : attempt(deepest_, stream, image, cells);
      }
      if (done) return {};
      // A table that fails though half of it is empty lacks ages, not cells.
      if (stream.size() >= cells / 2) {
        cells = next_cells_;
      } else if (++ages == 3) {
        return fail(ErrorCode::kLimit, "ha64: a pixel has more than {} fragments",
                    Record64Deepest::kAgeMax);
      }
    }
  }

 private:
  [[nodiscard]] std::uint64_t first_cells(const TileStream& stream) const {
    const std::uint64_t pixels = stream.pixel_count();
    if (sizing == Sizing::kGrown) return pixels;
    if (sizing == Sizing::kFixed) return settings_.k * pixels;
    return std::max(pixels, list_bytes::cells_at(settings_.load, stream.size()));
  }
  static Result<void> check_triangles(const TileStream& stream, int ages) {
    const std::uint64_t most = std::uint64_t{1} << (ages == 1 ? 29 : 27);
    if (stream.frame().colours.size() / 2 <= most) return {};
    return fail(ErrorCode::kLimit,
                "ha64: a pixel has more fragments than 8 bits of age count, and wider ages leave "
                "room for {} triangles, got {}",
                most, stream.frame().colours.size() / 2);
  }

  /// Builds the table and, if all is well, blends. @return whether the tile is done
  template <class Record>
  bool attempt(TileHash<Record>& table, TileStream& stream, TileImage& image, std::uint64_t cells) {
    table.begin(stream, cells, kind_, settings_.seed);
    Costs& costs = stream.costs();
    std::uint64_t swaps = 0;
    table.template insert_all<Concurrency>(stream, [&] { ++swaps; });
    const std::uint64_t failures = table.failures();
    // A losing maximum is a load; each swap is one compare-and-swap more.
    costs.comparisons += failures * table.age_limit() + (Concurrency::kAnyThread ? swaps : 0);
    costs.stored += stream.size() - failures;
    next_cells_ = failures > 0 ? rebuilt_cells(stream.size(), cells) : cells;
    bool done = failures == 0 || sizing == Sizing::kFixed;
    if (done) costs.kept = stream.size() - failures;
    if (sizing == Sizing::kGrown && done) {
      next_cells_ = next_frame_cells(cells, stream.pixel_count(), stream.size());
      done = next_cells_ == cells;
    }
    if (done) {
      costs.comparisons += blend(table, stream, image);
      costs.lost = failures;
      costs.allocated_bytes = table.bytes();
      costs.formula_bytes = list_bytes::hash_table(cells, table.blocks(), 8 * sizeof(Bits),
                                                   TileHash<Record>::kAgeBytes);
    } else {
      costs.comparisons += table.ages();
    }
    if (sizing == Sizing::kGrown) {
      costs.kept = table.clear_and_count();
    } else {
      table.clear();
    }
    return done;
  }

  /// @return probes of the records in the table: each came to the cells of all ages up to its own
  template <class Record>
  static std::uint64_t blend(const TileHash<Record>& table, TileStream& stream, TileImage& image) {
    std::uint64_t most = 0, shaded = 0, probes = 0;
    const glm::vec4* colours = stream.frame().colours.data();
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      FrontToBack4 sum;
      std::uint64_t layers = 0;
      table.for_each(pixel, [&](std::size_t, typename Record::Word record, unsigned age) {
        sum.add(colours[face_of(Record::item(record))]);
        ++layers;
        probes += age;
        return true;
      });
      if (layers == 0) return;
      sum.write(image.pixels[pixel]);
      most = std::max(most, layers);
      shaded += layers;
    });
    stream.costs().most_layers = most;
    stream.count_shaded(shaded);
    return probes;
  }

  using Bits = Record64::Word;

  Settings settings_;
  OffsetKind kind_;
  TileHash<Record64> table_;
  TileHash<Record64Deep> deep_;
  TileHash<Record64Deepest> deepest_;
  std::uint64_t next_cells_ = 0;
};

template <class Concurrency, Sizing sizing>
Result<TileRenderer> make_hash_64(const FrameInfo&, const Settings& settings,
                                  const std::shared_ptr<const void>&) {
  return renderer_of<HashRenderer<Concurrency, sizing>>(settings);
}

constexpr std::string_view kPaper = "Lefebvre, Hornus, Lasram 2013";
constexpr std::string_view kOffsets = "plane-first random farthest-point";

}  // namespace

const Technique kHash64{
    .name = "ha64",
    .title = "HA-buffer with 64-bit records",
    .paper = kPaper,
    .variants = kOffsets,
    .memory = "8 bytes a cell, one cell a pixel or fragments / load; 1 byte a 64 pixels",
    .fails = "insertion is slow in tables that are more than 80 % full, and for deep pixels",
    .make = make_hash_64<Exclusive, Sizing::kByLoad>,
};
const Technique kHash64Cas{
    .name = "ha64-cas",
    .title = "HA-buffer whose 64-bit maximum is made of compare-and-swap, which is counted",
    .paper = kPaper,
    .variants = kOffsets,
    .memory = kHash64.memory,
    .fails = kHash64.fails,
    .make = make_hash_64<Concurrent, Sizing::kByLoad>,
};
const Technique kHash64Grown{
    .name = "ha64-grown",
    .title = "HA-buffer that grows by a quarter a side from 80 % on and shrinks below 30 %",
    .paper = kPaper,
    .variants = kOffsets,
    .memory = kHash64.memory,
    .fails = "the frame is rendered again until the size of the table is right",
    .make = make_hash_64<Exclusive, Sizing::kGrown>,
};
const Technique kHash64Fixed{
    .name = "ha64-fixed",
    .title = "HA-buffer of k cells a pixel that keeps what fits: the nearest of each pixel",
    .paper = kPaper,
    .accuracy = Accuracy::kBounded,
    .k_means = "cells a pixel",
    .default_k = 8,
    .least_k = 1,
    .most_k = 255,
    .variants = kOffsets,
    .memory = "8 k bytes a pixel; 1 byte a 64 pixels",
    .fails = "loses the farthest fragments of pixels that meet a full table",
    .make = make_hash_64<Exclusive, Sizing::kFixed>,
};

}  // namespace strata::transparency
