#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "strata/core/grid.h"
#include "strata/voxelize/intervals.h"

namespace strata::testkit {

inline constexpr Axis kAllAxes[] = {Axis::kX, Axis::kY, Axis::kZ};

/// A value for each voxel of a small grid.
template <class Value>
class VoxelArray {
 public:
  explicit VoxelArray(const glm::ivec3& dims = glm::ivec3(0))
      : dims_(dims),
        values_(static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) *
                static_cast<std::size_t>(dims.z)) {}

  [[nodiscard]] const glm::ivec3& dims() const { return dims_; }
  [[nodiscard]] bool contains(const glm::ivec3& p) const {
    return p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < dims_.x && p.y < dims_.y && p.z < dims_.z;
  }
  [[nodiscard]] Value& at(const glm::ivec3& p) { return values_[index(p)]; }
  [[nodiscard]] const Value& at(const glm::ivec3& p) const { return values_[index(p)]; }
  /// False outside the grid.
  [[nodiscard]] bool solid(const glm::ivec3& p) const { return contains(p) && at(p) != Value{}; }
  [[nodiscard]] const std::vector<Value>& values() const { return values_; }

  template <class Visit>
  void for_each(Visit&& visit) const {
    for (int z = 0; z < dims_.z; ++z) {
      for (int y = 0; y < dims_.y; ++y) {
        for (int x = 0; x < dims_.x; ++x) visit(glm::ivec3(x, y, z));
      }
    }
  }
  friend bool operator==(const VoxelArray&, const VoxelArray&) = default;

 private:
  [[nodiscard]] std::size_t index(const glm::ivec3& p) const {
    return (static_cast<std::size_t>(p.z) * static_cast<std::size_t>(dims_.y) +
            static_cast<std::size_t>(p.y)) *
               static_cast<std::size_t>(dims_.x) +
           static_cast<std::size_t>(p.x);
  }
  glm::ivec3 dims_;
  std::vector<Value> values_;
};

/// A set of voxels, a byte each.
using VoxelSet = VoxelArray<std::uint8_t>;

[[nodiscard]] inline std::int64_t count(const VoxelSet& set) {
  return std::count(set.values().begin(), set.values().end(), 1);
}

/// Voxels that are in one of the two but not in both. @pre equal dims
[[nodiscard]] inline std::int64_t differences(const VoxelSet& a, const VoxelSet& b) {
  std::int64_t n = 0;
  for (std::size_t i = 0; i < a.values().size(); ++i) n += a.values()[i] != b.values()[i];
  return n;
}

/// True when every voxel of `inner` is in `outer`.
[[nodiscard]] inline bool includes(const VoxelSet& outer, const VoxelSet& inner) {
  for (std::size_t i = 0; i < outer.values().size(); ++i) {
    if (inner.values()[i] != 0 && outer.values()[i] == 0) return false;
  }
  return true;
}

template <class Predicate>
[[nodiscard]] VoxelSet set_of(const glm::ivec3& dims, Predicate&& solid) {
  VoxelSet set(dims);
  set.for_each([&](const glm::ivec3& p) { set.at(p) = solid(p) ? 1 : 0; });
  return set;
}

/// The voxels of a whole grid's intervals. Checks on the way that they are disjoint, increasing,
/// not touching and within the grid.
[[nodiscard]] VoxelSet set_of(const VoxelIntervals& intervals);

}  // namespace strata::testkit
