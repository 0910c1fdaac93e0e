#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

#include "strata/raster/lattice_mesh.h"

namespace strata {

/// A cube of voxels whose distances are found at once (internal to voxelize/).
struct DistanceTile {
  static constexpr int kSide = 32;
  /// Floats from one row along z to the next: vectors may reach beyond a row.
  static constexpr int kStride = kSide + 8;
  static constexpr std::size_t kFloats = std::size_t{kSide} * kSide * kStride;
  static constexpr std::size_t kWords = std::size_t{kSide} * kSide;

  /// Where the square of voxel (x, y, z) stands.
  static constexpr std::size_t offset(int x, int y, int z) {
    return static_cast<std::size_t>((x * kSide + y) * kStride + z);
  }

  glm::ivec3 low{0};       ///< first voxel
  glm::ivec3 size{kSide};  ///< voxels that lie in the grid
  glm::dvec3 scale{1.0};   ///< sides of a voxel in units of the longest one
  double band = 0.0;       ///< in the same units
};

/// Lowers the squares of distances to those to the triangles, where they are below band^2. Others
/// may stay. @param squares  DistanceTile::kFloats
void add_triangles(const LatticeMesh& mesh, std::span<const std::uint32_t> triangles,
                   const DistanceTile& tile, float* squares);

/// What to make of squares.
struct DistanceScale {
  float band_square = 0.0f;  ///< squares from here on are the band's
  float unit = 1.0f;         ///< world length of 1
  float band = 0.0f;         ///< of squares beyond band_square; world units
};

/// True if a square of the block at voxel `at` of the tile is below band_square.
bool block_has_band(const float* squares, const glm::ivec3& at, float band_square);

/// What finish_block() counted of the voxels in the band.
struct BlockCounts {
  std::uint32_t voxels = 0, inside = 0;
  float deepest = 0.0f, farthest = 0.0f;  ///< the greatest distance inside, and outside
};

/// Distances of the block at voxel `at` of the tile, in the order of ScalarField::offset().
/// @param inside  a word for each y, z of the tile, z fastest: bit x is set for a voxel inside
BlockCounts finish_block(const float* squares,
                         std::span<const std::uint32_t, DistanceTile::kWords> inside,
                         const glm::ivec3& at, const DistanceScale& scale, float* values);

}  // namespace strata
