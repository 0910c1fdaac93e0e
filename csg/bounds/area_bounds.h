#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "raster/triangle_setup.h"

// Where the crossings of a solid may be in a tile, and in the areas of it. Private to csg/.

namespace strata::csg {

/// Bounds of the crossings of one solid in a tile and in each area of it, found from its triangles:
/// without their pixels. A steep triangle (Coincidence::steep_from()) counts from its nearest to
/// its farthest corner.
struct AreaBounds {
  static constexpr int kSide = 16;  ///< pixels of an area
  static constexpr int kAcross = kTileSide / kSide, kAreas = kAcross * kAcross;
  static constexpr std::size_t kTile = kAreas;  ///< stands for the whole tile where areas are asked
  static constexpr std::uint32_t kNever = 0xffffffffu;

  /// Depths of entries or of exits, by area, row by row, and of the tile. The nearest is kNever
  /// where there is none.
  struct Range {
    alignas(64) std::uint32_t nearest[kAreas + 1];
    alignas(64) std::uint32_t farthest[kAreas + 1];
  };
  struct Face {
    std::uint32_t triangle;
    std::uint16_t areas;  ///< that it may meet, a bit each
    bool exit;
  };
  Range entries, exits;
  /// Areas whose four corners are covered by entries. A ray through any pixel of them meets the
  /// solid if that is convex: its outline is convex but for what the snap has moved, half a lattice
  /// step, and the corners are half a pixel away from all centres.
  std::uint32_t covered = 0;
  std::uint32_t steep_areas = 0;         ///< that a steep triangle may meet
  std::uint32_t steep_depth = 0;         ///< the most that a steep triangle is deep
  std::vector<std::uint32_t> triangles;  ///< that may meet the tile
  std::vector<Face> faces;               ///< of areas

  [[nodiscard]] std::uint32_t nearest(std::size_t area) const {
    return std::min(entries.nearest[area], exits.nearest[area]);
  }
  [[nodiscard]] std::uint32_t farthest(std::size_t area) const {
    return std::max(entries.farthest[area], exits.farthest[area]);
  }
};

/// Bounds for `triangles` of `mesh` in the tile that begins at pixel `tile`, but not in its areas.
/// (csg/bounds/tile_bounds_simd.cpp) @param with_exits  false: as if there were none
void find_tile_bounds(const LatticeMesh& mesh, std::span<const std::uint32_t> triangles,
                      const glm::ivec2& tile, double steep_from, bool with_exits,
                      AreaBounds& bounds);
/// The same in its areas. (csg/bounds/area_bounds_simd.cpp) @param bounds_of_tile  `bounds` has
/// those of the tile, which hold for its areas as well, and `triangles` are those that it names;
/// false: nothing is known of the whole tile
void find_area_bounds(const LatticeMesh& mesh, std::span<const std::uint32_t> triangles,
                      const glm::ivec2& tile, double steep_from, bool with_exits,
                      bool bounds_of_tile, AreaBounds& bounds);

}  // namespace strata::csg
