#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "strata/core/depth_list.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/list_filter.h"
#include "strata/hashbuffer/tile_lists.h"
#include "strata/raster/lattice_mesh.h"

namespace strata {

/// Makes the lists of a mesh elsewhere than in the tiles of this process's threads: on a GPU. What
/// takes one (build_ldi(), VoxelizeOptions) gets the same lists, bit for bit (law 2).
///
/// One thread calls at a time, the one that gave it away.
class ListSource {
 public:
  virtual ~ListSource() = default;

  /// The mesh of the calls that follow, without a filter; borrowed until the next one.
  /// @return kLimit without the memory
  virtual Result<void> set_mesh(const LatticeMesh& mesh) = 0;
  /// True: lists() gives from now on what `filter` (borrowed) makes of the mesh's lists, bit for
  /// bit. False where this source leaves that to who takes its lists, which are the mesh's then.
  virtual bool use_filter(const TileListFilter& filter) {
    static_cast<void>(filter);
    return false;
  }
  /// The sorted lists of rows [v_begin, v_end) of `target`, as an image of those rows;
  /// world_from_image is left as the identity. @return kLimit without the memory, kCancelled
  virtual Result<LayeredDepthImage> lists(const RasterTarget& target, int v_begin, int v_end) = 0;
  /// Crossings of the mesh in the rows of the last lists(): those that came back, but for a filter.
  [[nodiscard]] virtual std::uint64_t crossings() const = 0;
  /// How many rows of `target` are best asked for at once: a multiple of kTileSide, at least that.
  [[nodiscard]] virtual int rows_at_once(const RasterTarget& target) const = 0;
};

/// A source, and this process's threads from its first failure on; a stop is none.
class ListSourceOrCpu final : public ListSource {
 public:
  /// Borrows `source`. @param on_failure told the failure, once
  ListSourceOrCpu(ListSource& source, Execution execution,
                  std::function<void(const Error&)> on_failure);

  Result<void> set_mesh(const LatticeMesh& mesh) override;
  bool use_filter(const TileListFilter& filter) override;
  Result<LayeredDepthImage> lists(const RasterTarget& target, int v_begin, int v_end) override;
  [[nodiscard]] std::uint64_t crossings() const override { return crossings_; }
  [[nodiscard]] int rows_at_once(const RasterTarget& target) const override;

 private:
  void give_up(const Error& error);
  ListSource* source_;  ///< null: it has failed
  Execution execution_;
  std::function<void(const Error&)> on_failure_;
  const LatticeMesh* mesh_ = nullptr;
  const TileListFilter* filter_ = nullptr;  ///< that the lists have gone through
  std::uint64_t crossings_ = 0;
};

/// Cuts rows of lists into tiles. Scratch of one thread.
class TileCutter {
 public:
  /// The lists of tile (tu, tv) of an image of which `rows` is a part: its row 0 is the image's
  /// `v_begin`, a multiple of kTileSide. Valid until the next call.
  TileLists<DepthItem> cut(const LayeredDepthImage& rows, int v_begin, int tu, int tv);

 private:
  std::vector<std::uint32_t> offsets_;
  std::vector<DepthItem> keys_;
};

}  // namespace strata
