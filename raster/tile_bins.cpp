#include "raster/tile_bins.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <memory>
#include <utility>

namespace strata {
namespace {

/// A number for each vertex: the first pixel at or beyond it and the end of those before it, along
/// u and v. [end v:16 | end u:16 | first v:16 | first u:16], with the ends inverted and all biased,
/// so that the smallest signed numbers of three vertices are those of their triangle.
using VertexPixels = std::int16_t __attribute__((vector_size(8)));

constexpr std::uint64_t kBias = 0x7fff'7fff'8000'8000;

/// The boxes of pixel centres of triangles, each in a few instructions: vertices are shared.
class PixelBoxes {
 public:
  /// Pixels along u and v that may be covered; none where an end is not beyond its first.
  struct Box {
    std::uint32_t u0, v0, u1, v1;
    [[nodiscard]] bool covers() const { return (u0 < u1) & (v0 < v1); }
  };

  PixelBoxes(const LatticeMesh& mesh, const RasterTarget& target, const PixelRows& rows,
             const Execution& execution)
      : triangles_(mesh.triangles.data()),
        beyond_{target.width > kMost ? 1u : 0u, rows.end > kMost ? 1u : 0u},
        vertices_(std::make_unique_for_overwrite<std::uint64_t[]>(mesh.vertices.size())) {
    constexpr std::size_t kChunk = 4096;
    const std::size_t count = mesh.vertices.size();
    const AxisFrame frame(target.axis);
    parallel_for(execution, (count + kChunk - 1) / kChunk, [&](std::size_t chunk, int) {
      const std::size_t end = std::min(count, (chunk + 1) * kChunk);
      for (std::size_t i = chunk * kChunk; i < end; ++i) {
        const glm::ivec3& p = mesh.vertices[i];
        vertices_[i] = along(p[frame.u], {0, target.width}, beyond_[0]) |
                       along(p[frame.v], rows, beyond_[1]) << 16;
      }
    });
  }

  /// What box() needs.
  struct View {
    const glm::uvec3* triangles;
    const std::uint64_t* vertices;
    std::uint32_t beyond_u, beyond_v;  ///< 1 where the image has more than kMost pixels

    /// Around `count` triangles.
    template <std::size_t count = 1>
    [[nodiscard]] Box box(std::size_t first) const {
      const auto pixels = [&](std::uint32_t vertex) {
        return std::bit_cast<VertexPixels>(vertices[vertex]);
      };
      VertexPixels least = pixels(triangles[first].x);
      for (std::size_t i = 0; i < count; ++i) {
        const glm::uvec3& t = triangles[first + i];
        const VertexPixels a = pixels(t.x), b = pixels(t.y), c = pixels(t.z);
        const VertexPixels ab = a < b ? a : b;
        const VertexPixels all = ab < c ? ab : c;
        least = least < all ? least : all;
      }
      const auto bits = std::bit_cast<std::uint64_t>(least) ^ kBias;
      const auto part = [bits](int i) {
        return static_cast<std::uint32_t>(bits >> i * 16) & 0xffffu;
      };
      return {part(0), part(1), part(2) + beyond_u, part(3) + beyond_v};
    }
  };
  [[nodiscard]] View view() const { return {triangles_, vertices_.get(), beyond_[0], beyond_[1]}; }

 private:
  /// The most pixels whose ends fit. The ends of one pixel more are stored one less, so that
  /// triangles outside of the image count as at its border.
  static constexpr int kMost = 65535;

  static std::uint64_t along(std::int32_t at, const PixelRows& pixels, std::uint32_t beyond) {
    const std::int32_t less = static_cast<std::int32_t>(beyond), most = pixels.end - less;
    const std::int32_t first = (at + kLatticeSteps / 2 - 1) >> kLatticeBits;
    const std::int32_t end = ((at + kLatticeSteps / 2) >> kLatticeBits) - less;
    const auto stored = [&](std::int32_t pixel) {
      return static_cast<std::uint64_t>(std::max(pixels.begin, std::min(pixel, most)));
    };
    return (stored(first) | stored(end) << 32) ^ (kBias & 0x0000'ffff'0000'ffff);
  }

  const glm::uvec3* triangles_;
  std::uint32_t beyond_[2];  ///< 1 where the image has more than kMost pixels
  std::unique_ptr<std::uint64_t[]> vertices_;
};

/// The tiles of a range of triangles: which one has a triangle, and which triangles have several.
class TilesOfRange {
 public:
  /// A triangle whose box meets no tile has the number behind the last tile.
  TilesOfRange(const PixelBoxes& boxes, const TileBins& bins, std::size_t begin, std::size_t end)
      : boxes_(&boxes),
        begin_(begin),
        row_(static_cast<std::uint32_t>(bins.tiles_u)),
        skipped_(static_cast<std::uint32_t>(bins.first_v) * row_),
        none_(row_ * static_cast<std::uint32_t>(bins.tiles_v)),
        tiles_(std::make_unique_for_overwrite<std::uint32_t[]>(end - begin)),
        several_(std::make_unique_for_overwrite<Several[]>(end - begin)),
        count_(end - begin) {}

