#include "raster/tile_bins.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>

namespace strata {
namespace {

/// The tiles that a triangle's box of pixel centres meets, as a half-open box of tiles; empty where
/// it meets none.
struct TileRect {
  std::uint16_t u0, v0, u1, v1;
};

TileRect tile_rect(const LatticeMesh& mesh, const glm::uvec3& triangle, const AxisFrame& frame,
                   const RasterTarget& target, const PixelRows& rows) {
  const glm::ivec3 &a = mesh.vertices[triangle.x], &b = mesh.vertices[triangle.y],
                   &c = mesh.vertices[triangle.z];
  const auto low = [&](int axis) { return std::min(std::min(a[axis], b[axis]), c[axis]); };
  const auto high = [&](int axis) { return std::max(std::max(a[axis], b[axis]), c[axis]); };
  const int u0 = std::max(0, first_pixel(low(frame.u)));
  const int u1 = std::min(target.width, end_pixel(high(frame.u)));
  const int v0 = std::max(rows.begin, first_pixel(low(frame.v)));
  const int v1 = std::min(rows.end, end_pixel(high(frame.v)));
  // No branch: small triangles miss all pixel centres too often and too irregularly to predict.
  const int covers = u0 < u1 && v0 < v1 ? 1 : 0;
  const auto tile = [covers](int pixel) {
    return static_cast<std::uint16_t>(static_cast<unsigned>(pixel * covers) / kTileSide);
  };
  return {tile(u0), tile(v0), static_cast<std::uint16_t>(tile(u1 - 1) + covers),
          static_cast<std::uint16_t>(tile(v1 - 1) + covers)};
}

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
  const AxisFrame frame(target.axis);
  const std::size_t count = mesh.triangles.size();

  // Counting sort: each part of the triangles counts by tile, the counts become cursors, each part
  // writes at its own cursors.
  const std::size_t parts = std::max<std::size_t>(
      1, std::min<std::size_t>(static_cast<std::size_t>(execution.thread_count()), count / 4096));
  // The last cursor of a part is for triangles in no tile, so that they need no branch.
  const std::size_t stride = tiles + 1;
  std::vector<std::uint64_t> cursors(parts * stride, 0);
  const auto rects = std::make_unique_for_overwrite<TileRect[]>(count);
  const auto row = static_cast<std::size_t>(bins.tiles_u);
  const std::size_t skipped = static_cast<std::size_t>(bins.first_v) * row;
  const auto for_each_tile = [&](const TileRect& rect, auto&& body) {
    const int width = rect.u1 - rect.u0, height = rect.v1 - rect.v0;
    if (width * height <= 1) return body(width > 0 ? rect.v0 * row + rect.u0 - skipped : tiles);
    for (std::size_t tv = rect.v0; tv < rect.v1; ++tv) {
      for (std::size_t tu = rect.u0; tu < rect.u1; ++tu) body(tv * row + tu - skipped);
    }
  };
  parallel_for(execution, parts, [&](std::size_t part, int) {
    std::uint64_t* counts = cursors.data() + part * stride;
    for (std::size_t i = count * part / parts; i < count * (part + 1) / parts; ++i) {
      rects[i] = tile_rect(mesh, mesh.triangles[i], frame, target, rows);
      for_each_tile(rects[i], [counts](std::size_t tile) { ++counts[tile]; });
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
      for_each_tile(rects[i], [&](std::size_t tile) {
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
