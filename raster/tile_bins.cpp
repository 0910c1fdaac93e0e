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
    constexpr std::size_t kChunk = 32768;
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

  [[nodiscard]] Box box(std::size_t triangle) const {
    const glm::uvec3& t = triangles_[triangle];
    const VertexPixels a = pixels(t.x), b = pixels(t.y), c = pixels(t.z);
    const VertexPixels least = a < b ? a : b;
    const auto bits = std::bit_cast<std::uint64_t>(least < c ? least : c) ^ kBias;
    const auto part = [bits](int i) {
      return static_cast<std::uint32_t>(bits >> i * 16) & 0xffffu;
    };
    return {part(0), part(1), part(2) + beyond_[0], part(3) + beyond_[1]};
  }

  /// Calls body(tile) for each tile that the triangle's box meets, body(number of tiles) if there
  /// is none.
  template <class Body>
  void for_each_tile(std::size_t triangle, const TileBins& bins, Body&& body) const {
    const Box box = this->box(triangle);
    const auto row = static_cast<std::size_t>(bins.tiles_u);
    const std::size_t skipped = static_cast<std::size_t>(bins.first_v) * row;
    const std::size_t u0 = box.u0 / kTileSide, v0 = box.v0 / kTileSide;
    const std::size_t u1 = (box.u1 - 1) / kTileSide, v1 = (box.v1 - 1) / kTileSide;
    const bool covers = box.covers();
    // One branch, for the few triangles in several tiles: which ones miss all pixel centres cannot
    // be predicted.
    if (covers & ((u0 != u1) | (v0 != v1))) {
      for (std::size_t tv = v0; tv <= v1; ++tv) {
        for (std::size_t tu = u0; tu <= u1; ++tu) body(tv * row + tu - skipped);
      }
    } else {
      body(covers ? v0 * row + u0 - skipped : row * static_cast<std::size_t>(bins.tiles_v));
    }
  }

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
  [[nodiscard]] VertexPixels pixels(std::uint32_t vertex) const {
    return std::bit_cast<VertexPixels>(vertices_[vertex]);
  }

  const glm::uvec3* triangles_;
  std::uint32_t beyond_[2];  ///< 1 where the image has more than kMost pixels
  std::unique_ptr<std::uint64_t[]> vertices_;
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
  const auto for_each_tile = [&](std::size_t triangle, auto&& body) {
    boxes.for_each_tile(triangle, bins, body);
  };
  parallel_for(execution, parts, [&](std::size_t part, int) {
    std::uint64_t* counts = cursors.data() + part * stride;
    for (std::size_t i = count * part / parts; i < count * (part + 1) / parts; ++i) {
      for_each_tile(i, [counts](std::size_t tile) { ++counts[tile]; });
    }
  });
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
  bins.triangles.resize(sum + parts);  // each part's place for triangles in no tile, cut off below
  parallel_for(execution, parts, [&](std::size_t part, int) {
    std::uint64_t* cursor = cursors.data() + part * stride;
    cursor[tiles] = sum + part;
    for (std::size_t i = count * part / parts; i < count * (part + 1) / parts; ++i) {
      for_each_tile(i, [&](std::size_t tile) {
        bins.triangles[cursor[tile]] = static_cast<std::uint32_t>(i);
        cursor[tile] += tile < tiles ? 1 : 0;
      });
    }
  });
  bins.triangles.resize(sum);
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return bins;
}

}  // namespace strata
