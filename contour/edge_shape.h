#pragma once

#include <array>
#include <glm/vec3.hpp>

#include "contour/cell_blocks.h"

// Which triangles stand around a cut edge. Private to contour/.

namespace strata::contouring {

/// Around an edge from (0, 0, 0) to (0, 0, 256) lie four cells, whose vertices are in the quadrants
/// (-, -), (+, -), (+, +), (-, +), strictly. Two triangles stand in for the fan about the point
/// (0, 0, cut) if they stay where only the fan may be, and meet the edge near that point. Where the
/// surface is bent, the better of both diagonals follows the bend.
/// @pre no line through a face between two of the cells has a vertex in its middle
[[nodiscard]] EdgeShape edge_shape(const std::array<glm::ivec3, 4>& vertices, int cut);

}  // namespace strata::contouring
