#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "strata/core/depth_list.h"
#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/tile_lists.h"
#include "strata/raster/lattice_mesh.h"

namespace strata {

/// Computes the lists of a mesh outside of this process's threads, such as on a GPU. Users of a
/// source (build_ldi(), VoxelizeOptions) get the same lists, bit for bit (law 2).
///
/// Only one thread at a time may call it: the one that passed it on.
class ListSource {
 public:
  virtual ~ListSource() = default;

  /// Sets the mesh for the calls that follow and removes the filter. The mesh is borrowed until the
  /// next call.
  /// @return kLimit without the memory
  virtual Result<void> set_mesh(const LatticeMesh& mesh) = 0;
  /// Returns true if lists() from now on applies `filter` (borrowed), bit for bit. Returns false if
  /// this source cannot apply it; lists() then returns the unfiltered lists and the caller must
  /// filter.
  virtual bool use_filter(const TileListFilter& filter) {
    static_cast<void>(filter);
    return false;
  }
  /// The sorted lists of rows [v_begin, v_end) of `target`, as an image of those rows;
  /// world_from_image is left as the identity. @return kLimit without the memory, kCancelled
  virtual Result<LayeredDepthImage> lists(const RasterTarget& target, int v_begin, int v_end) = 0;
  /// Crossings of the mesh in the rows of the last lists(), before the filter.
  [[nodiscard]] virtual std::uint64_t crossings() const = 0;
  /// The best number of rows of `target` per call: a multiple of kTileSide, at least kTileSide.
  [[nodiscard]] virtual int rows_at_once(const RasterTarget& target) const = 0;
};

/// Uses a source until it first fails (cancellation is not a failure), then this process's threads.
class ListSourceOrCpu final : public ListSource {
 public:
  /// Borrows `source`. @param on_failure called once with the failure
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
  const TileListFilter* filter_ = nullptr;  ///< already applied to the lists
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

/// The sorted depth lists of a snapped mesh seen along an axis: every crossing of every pixel's
/// ray, with its triangle. Same bits for any store, offsets, number of threads and order of
/// triangles (up to the triangles' numbers). world_from_image is left as the identity. `filter`, if
/// given, transforms the lists tile by tile.
/// @return kLimit when the lists outgrow execution.memory_limit or memory, kCancelled
Result<LayeredDepthImage> build_ldi(const LatticeMesh& mesh, const RasterTarget& target,
                                    const TileStoreOptions& options = {},
                                    const Execution& execution = {},
                                    const TileListFilter* filter = nullptr);

/// The same lists from `source`.
Result<LayeredDepthImage> build_ldi(ListSource& source, const LatticeMesh& mesh,
                                    const RasterTarget& target, const Execution& execution = {},
                                    const TileListFilter* filter = nullptr);

/// Applies `filter` to the lists of an image of rows. @return kLimit without the memory, kCancelled
Result<LayeredDepthImage> filter_lists(const LayeredDepthImage& rows, const TileListFilter& filter,
                                       const Execution& execution = {});

/// The image of the rays through the voxel columns of a grid along `axis`.
[[nodiscard]] RasterTarget raster_target(const VoxelGrid& grid, Axis axis);

/// The world_from_image of such lists (see LayeredDepthImage).
[[nodiscard]] glm::dmat4 world_from_image(const VoxelGrid& grid, Axis axis);

}  // namespace strata
