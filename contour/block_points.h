#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

#include "contour/cell_blocks.h"
#include "contour/cell_vertex.h"
#include "contour/edge_strips.h"
#include "strata/core/grid.h"

// The vertices of a block's cells, and the shapes around its edges. Private to contour/.

namespace strata::contouring {

/// Sets CellBlock::points. @param place of the block @param planes of all triangles
/// @return vertices that were moved into their cells
std::uint64_t place_points(CellBlock& block, const BlockNeighbours& blocks, const glm::ivec3& place,
                           const VoxelGrid& grid, std::span<const Plane> planes);

/// Chooses the shape around each edge at the lower side of a cell of the block.
/// @pre the points of the blocks are there
void choose_shapes(const BlockNeighbours& blocks, StripFinder& strips);

}  // namespace strata::contouring
