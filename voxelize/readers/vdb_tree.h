#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "voxelize/readers/vdb_stream.h"

namespace strata {

/// A box of voxels that one value of an inner node stands for, first to last, both inclusive.
struct VdbTile {
  glm::ivec3 first{0}, last{0};
  float value = 0.0f;
  bool active = false;
};

inline constexpr int kLeafSide = 8;  ///< voxels along a side of a leaf

/// The 512 active bits of a leaf: word x, bit 8 y + z.
using VdbMask = std::array<std::uint64_t, 8>;

/// A tree without the values of its leaves. (Internal to voxelize/readers.)
struct VdbTree {
  float background = 0.0f;
  std::vector<VdbTile> tiles;  ///< those that are active or not of the background's value
  std::vector<glm::ivec3> leaves;
  std::vector<VdbMask> masks;      ///< of the leaves
  glm::ivec3 lower{0}, upper{-1};  ///< of the active voxels, inclusive; upper < lower: none
  std::uint64_t end = 0;           ///< of the topology in the file

  [[nodiscard]] bool empty() const { return upper.x < lower.x; }
};

/// The topology of a tree. @return kInput naming the byte, kLimit, kCancelled
Result<VdbTree> read_vdb_tree(ReadContext& context, std::uint64_t at, VdbValueLists& lists);

}  // namespace strata
