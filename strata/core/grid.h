#pragma once

#include <glm/vec3.hpp>

namespace strata {

/// The axis that rays run along: depth lists, intervals.
enum class Axis : int { kX = 0, kY = 1, kZ = 2 };

/// Names the two screen axes of rays along `w`: pixel (u, v) with u before v in x, y, z order. For
/// kY the frame (u, v, w) = (x, z, y) is left-handed.
struct AxisFrame {
  int u = 0;  ///< axis of the columns of pixels: 0, 1 or 2 for x, y or z
  int v = 1;  ///< axis of the rows
  int w = 2;  ///< axis of the rays

  /// The frame of rays along `axis`.
  explicit constexpr AxisFrame(Axis axis)
      : u(axis == Axis::kX ? 1 : 0), v(axis == Axis::kZ ? 1 : 2), w(static_cast<int>(axis)) {}
};

/// Largest number of voxels along one side of a grid: 2^24 lattice steps.
inline constexpr int kMaxGridSide = 65536;

/// A box of voxels in world space. Voxel (i, j, k) covers origin + (i..i+1, j..j+1, k..k+1) *
/// voxel_size; its centre, half a voxel from each side, decides whether it is solid.
struct VoxelGrid {
  glm::ivec3 dims{0};          ///< voxels along x, y, z; each in [1, kMaxGridSide]
  glm::dvec3 origin{0.0};      ///< world position of the lower corner of voxel (0, 0, 0)
  glm::dvec3 voxel_size{1.0};  ///< world length of a voxel along x, y, z; each finite and > 0

  /// Equal in all members.
  friend bool operator==(const VoxelGrid&, const VoxelGrid&) = default;
};

}  // namespace strata
