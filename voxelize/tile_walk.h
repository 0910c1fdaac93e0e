#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "hashbuffer/tile_builder.h"
#include "strata/voxelize/intervals.h"
#include "strata/voxelize/voxelize.h"
#include "voxelize/open/tile_counts.h"
#include "voxelize/open/winding_field.h"

// Depth lists of a tile -> runs of solid voxels. Private to voxelize/.

namespace strata {

/// The intervals of one tile, as VoxelIntervals::set_tile() takes them.
struct TileIntervals {
  std::vector<std::uint32_t> offsets;  ///< kTilePixels + 1
  std::vector<Interval> items;         ///< the first offsets.back() are valid
  std::vector<std::uint32_t> labels;   ///< of those items, or none
  TileCounts counts;
};

/// The crossing in a list of either kind.
inline std::uint32_t depth_of(DepthKey key) { return key >> 1; }
inline std::uint32_t depth_of(DepthItem item) { return item.depth(); }
inline bool exit_of(DepthKey key) { return (key & 1) != 0; }
inline bool exit_of(DepthItem item) { return item.exit(); }

/// Calls body(key) for the sorted list of a pixel.
template <class Key, class Body>
void for_each_key(const TileLists<Key>& lists, std::size_t pixel, Body&& body) {
  if constexpr (std::is_same_v<Key, DepthItem>) {
    for_each_item(lists, pixel, body);
  } else if (lists.planes32 == nullptr) {
    std::for_each(lists.keys + lists.offsets[pixel], lists.keys + lists.offsets[pixel + 1], body);
  } else {
    const int row = static_cast<int>(pixel) / kTileSide;
    if (row < lists.row_begin || row >= lists.row_end) return;
    const std::uint32_t* enter = lists.planes32 + pixel;
    const std::uint32_t* leave = enter + kTilePixels;
    constexpr std::size_t kStep = kSides<Key> * kTilePixels;
    const std::uint32_t* const end =
        lists.planes32 + static_cast<std::size_t>(lists.ages) * kStep;  // of both
    const auto key_in = [end](const std::uint32_t* cell) {
      return cell < end && *cell != 0 ? tile_key<Record32>(*cell) : ~DepthKey{0};
    };
    for (;;) {
      const DepthKey in = key_in(enter), out = key_in(leave);
      if (std::min(in, out) == ~DepthKey{0}) return;
      body(std::min(in, out));
      (in < out ? enter : leave) += kStep;
    }
  }
}

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
