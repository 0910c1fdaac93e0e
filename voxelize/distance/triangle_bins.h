#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/raster/lattice_mesh.h"

namespace strata {

/// The tiles that a triangle's band reaches, by rows of tiles along x (internal to voxelize/).
class TriangleBins {
 public:
  TriangleBins() = default;
  /// @param reach  half the width of the band in voxels along each axis
  TriangleBins(const LatticeMesh& mesh, const VoxelGrid& grid, const glm::dvec3& reach,
               const Execution& execution);

  [[nodiscard]] const glm::ivec3& tiles() const { return tiles_; }  ///< along x, y, z
  /// Triangles whose band may reach the tiles (0.., y, z), in no order.
  [[nodiscard]] std::span<const std::uint32_t> row(int y, int z) const {
    const std::size_t at = static_cast<std::size_t>(z) * static_cast<std::size_t>(tiles_.y) +
                           static_cast<std::size_t>(y);
    return std::span(items_).subspan(first_[at], first_[at + 1] - first_[at]);
  }
  /// The tiles that the band of triangle t may reach, inclusive. Empty: low is above high.
  struct Box {
    glm::ivec3 low, high;
  };
  [[nodiscard]] Box box(std::uint32_t t) const;

 private:
  const LatticeMesh* mesh_ = nullptr;
  glm::ivec3 tiles_{0};
  glm::ivec3 reach_{0};               // lattice steps
  std::vector<std::uint64_t> first_;  // of each row, and the end
  std::vector<std::uint32_t> items_;
};

}  // namespace strata
