#pragma once

#include <cstdint>

#include "strata/core/grid.h"

namespace strata {

/// The image of rays along one axis: pixel (u, v) has its centre at lattice (256 u + 128, 256 v +
/// 128).
struct RasterTarget {
  Axis axis = Axis::kZ;           ///< of the rays
  int width = 0;                  ///< pixels along u
  int height = 0;                 ///< pixels along v
  std::uint32_t depth_limit = 0;  ///< depths are clamped to [0, depth_limit), never dropped
};

/// A half-open box of pixels.
struct PixelRect {
  int u0 = 0;  ///< first column
  int v0 = 0;  ///< first row
  int u1 = 0;  ///< one past the last column
  int v1 = 0;  ///< one past the last row
  /// True if it holds no pixel.
  [[nodiscard]] bool empty() const { return u0 >= u1 || v0 >= v1; }
};

/// Pixels along a side of a tile: bulk work is done tile by tile, each tile by one thread.
inline constexpr int kTileSide = 64;
/// Pixels of a tile.
inline constexpr int kTilePixels = kTileSide * kTileSide;

}  // namespace strata