  /// Adds the triangles to `counts` of tiles.
  void count(std::uint64_t* counts) {
    const PixelBoxes::View boxes = boxes_->view();
    const std::size_t end = count_, begin = begin_;
    std::uint32_t* const tiles = tiles_.get();
    Several* several = several_.get();  // no member: another thread reads its neighbours
    const auto count_one = [&](std::size_t at) {
      // No branch: which triangles miss all pixel centres, or meet several tiles, cannot be
      // predicted.
      const Place of = place(boxes.box(begin + at));
      tiles[at] = of.tile;
      ++counts[of.tile];
      *several = {static_cast<std::uint32_t>(begin + at), of.first};
      several += of.several ? 1 : 0;
    };
    std::size_t i = 0;
    for (; i + kGroup <= end; i += kGroup) {
      // Neighbours in the mesh mostly lie in one tile.
      const Place all = place(boxes.box<kGroup>(begin + i));
      if (all.several) {
        for (std::size_t k = i; k < i + kGroup; ++k) count_one(k);
      } else {
        std::fill_n(tiles + i, kGroup, all.tile);
        counts[all.tile] += kGroup;
      }
    }
    for (; i < end; ++i) count_one(i);
    several_count_ = static_cast<std::size_t>(several - several_.get());
    for_each_of_several([counts](std::uint32_t tile, std::uint32_t) { ++counts[tile]; });
  }
  /// Writes the triangles to where the cursors of their tiles are.
  void write(std::uint64_t* cursors, std::uint32_t* triangles) const {
    const std::uint32_t none = none_;
    const std::size_t end = count_, begin = begin_;
    const std::uint32_t* const tiles = tiles_.get();
    const auto write_some = [=](std::size_t first, std::size_t count) {
      const std::uint32_t tile = tiles[first];
      const std::uint64_t at = cursors[tile];
      cursors[tile] = at + (tile < none ? count : 0);
      for (std::size_t k = 0; k < count; ++k) {
        triangles[at + k] = static_cast<std::uint32_t>(begin + first + k);
      }
    };
    std::size_t i = 0;
    for (; i + kGroup <= end; i += kGroup) {
      if ((tiles[i] == tiles[i + 1]) & (tiles[i] == tiles[i + 2]) & (tiles[i] == tiles[i + 3])) {
        write_some(i, kGroup);
      } else {
        for (std::size_t k = i; k < i + kGroup; ++k) write_some(k, 1);
      }
    }
    for (; i < end; ++i) write_some(i, 1);
    for_each_of_several([=](std::uint32_t tile, std::uint32_t triangle) {
      const std::uint64_t at = cursors[tile];
      triangles[at] = triangle;
      cursors[tile] = at + (tile < none ? 1 : 0);
    });
  }
  /// Triangles that are looked at together.
  static constexpr std::size_t kGroup = 4;

 private:
  struct Place {
    std::uint32_t tile;   ///< the only one, or none_
    std::uint32_t first;  ///< of several, as Several has it
    bool several;
  };
  /// A triangle in several tiles.
  struct Several {
    std::uint32_t triangle;
    std::uint32_t first;  ///< [more than two along a side:1 | two along v:1 | along u:1 | tile:29]
  };
  static constexpr std::uint32_t kAlongU = std::uint32_t{1} << 29, kAlongV = kAlongU << 1,
                                 kMore = kAlongV << 1;
  [[nodiscard]] Place place(const PixelBoxes::Box& box) const {
    const std::uint32_t u0 = box.u0 / kTileSide, v0 = box.v0 / kTileSide;
    const std::uint32_t u1 = (box.u1 - 1) / kTileSide, v1 = (box.v1 - 1) / kTileSide;
    const bool covers = box.covers(), one = (u0 == u1) & (v0 == v1);
    const std::uint32_t first = v0 * row_ + u0 - skipped_;
    const std::uint32_t sides = (u0 != u1 ? kAlongU : 0) | (v0 != v1 ? kAlongV : 0) |
                                (((u1 - u0 > 1) | (v1 - v0 > 1)) ? kMore : 0);
    return {(covers & one) ? first : none_, first | sides, covers && !one};
  }
  /// Calls body(tile, triangle) for the tiles of those triangles, and some of them with none_.
  template <class Body>
  void for_each_of_several(Body&& body) const {
    for (const Several& several : std::span(several_.get(), several_count_)) {
      const std::uint32_t triangle = several.triangle;
      if (several.first < kMore) {
        // No branch: which of the four it meets cannot be predicted.
        const bool u = (several.first & kAlongU) != 0, v = (several.first & kAlongV) != 0;
        const std::uint32_t tile = several.first & (kAlongU - 1);
        body(tile, triangle);
        body(u ? tile + 1 : none_, triangle);
        body(v ? tile + row_ : none_, triangle);
        body((u & v) ? tile + row_ + 1 : none_, triangle);
        continue;
      }
      const PixelBoxes::Box box = boxes_->view().box(triangle);
      for (std::uint32_t tv = box.v0 / kTileSide; tv <= (box.v1 - 1) / kTileSide; ++tv) {
        for (std::uint32_t tu = box.u0 / kTileSide; tu <= (box.u1 - 1) / kTileSide; ++tu) {
          body(tv * row_ + tu - skipped_, triangle);
        }
      }
    }
  }

