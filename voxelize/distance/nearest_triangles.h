#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <stop_token>
#include <vector>

#include "voxelize/distance/tile_distance.h"
#include "voxelize/distance/triangle_frame.h"

namespace strata {

/// A tree of boxes around the triangles of a mesh, for distances of any size (internal to
/// voxelize/).
class NearestTriangles {
 public:
  NearestTriangles() = default;
  /// @param scale  sides of a voxel in units of the longest one
  /// After a stop it is not complete.
  NearestTriangles(const LatticeMesh& mesh, const glm::dvec3& scale, const std::stop_token& stop);

  /// Lowers the squares of a tile's voxels from `band_square` on to the squares of their distances.
  /// @param squares  as add_triangles() takes them
  void lower(const DistanceTile& tile, float band_square, float* squares,
             const std::stop_token& stop) const;

  /// A box around `count` triangles from `first` on; or, where count is 0, around the box that
  /// follows it and the one at `first`.
  struct Node {
    std::array<float, 3> low, high;  ///< rounded outwards
    std::uint32_t first = 0, count = 0;
  };
  static constexpr std::uint32_t kLeafTriangles = 4;

 private:
  std::vector<TriangleFrame> triangles_;  // in the order of the leaves
  std::vector<Node> nodes_;
};

}  // namespace strata
