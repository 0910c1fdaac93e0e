#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "raster/tile_bins.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/tile_lists.h"

namespace strata {

/// Planes of a tile's table, at most: deeper pixels are rare enough to scatter. No list of a tile
/// in the planar form is longer, those of keys that enter and that leave together.
inline constexpr int kMaxPlanes = 64;

/// Rasterizes the triangles of one tile after another into a tile-private store and hands out the
/// sorted lists. One builder serves one thread and keeps its memory from tile to tile.
///
/// The default store is the HA-buffer (S. Lefebvre, S. Hornus, A. Lasram: HA-Buffer: Coherent
/// Hashing for single-pass A-buffer, 2013) with plain stores. With plane-first offsets the cells of
/// age a of all pixels are a plane of the table while planes last, so neighbouring pixels insert
/// side by side, a vector at a time, and meet only fragments of their own list; beyond the planes
/// offsets are random and fragments of different pixels compete as in the paper.
template <class Record>
class TileBuilder {
 public:
  using Key = TileKey<Record>;

  explicit TileBuilder(const TileStoreOptions& options = {});
  TileBuilder(TileBuilder&&) noexcept;
  TileBuilder& operator=(TileBuilder&&) noexcept;
  ~TileBuilder();

  /// The lists of tile (tu, tv). @return kLimit when memory is exhausted.
  Result<TileLists<Key>> build(const LatticeMesh& mesh, const RasterTarget& target,
                               std::span<const std::uint32_t> triangles, int tu, int tv);

  [[nodiscard]] std::uint64_t rebuilt_tiles() const;  ///< tiles that did not fit at first
  [[nodiscard]] std::uint64_t memory_bytes() const;   ///< held now

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

using KeyTileBuilder = TileBuilder<Record32>;
using ItemTileBuilder = TileBuilder<Record64>;

}  // namespace strata
