#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/core/unfilled_allocator.h"
#include "strata/mesh/soup_tools.h"
#include "strata/mesh/triangle_soup.h"

namespace strata {

/// Lattice steps along a voxel or pixel: positions are 24.8 fixed point.
inline constexpr int kLatticeBits = 8;
/// The same as a number: 256.
inline constexpr int kLatticeSteps = 1 << kLatticeBits;
/// Coordinates beyond this many lattice steps (2^20 voxels) are refused.
inline constexpr std::int32_t kMaxLatticeCoordinate = 1 << 28;

/// Vertices of a mesh on a lattice; resize() gives new ones no value.
using LatticeVertices = std::vector<glm::ivec3, UnfilledAllocator<glm::ivec3>>;

/// A mesh whose vertices were snapped, once and in 3D, to the lattice of a grid: the only geometry
/// that the rasterizer, the surface voxelizer and the oracles see (law 3). Lattice point (x, y, z)
/// lies at world grid.origin + (x, y, z) / 256 * grid.voxel_size; voxel centres are at 256 i + 128.
struct LatticeMesh {
  LatticeVertices vertices;               ///< |coordinate| <= kMaxLatticeCoordinate
  std::span<const glm::uvec3> triangles;  ///< borrowed from the soup it was made of
};

/// Snaps to nearest, ties up: floor((p - origin) / voxel_size * 256 + 0.5).
/// @return kGeometry naming the vertex and its coordinate when it is not finite or farther than
/// kMaxLatticeCoordinate; kCancelled
Result<LatticeMesh> snap_to_lattice(const TriangleSoup& mesh, const VoxelGrid& grid,
                                    const Execution& execution = {});

/// Clamps a mesh that does not fit the lattice of `grid`: parts far outside the grid are moved onto
/// a box (clamp_to_box()), so that rays through the grid meet the mesh as often as before.
/// @param box  around the mesh
/// @return for each triangle the index of the original triangle that it is a piece of; empty when
/// the mesh fitted and was not changed. kGeometry naming the vertex whose coordinate is not below
/// kMostClamped; kCancelled
Result<std::vector<std::uint32_t>> fit_lattice(TriangleSoup& mesh, const Bounds& box,
                                               const VoxelGrid& grid,
                                               const Execution& execution = {});

}  // namespace strata