  const PixelBoxes* boxes_;
  std::size_t begin_;
  std::uint32_t row_, skipped_, none_;
  std::unique_ptr<std::uint32_t[]> tiles_;
  std::unique_ptr<Several[]> several_;
  std::size_t count_, several_count_ = 0;
};

/// Makes places of the counts of each part, by tile and then by part. The last count of a part is
/// of no tile. @param offsets  of the tiles; the last one is left @return the sum of the counts
std::uint64_t to_cursors(std::vector<std::uint64_t>& counts, std::size_t parts,
                         std::vector<std::uint32_t>& offsets) {
  const std::size_t stride = offsets.size();
  std::uint64_t sum = 0;
  for (std::size_t tile = 0; tile + 1 < stride; ++tile) {
    offsets[tile] = static_cast<std::uint32_t>(sum);
    for (std::size_t part = 0; part < parts; ++part) {
      sum += std::exchange(counts[part * stride + tile], sum);
    }
  }
  return sum;
}

}  // namespace

Result<TileBins> bin_triangles(const LatticeMesh& mesh, const RasterTarget& target,
                               const PixelRows& rows, const Execution& execution) {
  TileBins bins;
  bins.tiles_u = (target.width + kTileSide - 1) / kTileSide;
  bins.first_v = rows.begin / kTileSide;
  bins.tiles_v = (rows.end + kTileSide - 1) / kTileSide - bins.first_v;
  const std::size_t tiles =
      static_cast<std::size_t>(bins.tiles_u) * static_cast<std::size_t>(bins.tiles_v);
  const std::size_t count = mesh.triangles.size();
  const PixelBoxes boxes(mesh, target, rows, execution);
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");

  // Counting sort: each part of the triangles counts by tile, the counts become cursors, each part
  // writes at its own cursors.
  const std::size_t parts = std::max<std::size_t>(
      1, std::min<std::size_t>(static_cast<std::size_t>(execution.thread_count()), count / 4096));
  // The last cursor of a part is for triangles in no tile, so that they need no branch.
  const std::size_t stride = tiles + 1;
  std::vector<std::uint64_t> cursors(parts * stride, 0);
  std::vector<TilesOfRange> ranges;
  for (std::size_t part = 0; part < parts; ++part) {
    ranges.emplace_back(boxes, bins, count * part / parts, count * (part + 1) / parts);
  }
  parallel_for(execution, parts,
               [&](std::size_t part, int) { ranges[part].count(cursors.data() + part * stride); });
  bins.offsets.resize(tiles + 1);
  const std::uint64_t sum = to_cursors(cursors, parts, bins.offsets);
  if (sum > std::numeric_limits<std::uint32_t>::max()) {
    return fail(
        ErrorCode::kLimit,
        "{} triangles meet {} tiles of {} pixels in {} places, more than 2^32 - 1: split the "
        "grid or the mesh",
        count, tiles, kTilePixels, sum);
  }
  bins.offsets[tiles] = static_cast<std::uint32_t>(sum);
  // Each part has a place behind the others for triangles in no tile.
  bins.triangles =
      std::make_unique_for_overwrite<std::uint32_t[]>(sum + parts * TilesOfRange::kGroup);
  parallel_for(execution, parts, [&](std::size_t part, int) {
    std::uint64_t* cursor = cursors.data() + part * stride;
    cursor[tiles] = sum + part * TilesOfRange::kGroup;
    ranges[part].write(cursor, bins.triangles.get());
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return bins;
}

}  // namespace strata
