#pragma once

#include <string>
#include <string_view>

#include "strata/core/grid.h"
#include "strata/voxelize/grid_frame.h"

namespace strata {

/// The axes of a grid in the world, as most formats want them. (Internal to voxelize/.)
struct WorldAxes {
  glm::dmat3 direction{1.0};  ///< columns: of length 1
  glm::dmat3 steps{1.0};      ///< columns: from a voxel to the next along x, y, z
  glm::dvec3 centre{0.0};     ///< of voxel (0, 0, 0)
};

/// @param space  names of the format's own axes, such as "right-anterior-superior": the axes are
///               turned to it from those of the frame, if both are known
[[nodiscard]] WorldAxes world_axes(const VoxelGrid& grid, const GridFrame& frame,
                                   std::string_view space = {});

/// "mm", "um", "cm", "m", "in", "ft" or "nm"; empty for other lengths and for an unknown one.
[[nodiscard]] std::string_view unit_name(double metres);

/// A text without line breaks and other control characters, which become spaces.
[[nodiscard]] std::string one_line(std::string text);

}  // namespace strata
