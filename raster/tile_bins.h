#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "raster/triangle_setup.h"
#include "strata/core/execution.h"
#include "strata/raster/lattice_mesh.h"

namespace strata {

/// Which triangles may cover a pixel of which tile, by their boxes. Few triangles whose boxes hold
/// no pixel centre are in a tile, with their neighbours in the mesh; where an image has
/// kMaxGridSide pixels a side, some outside of it are in tiles of its border.
struct TileBins {
  int tiles_u = 0, tiles_v = 0;
  int first_v = 0;                     ///< the first row of tiles
  std::vector<std::uint32_t> offsets;  ///< tiles_u * tiles_v + 1
  /// Indices into LatticeMesh::triangles, offsets.back() of them, in no fixed order.
  std::unique_ptr<std::uint32_t[]> triangles;

  [[nodiscard]] std::span<const std::uint32_t> tile(int tu, int tv) const {
    const std::size_t i =
        static_cast<std::size_t>(tv - first_v) * static_cast<std::size_t>(tiles_u) +
        static_cast<std::size_t>(tu);
    return {triangles.get() + offsets[i], offsets[i + 1] - offsets[i]};
  }
};

/// Rows of pixels [begin, end).
struct PixelRows {
  int begin = 0, end = 0;
};

/// Sorts the triangles of `mesh` into the tiles of `target`.
/// @param rows  those that tiles are wanted of; begin is a multiple of kTileSide
/// @return kLimit when more than 2^32 - 1 references would be needed.
Result<TileBins> bin_triangles(const LatticeMesh& mesh, const RasterTarget& target,
                               const PixelRows& rows, const Execution& execution = {});
/// The same of all rows.
inline Result<TileBins> bin_triangles(const LatticeMesh& mesh, const RasterTarget& target,
                                      const Execution& execution = {}) {
  return bin_triangles(mesh, target, {0, target.height}, execution);
}

}  // namespace strata
