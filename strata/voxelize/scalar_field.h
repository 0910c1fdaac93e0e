#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

namespace strata {

/// A number for each voxel of a grid: densities, distances. Blocks of 8 x 8 x 8 voxels that are all
/// equal hold one number; so memory grows with the blocks that are not. A voxel is found in three
/// steps: 1024, 64 and 8 voxels a side. Any number of threads may read.
class ScalarField {
 public:
  static constexpr int kBlockSide = 8;              ///< voxels along a side of a block
  static constexpr std::size_t kBlockVoxels = 512;  ///< voxels of a block

  ScalarField() = default;
  /// All voxels are `background`. Block (bi, bj, bk) has the voxels (8 bi..8 bi + 7, ...) - shift.
  /// @param shift of the blocks, 0 to 7 along each axis
  /// @pre dims in [1, kMaxGridSide]
  explicit ScalarField(const glm::ivec3& dims, float background = 0.0f,
                       const glm::ivec3& shift = glm::ivec3(0));

  /// True when there are no values at all: the default.
  [[nodiscard]] bool empty() const { return branches_.empty(); }
  [[nodiscard]] const glm::ivec3& dims() const { return dims_; }      ///< voxels along x, y, z
  [[nodiscard]] const glm::ivec3& shift() const { return shift_; }    ///< as given above
  [[nodiscard]] const glm::ivec3& blocks() const { return blocks_; }  ///< blocks along x, y, z
  [[nodiscard]] float background() const { return background_; }      ///< where nothing was set

  /// The value of voxel (i, j, k). @pre 0 <= i < dims().x, ...
  [[nodiscard]] float value(int i, int j, int k) const {
    i += shift_.x, j += shift_.y, k += shift_.z;
    const Block found = block(i >> 3, j >> 3, k >> 3);
    return found.values == nullptr ? found.constant : found.values[offset(i & 7, j & 7, k & 7)];
  }

  /// A block: all of its values, at offset(), or the one that all its voxels have.
  struct Block {
    const float* values = nullptr;  ///< kBlockVoxels, or null
    float constant = 0.0f;          ///< the value of all voxels where `values` is null
  };
  /// @pre 0 <= bi < blocks().x, ...
  [[nodiscard]] Block block(int bi, int bj, int bk) const;
  /// Where voxel (x, y, z) of a block stands in its values: z is fastest, as in an OpenVDB leaf.
  [[nodiscard]] static constexpr std::size_t offset(int x, int y, int z) {
    return static_cast<std::size_t>(x << 6 | y << 3 | z);
  }
  /// Blocks along z, from block (bi, bj, bk) on, that hold the same constant without having been
  /// looked at singly: lets loops skip them. At least 1.
  [[nodiscard]] int equal_blocks_along_z(int bi, int bj, int bk) const;

  /// Sets the values of a block; one number if they are equal. One thread at a time.
  void set_block(int bi, int bj, int bk, std::span<const float, kBlockVoxels> values);
  /// Sets all voxels of the blocks from `first` up to, not including, `last`; blocks beyond the
  /// grid do not count. One thread at a time.
  void fill_blocks(glm::ivec3 first, glm::ivec3 last, float value);
  /// The values of a block, to be written; they begin as what the block had. One thread at a time.
  [[nodiscard]] float* edit_block(int bi, int bj, int bk);
  /// Stores a block that edit_block() gave as one number if its values are equal.
  void settle_block(int bi, int bj, int bk);

  [[nodiscard]] std::uint64_t memory_bytes() const;  ///< bytes held; O(1)
  /// Bytes of one block that is not constant.
  static constexpr std::uint64_t kBlockBytes = kBlockVoxels * sizeof(float);

  /// The least and the greatest value of any voxel, infinite ones and NaN aside.
  struct Range {
    float least = 0.0f;     ///< of the values
    float greatest = 0.0f;  ///< of the values
  };
  /// O(stored values).
  [[nodiscard]] Range range() const;

 private:
  static constexpr std::uint32_t kNone = 0xffffffff;
  struct Entry {
    float constant = 0.0f;
    std::uint32_t child = kNone;  // of the next level; kNone: constant
  };
  using Node = std::array<Entry, 512>;     // 8 x 8 x 8 blocks
  using Branch = std::array<Entry, 4096>;  // 16 x 16 x 16 nodes
  using Values = std::array<float, kBlockVoxels>;

  [[nodiscard]] std::size_t branch_index(int bi, int bj, int bk) const;
  Node& node_of(int bi, int bj, int bk);
  void fill_nodes(Branch& branch, const glm::ivec3& at, const glm::ivec3& first,
                  const glm::ivec3& last, float value);

  glm::ivec3 dims_{0}, shift_{0}, blocks_{0}, branch_dims_{0};
  float background_ = 0.0f;
  std::vector<Entry> branches_;
  std::vector<std::unique_ptr<Branch>> branch_nodes_;
  std::vector<std::unique_ptr<Node>> nodes_;
  std::vector<std::unique_ptr<Values>> values_;
  std::vector<std::uint32_t> free_values_;  // of blocks that turned out to be constant
};

}  // namespace strata
