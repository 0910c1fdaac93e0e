#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "raster/tile_bins.h"
#include "strata/hashbuffer/build_ldi.h"
#include "strata/hashbuffer/tile_lists.h"
#include "strata/voxelize/intervals.h"
#include "strata/voxelize/voxelize.h"
#include "voxelize/open/winding_field.h"
#include "voxelize/tile_walk.h"

// Lists along one axis -> intervals, tile row by tile row. Private to voxelize/.

namespace strata {

/// Turns a snapped mesh into intervals along one axis.
class SolidVoxelizer {
 public:
  /// Keeps references to `mesh`, `grid` and `field`, whose numbers are added to the mesh's winding
  /// numbers.
  static Result<SolidVoxelizer> create(const LatticeMesh& mesh, const VoxelGrid& grid, Axis axis,
                                       const VoxelizeOptions& options, const Execution& execution,
                                       const WindingField* field = nullptr);

  /// Sorts the triangles of rows [v_begin, v_end) into tiles. v_begin is a multiple of kTileSide.
  Result<void> prepare(int v_begin, int v_end, const Execution& execution);

  /// The intervals of rows [v_begin, v_end), which were prepared, or of rows among them. v_begin is
  /// a multiple of kTileSide. Adds to `report`.
  Result<VoxelIntervals> slab(int v_begin, int v_end, const Execution& execution,
                              VoxelizeReport& report);
  /// Takes a slab back: the next one of slab() is made in its memory.
  void reuse(VoxelIntervals&& slab) { spent_ = std::move(slab); }
  /// The filled part of voxels with options.rays x options.rays of the columns each, as labels.
  /// @param voxels their grid @param v_begin of columns, as v_end; a multiple of kTileSide * rays
  Result<VoxelIntervals> covered_slab(const VoxelGrid& voxels, int v_begin, int v_end,
                                      const Execution& execution, VoxelizeReport& report);

  [[nodiscard]] const RasterTarget& target() const { return target_; }

 private:
  struct Worker;
  struct Output;
  template <class Builder>
  Result<void> run_tile(Builder& builder, Worker& worker, int tu, int tv, Output& out,
                        const Execution& execution) const;
  template <class Key>
  void walk(const TileLists<Key>& lists, Worker& worker, int tu, int tv, Output& out,
            const Execution& execution) const;
  Result<void> run_source(const Execution& execution, Output& out) const;
  Result<void> run(Output& out, const Execution& execution, VoxelizeReport& report);

  const LatticeMesh* mesh_ = nullptr;
  const VoxelGrid* grid_ = nullptr;
  const WindingField* field_ = nullptr;
  VoxelizeOptions options_;
  RasterTarget target_;
  TileBins bins_;
  VoxelIntervals spent_;
  std::vector<std::shared_ptr<Worker>> workers_;  ///< scratch, kept from slab to slab
};

}  // namespace strata
