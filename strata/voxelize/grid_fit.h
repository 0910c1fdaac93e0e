#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>

#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/mesh/soup_tools.h"

namespace strata {

/// Size and place of the wanted grid. Exactly one of `resolution`, `voxel_size`,
/// `dims` and `cubic` is set.
struct GridRequest {
  /// Voxels along the longest side of the box; cubic voxels. Padding is added to it.
  std::optional<std::int64_t> resolution{};
  /// World length of a voxel along x, y, z.
  std::optional<glm::dvec3> voxel_size{};
  /// Voxels along x, y, z, padding included; voxels are stretched to fit the box.
  std::optional<std::array<std::int64_t, 3>> dims{};

  /// Voxels along each side of a cube, padding included; cubic voxels. The box lies in its middle.
  std::optional<std::int64_t> cubic{};

  /// The box to cover, instead of the mesh's box.
  std::optional<Bounds> bounds{};
  /// The lower corner of the grid without padding, instead of the lower corner of the box. Parts of
  /// the mesh below it are cut off.
  std::optional<glm::dvec3> origin{};
  std::int64_t padding = 0;  ///< empty voxels on each of the six sides
  bool align = false;        ///< the origin becomes a multiple of the voxel size, at most one lower
};

/// Checks what can be told of a request without a mesh. @return kUsage or kLimit, as fit_grid()
Result<void> check_grid_request(const GridRequest& request);

/// The grid for a request. Its cells cover the box from the lower corner on, each side with the
/// least whole number of voxels; a part that reaches less than half a lattice step (1/512 voxel)
/// into a further voxel is snapped onto its border and needs no voxel. A side without length gets
/// one voxel (with `dims` the requested number), and the box lies in its middle.
/// @param mesh_bounds  the mesh's box; used if request.bounds is not set
/// @return kUsage: not exactly one size, a size or a padding below its range, bounds or an origin
/// that contradict each other or `align`; kGeometry: a box without extent or with an infinite one,
/// coordinates too large for the voxel size, or a mesh that ends before the origin; kLimit: more
/// than kMaxGridSide voxels along a side. Each names the number.
Result<VoxelGrid> fit_grid(const Bounds& mesh_bounds, const GridRequest& request);

/// Checks that a grid not made by fit_grid() keeps the ranges of VoxelGrid.
/// @return kUsage, with the axis and the number
Result<void> check_grid(const VoxelGrid& grid);

}  // namespace strata
