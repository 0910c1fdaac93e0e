#pragma once

#include <array>
#include <cstddef>
#include <glm/vec3.hpp>

#include "voxelize/colours/near_triangle.h"

// Private to voxelize/colours.

namespace strata {

/// Centres of voxels, whose nearest points of a triangle are found several at once.
struct VoxelCentres {
  static constexpr std::size_t kMost = 512;
  std::size_t count = 0;
  alignas(64) std::array<double, kMost> u{}, v{}, w{};

  void add(int column_u, int column_v, int voxel) {
    u[count] = column_u + 0.5, v[count] = column_v + 0.5, w[count] = voxel + 0.5;
    ++count;
  }
};

/// The squares of the distances of the centres.
void find_distances2(const NearTriangle& triangle, const VoxelCentres& centres,
                     std::array<double, VoxelCentres::kMost>& squares);

/// Weights of the corners that make the point nearest to each centre.
void find_nearest_points(const NearTriangle& triangle, const VoxelCentres& centres,
                         std::array<glm::dvec3, VoxelCentres::kMost>& weights);

}  // namespace strata
