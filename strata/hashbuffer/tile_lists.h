#pragma once

#include <cstdint>
#include <type_traits>

#include "strata/core/depth_list.h"
#include "strata/hashbuffer/offsets.h"
#include "strata/hashbuffer/record.h"
#include "strata/raster/raster_target.h"

namespace strata {

/// Store of the crossings until they are sorted. kAuto: the one that measurements found faster for
/// the scene.
enum class StoreKind { kAuto, kHaBuffer, kCountScan };

/// A crossing without its triangle: depth << 1 | exit, 24 bits, which sorts like DepthItem without
/// the triangle. Serves depth limits up to 2^23, grids up to 32768 voxels deep.
using DepthKey = std::uint32_t;
/// Largest depth limit that DepthKey serves.
inline constexpr std::uint32_t kMaxDepthKeyLimit = std::uint32_t{1} << 23;

/// The sorted depth lists of one tile, in one of two forms. `Key` is DepthKey or DepthItem. The
/// memory belongs to the builder and is valid until its next tile.
template <class Key>
struct TileLists {
  /// First row of the tile that may hold fragments; lists before it are empty.
  int row_begin = 0;
  int row_end = 0;              ///< one past the last row that may hold fragments
  std::uint64_t fragments = 0;  ///< in all lists of the tile

  /// Planar form (when `planes` is set): the fragment of age a = 1..ages of pixel p is the record
  /// planes[(a - 1) * kTilePixels + p], present when its age field says a, absent when it is 0.
  /// Rows outside [row_begin, row_end) are undefined. Record: see TileRecord<Key>.
  const std::uint32_t* planes32 = nullptr;
  const std::uint64_t* planes64 = nullptr;  ///< the same for 64-bit records
  int ages = 0;                             ///< planes; the longest list

  /// Compressed rows (when `offsets` is set): kTilePixels + 1 offsets into `keys`.
  const std::uint32_t* offsets = nullptr;
  const Key* keys = nullptr;  ///< the lists, one after the other
};

/// Contents of a record in a tile's lists: Record32 stores DepthKeys in place of depths, Record64
/// stores DepthItems.
template <class Record>
using TileKey = std::conditional_t<Record::kPayloadBits == 0, DepthKey, DepthItem>;

/// The key in a record: nearness and payload are stored inverted, so that larger is nearer.
template <class Record>
[[nodiscard]] constexpr TileKey<Record> tile_key(typename Record::Word record) {
  return TileKey<Record>(Record::rank(static_cast<typename Record::Word>(~record)));
}

/// How the lists of tiles are built; no setting changes them.
struct TileStoreOptions {
  StoreKind store = StoreKind::kAuto;            ///< where crossings wait to be sorted
  OffsetKind offsets = OffsetKind::kPlaneFirst;  ///< of the HA-buffer
  std::uint64_t seed = 1;                        ///< of its offsets
};

}  // namespace strata
