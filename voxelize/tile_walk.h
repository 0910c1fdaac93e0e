#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hashbuffer/tile_builder.h"
#include "strata/voxelize/intervals.h"
#include "strata/voxelize/voxelize.h"
#include "voxelize/open/winding_field.h"

// Depth lists of a tile -> runs of solid voxels. Private to voxelize/.

namespace strata {

/// The intervals of one tile, as VoxelIntervals::set_tile() takes them, and what the walk saw.
struct TileIntervals {
  std::vector<std::uint32_t> offsets;  ///< kTilePixels + 1
  std::vector<Interval> items;         ///< the first offsets.back() are valid
  std::vector<std::uint32_t> labels;   ///< of those items, or none
  std::uint64_t unbalanced = 0;        ///< columns whose winding number does not return to 0
  std::uint64_t negative = 0;          ///< columns whose winding number falls below 0
  std::uint64_t max_depth = 0;
  /// Columns with n = 1..63 fragments at [n], the deeper ones at [64]; filled when asked for.
  std::uint64_t histogram[65];
};

/// Walks the lists of a tile along the ray. A voxel k lies beyond a crossing when its centre, at
/// 256 k + 128 lattice steps, is above the floor of the crossing. An interval that is entered and
/// never left (open mesh) is left out.
void walk_tile(const TileLists<DepthKey>& lists, InsideRule rule, bool histogram,
               TileIntervals& out);
void walk_tile(const TileLists<DepthItem>& lists, InsideRule rule, bool histogram,
               TileIntervals& out);
/// The same of labelled lists (TileListFilter::labelled()).
void walk_labelled_tile(const TileLists<DepthItem>& lists, bool histogram, TileIntervals& out);

/// Does the columns that have steps again: there the winding number changes at crossings and steps.
/// @param steps  sorted by pixel and voxel @pre `out` is what walk_tile() made of the lists
template <class Key>
void add_winding_steps(const TileLists<Key>& lists, InsideRule rule,
                       std::span<const WindingStep> steps, TileIntervals& out);

}  // namespace strata
