#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/inside_rule.h"
#include "strata/hashbuffer/tile_lists.h"
#include "strata/raster/lattice_mesh.h"
#include "strata/voxelize/intervals.h"
#include "voxelize/open/winding_field.h"
#include "voxelize/tile_walk.h"

// The filled part of voxels, from depth lists on a grid that is finer: each ray adds the length of
// what it has inside a voxel, exactly. Private to voxelize/.

namespace strata {

/// The voxels of one tile of rays: kTileSide / rays squared columns, row by row.
struct CoveragePiece {
  std::vector<std::uint32_t> ends;  ///< of the intervals of each column in `items`
  std::vector<Interval> items;
  std::vector<std::uint32_t> labels;  ///< one for each item
};

/// Adds up lengths along rays, tile by tile. Scratch of one thread.
class CoverageWalker {
 public:
  /// @param rays   along the side of a voxel: a power of two up to kTileSide
  /// @param voxels along the rays
  CoverageWalker(int rays, int voxels);

  /// The voxels of a tile of rays. A solid that is entered and never left ends where it is entered.
  /// @param settled where winding numbers decide: what they made of the tile, which the columns of
  /// `steps` are taken from, so that those count whole voxels of the finer grid
  template <class Key>  // DepthKey or DepthItem
  void walk(const TileLists<Key>& lists, InsideRule rule, bool histogram,
            std::span<const WindingStep> steps, const TileIntervals& settled, TileCounts& counts,
            CoveragePiece& out);

  /// Changes along the columns of a row of voxels, kept where rays meet the surface. (For
  /// coverage.cpp.)
  struct Row {
    int shift = 0;            ///< log2 of the lattice steps along a voxel
    int rays_bits = 0;        ///< log2 of the rays along a voxel's side
    std::size_t stride = 0;   ///< changes of a column: one more than the voxels, and what is 0
    std::size_t words = 0;    ///< marks of a column
    std::uint32_t least = 0;  ///< depth of a change; above `most`: there is none
    std::uint32_t most = 0;   ///< depth of a change
    std::vector<std::int32_t> changes;  ///< by column and voxel: from the voxel before
    std::vector<std::uint64_t> marks;   ///< by column: voxels that, or whose next, may have changes

    /// A solid begins (sign 1) or ends (-1) at a depth of the ray in column u of the tile.
    void change(std::size_t u, std::uint32_t depth, std::int32_t sign) {
      const std::size_t column = u >> rays_bits, voxel = depth >> shift;
      const std::int32_t full = std::int32_t{1} << shift;
      const auto part = static_cast<std::int32_t>(depth & static_cast<std::uint32_t>(full - 1));
      std::int32_t* at = changes.data() + column * stride + voxel;
      at[0] += sign * (full - part);
      at[1] += sign * part;
      marks[column * words + voxel / 64] |= std::uint64_t{1} << voxel % 64;
      least = std::min(least, depth);
      most = std::max(most, depth);
    }
  };

 private:
  void emit(CoveragePiece& out);

  int rays_;
  Row row_;
};

/// The voxels of a slab, put together from tiles of rays.
class CoverageTiles {
 public:
  /// @param voxels the grid of the voxels @param v_begin of rays, as v_end; voxels' times `rays`
  CoverageTiles(const VoxelGrid& voxels, Axis axis, int rays, int v_begin, int v_end);

  /// Where a tile of rays goes. Different ones may be used by different threads at once.
  CoveragePiece& piece(int tu, int tv) {
    auto& stored = pieces_[index(tu, tv)];
    stored = std::make_unique<CoveragePiece>();
    return *stored;
  }

  /// All of them, with labels. Frees the pieces. @param sum the labels of all voxels are added
  VoxelIntervals merged(const Execution& execution, std::uint64_t& sum);

 private:
  [[nodiscard]] std::size_t index(int tu, int tv) const {
    return static_cast<std::size_t>(tv) * static_cast<std::size_t>(tiles_u_) +
           static_cast<std::size_t>(tu);
  }
  struct Worker;
  void merge_tile(int tu, int tv, Worker& worker);
  [[nodiscard]] const CoveragePiece* find(int tu, int tv) const {
    return tu < tiles_u_ && tv < tiles_v_ ? pieces_[index(tu, tv)].get() : nullptr;
  }

  int rays_, tiles_u_, tiles_v_;  // tiles of rays
  std::vector<std::unique_ptr<CoveragePiece>> pieces_;
  VoxelIntervals result_;
};

}  // namespace strata
