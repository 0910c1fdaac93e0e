#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

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

/// Lists of a pixel in the planar form: those of keys are apart by where rays enter and leave.
template <class Key>
inline constexpr std::size_t kSides = std::is_same_v<Key, DepthKey> ? 2 : 1;

/// The sorted depth lists of one tile, in one of two forms. `Key` is DepthKey or DepthItem. The
/// memory belongs to the builder and is valid until its next tile.
template <class Key>
struct TileLists {
  /// First row of the tile that may hold fragments; lists before it are empty.
  int row_begin = 0;
  int row_end = 0;              ///< one past the last row that may hold fragments
  std::uint64_t fragments = 0;  ///< in all lists of the tile

  /// Planar form (when `planes` is set): the fragment of age a = 1..ages of pixel p is the record
  /// planes[(a - 1) * kSides * kTilePixels + p], present when its age field says a, absent when it
  /// is 0. Of keys these are the crossings where rays enter; those where they leave have ages of
  /// their own, and lie kTilePixels behind. Rows outside [row_begin, row_end) are undefined.
  /// Record: see tile_key().
  const std::uint32_t* planes32 = nullptr;
  const std::uint64_t* planes64 = nullptr;  ///< the same for 64-bit records
  int ages = 0;                             ///< the longest list

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

/// Voxels first..last of a column that faces of one solid of a mesh pass through.
struct FaceRun {
  std::uint32_t solid = 0;  ///< see TileListFilter::solid_of()
  int first = 0;            ///< index along the column
  int last = 0;             ///< inclusive
};
/// Voxels first..last of a column.
struct VoxelRun {
  int first = 0;  ///< index along the column
  int last = 0;   ///< inclusive
};

/// Transforms the sorted lists of a tile before they are used, e.g. from the lists of a tree's
/// solids to the lists of its Boolean result. The output must be sorted as well.
class TileListFilter {
 public:
  virtual ~TileListFilter() = default;

  /// The scratch memory of one thread.
  class Worker {
   public:
    virtual ~Worker() = default;
    /// The filtered lists, as compressed rows; valid until the next call.
    virtual TileLists<DepthItem> apply(const TileLists<DepthItem>& lists) = 0;
    /// Appends the voxels of `faces` that the surface of the result may pass through: those in
    /// which the result depends on the solids with faces in the voxel, while all other solids are
    /// as at its centre. Appends runs in increasing order that do not touch. A filter that does not
    /// override solid_of() need not override this: the faces of one solid already are runs of this
    /// kind.
    /// @param lists of the tile, as apply() takes them
    /// @param faces of the column of pixel `pixel`, in any order of their solids
    virtual void surface(const TileLists<DepthItem>& lists, std::size_t pixel,
                         std::span<const FaceRun> faces, std::vector<VoxelRun>& kept) {
      (void)lists, (void)pixel;
      for (const FaceRun& run : faces) kept.push_back({run.first, run.last});  // knows no solids
    }
  };
  /// May be called by several threads at once.
  [[nodiscard]] virtual std::unique_ptr<Worker> worker() const = 0;
  /// True if the output is labelled: each crossing says what lies behind it. Behind an exit() lies
  /// nothing, behind any other crossing the part with the label triangle(). No list then has two
  /// crossings at the same depth. Two labels may follow each other without an exit between them.
  [[nodiscard]] virtual bool labelled() const { return false; }
  /// The solid of a triangle of the mesh; 0 if there is only one.
  [[nodiscard]] virtual std::uint32_t solid_of(std::uint32_t triangle) const {
    (void)triangle;
    return 0;
  }
};

/// Calls body(item) for each crossing of pixel `pixel` of a tile, in order.
template <class Body>
void for_each_item(const TileLists<DepthItem>& lists, std::size_t pixel, Body&& body) {
  if (lists.planes64 == nullptr) {
    for (std::uint32_t i = lists.offsets[pixel]; i < lists.offsets[pixel + 1]; ++i) {
      body(lists.keys[i]);
    }
    return;
  }
  const int row = static_cast<int>(pixel) / kTileSide;
  if (row < lists.row_begin || row >= lists.row_end) return;
  for (std::size_t age = 0; age < static_cast<std::size_t>(lists.ages); ++age) {
    const std::uint64_t record = lists.planes64[age * kTilePixels + pixel];
    if (record == 0) break;
    body(tile_key<Record64>(record));
  }
}

}  // namespace strata
