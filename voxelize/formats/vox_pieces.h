#pragma once

#include <glm/vec3.hpp>
#include <string>

#include "core/letters.h"

namespace strata {

/// How a grid is cut into .vox files. An axis that one MagicaVoxel scene holds is not cut; along
/// another, piece i begins at voxel kSide * i. (Internal to voxelize/ and the tool.)
struct VoxPieces {
  static constexpr int kLargestSide = 2000;  ///< voxels of a MagicaVoxel 0.99 scene
  static constexpr int kSide = 1792;         ///< voxels of a piece: 7 models of 256
  static constexpr int kMost = 200;          ///< files

  glm::ivec3 dims{0}, side{0}, count{0};

  explicit VoxPieces(const glm::ivec3& grid_dims) : dims(grid_dims) {
    for (int axis = 0; axis < 3; ++axis) {
      side[axis] = dims[axis] <= kLargestSide ? dims[axis] : kSide;
      count[axis] = (dims[axis] + side[axis] - 1) / side[axis];
    }
  }
  [[nodiscard]] int total() const { return count.x * count.y * count.z; }
  /// Along x, y and z, of number 0 to total() - 1.
  [[nodiscard]] glm::ivec3 place(int number) const {
    return {number % count.x, number / count.x % count.y, number / count.x / count.y};
  }
  /// part.vox is that of the one piece, or of several part_0_0_0.vox, part_1_0_0.vox, ...
  [[nodiscard]] std::string path(const std::string& whole, int number) const {
    if (total() == 1) return whole;
    const std::size_t letters = lower_case(whole).ends_with(".vox") ? 4 : 0;
    const glm::ivec3 at = place(number);
    std::string name = whole;
    name.insert(name.size() - letters, "_" + std::to_string(at.x) + "_" + std::to_string(at.y) +
                                           "_" + std::to_string(at.z));
    return name;
  }
};

}  // namespace strata
