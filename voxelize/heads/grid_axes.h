#pragma once

#include <array>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>

#include "strata/core/result.h"
#include "strata/voxelize/grid_frame.h"

namespace strata {

/// The axes of a file's grid in the world. (Internal to voxelize/.)
struct GridAxes {
  std::array<double, 3> sizes{};  ///< voxels along the file's first, second, third axis
  glm::dmat3 steps{1.0};          ///< columns: from a voxel to the next along each axis
  glm::dvec3 place{0.0};          ///< the centre of voxel (0, 0, 0)
  bool corner = false;            ///< `place` is its lower corner
};

/// The same as spacing, origin and direction. Rounding of the file's numbers is accepted: axes may
/// be off right angles by 1/10000. @return kInput or kLimit naming path and number
Result<VoxelFileGrid> grid_of_axes(const std::string& path, const GridAxes& axes);

/// The same from a lower corner before the grid is turned, as our own files have it.
Result<VoxelFileGrid> grid_of_frame(const std::string& path, const std::array<double, 3>& sizes,
                                    const glm::dvec3& origin, const glm::dvec3& spacing,
                                    const glm::dmat3& direction);

/// The length of a unit in metres by its name: "mm", "millimeter", "um", "inch" ...; 0: unknown
[[nodiscard]] double unit_named(std::string_view name);

}  // namespace strata
