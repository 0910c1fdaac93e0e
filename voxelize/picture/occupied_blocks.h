#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/voxelize/intervals.h"

namespace strata {

/// Which blocks of a set hold solid voxels, and which hold nothing else, so that rays pass through
/// both kinds at once. A block is a cube of 2^shift() voxels a side, a brick one of 4 x 4 x 4
/// blocks. Coordinates are those of AxisFrame(set.axis()): u, v, w.
class OccupiedBlocks {
 public:
  /// The bits of the blocks of a brick.
  struct Brick {
    std::uint64_t some = 0;  ///< with solid voxels
    std::uint64_t full = 0;  ///< whose voxels are all there and all solid
  };

  OccupiedBlocks() = default;
  /// Reads every interval once. @return kCancelled; kLimit if execution.memory_limit is exceeded
  static Result<OccupiedBlocks> make(const VoxelIntervals& set, const Execution& execution);

  [[nodiscard]] int shift() const { return shift_; }
  [[nodiscard]] int brick_shift() const { return shift_ + 2; }
  /// Bricks along u, v, w.
  [[nodiscard]] const glm::ivec3& bricks() const { return bricks_a_side_; }
  /// @pre `voxel` lies in the grid, its v is counted from the first row of the set
  [[nodiscard]] const Brick& brick_of(const glm::ivec3& voxel) const {
    const int s = brick_shift();
    return bricks_[index(voxel.x >> s, voxel.y >> s, voxel.z >> s)];
  }
  [[nodiscard]] unsigned bit_of(const glm::ivec3& voxel) const {
    return bit((voxel.x >> shift_) & 3, (voxel.y >> shift_) & 3, (voxel.z >> shift_) & 3);
  }
  /// A box of voxels, [low, high).
  struct Box {
    glm::ivec3 low{0}, high{0};
  };
  /// Around the solid voxels; empty where there are none.
  [[nodiscard]] const Box& box() const { return box_; }

 private:
  [[nodiscard]] static unsigned bit(int u, int v, int w) {
    return static_cast<unsigned>((v << 4) | (u << 2) | w);
  }
  [[nodiscard]] std::size_t index(int u, int v, int w) const {
    return (static_cast<std::size_t>(v) * static_cast<std::size_t>(bricks_a_side_.x) +
            static_cast<std::size_t>(u)) *
               static_cast<std::size_t>(bricks_a_side_.z) +
           static_cast<std::size_t>(w);
  }
  struct Columns;
  void add_columns(const VoxelIntervals& set, int bu, int bv, Columns& scratch);

  int shift_ = 2;
  glm::ivec3 bricks_a_side_{0};
  std::vector<Brick> bricks_;
  Box box_;
};

}  // namespace strata
