#pragma once

#include <cstdint>
#include <glm/common.hpp>
#include <vector>

#include "csg/lattice/lattice_solids.h"
#include "mesh/check/box_pairs.h"

namespace strata::csg {

/// Cubes of 2^shift lattice steps, at most 64 along each axis, which is the number of bits of a
/// row.
struct CoarseGrid {
  static constexpr int kMostSide = 64;
  /// Faces that come so near to a voxel, in steps, count as in it. Roundings of doubles stay below.
  static constexpr int kMargin = 2;

  exact::LatticePoint low{0};
  int shift = 0;
  glm::ivec3 dims{0};

  /// Of the voxels of a box, those in the grid: empty where a low one is above the high one.
  LatticeBox voxels_of(const LatticeBox& box, int margin) const {
    return {glm::max((box.low - margin - low) >> shift, glm::ivec3(0)),
            glm::min((box.high + margin - low) >> shift, dims - 1)};
  }
};

/// What is known of a solid in each voxel of the rows that it reaches; it is not in the others.
struct SolidVoxels {
  LatticeBox rows{glm::ivec3(0), glm::ivec3(-1)};  ///< y and z
  std::vector<std::uint64_t> may;   ///< bit x: points of the voxel may be in the solid
  std::vector<std::uint64_t> must;  ///< all of them are

  std::size_t row(int y, int z) const {
    return static_cast<std::size_t>((z - rows.low.z) * (rows.high.y - rows.low.y + 1) + y -
                                    rows.low.y);
  }
};

/// How many rows of voxels the boxes of triangles have, about: what find_solid_voxels() takes time
/// for.
std::uint64_t rows_of_triangles(const LatticeSolids& solids, const CoarseGrid& grid);

SolidVoxels find_solid_voxels(const LatticeSolids& solids, std::uint32_t solid, InsideRule rule,
                              const CoarseGrid& grid);

}  // namespace strata::csg
