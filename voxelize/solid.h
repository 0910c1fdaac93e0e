#pragma once

#include <cstdint>
#include <vector>

#include "raster/tile_bins.h"
#include "voxelize/tile_walk.h"
#include "voxelize/voxelize.h"

// Lists along one axis -> intervals, tile row by tile row. Private to voxelize/.

namespace strata {

/// Marks columns whose winding number does not return to 0; one word of 64 columns a tile row.
class ColumnMarks {
 public:
  ColumnMarks() = default;
  ColumnMarks(int tiles_u, int rows)
      : tiles_u_(tiles_u),
        words_(static_cast<std::size_t>(tiles_u) * static_cast<std::size_t>(rows)) {}
  [[nodiscard]] std::uint64_t& word(int tile_u, int v) {
    return words_[static_cast<std::size_t>(v) * static_cast<std::size_t>(tiles_u_) +
                  static_cast<std::size_t>(tile_u)];
  }
  [[nodiscard]] bool marked(int u, int v) const {
    return (words_[static_cast<std::size_t>(v) * static_cast<std::size_t>(tiles_u_) +
                   static_cast<std::size_t>(u / 64)] >>
                (u % 64) &
            1) != 0;
  }

 private:
  int tiles_u_ = 0;
  std::vector<std::uint64_t> words_;
};

/// Turns a snapped mesh into intervals along one axis.
class SolidVoxelizer {
 public:
  /// Sorts the triangles into tiles. Keeps references to `mesh` and `grid`.
  static Result<SolidVoxelizer> create(const LatticeMesh& mesh, const VoxelGrid& grid, Axis axis,
                                       const VoxelizeOptions& options, const Execution& execution);

  /// The intervals of rows [v_begin, v_end). v_begin is a multiple of kTileSide. Adds to `report`,
  /// and marks unbalanced columns when `marks` (of all rows) is given.
  Result<VoxelIntervals> slab(int v_begin, int v_end, const Execution& execution,
                              VoxelizeReport& report, ColumnMarks* marks = nullptr);

  [[nodiscard]] const RasterTarget& target() const { return target_; }

 private:
  struct Worker;
  template <class Builder>
  Result<void> run_tile(Builder& builder, Worker& worker, int tu, int tv, int v_begin,
                        VoxelIntervals& out, ColumnMarks* marks) const;
  template <class Key>
  void walk(const TileLists<Key>& lists, Worker& worker, int tu, int tv, int v_begin,
            VoxelIntervals& out, ColumnMarks* marks) const;
  Result<void> run_source(int v_begin, const Execution& execution, VoxelIntervals& out,
                          ColumnMarks* marks) const;

  const LatticeMesh* mesh_ = nullptr;
  const VoxelGrid* grid_ = nullptr;
  VoxelizeOptions options_;
  RasterTarget target_;
  TileBins bins_;
  std::vector<std::shared_ptr<Worker>> workers_;  ///< scratch, kept from slab to slab
};

}  // namespace strata
