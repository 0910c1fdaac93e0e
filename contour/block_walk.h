#pragma once

#include <bit>
#include <glm/vec3.hpp>

#include "contour/cell_blocks.h"
#include "strata/raster/lattice_mesh.h"

// Walks over the cells of a block, and what lies at a cell. Private to contour/.

namespace strata::contouring {

/// A cell that the surface passes.
struct Cell {
  LocalPlace at;
  std::uint32_t number = 0;  ///< in its block
  const CellCase* kind = nullptr;
};

/// Calls visit(cell) for the cells of a block that the surface passes, by number.
template <class Visit>
void for_each_cell(const CellBlock& block, Visit&& visit) {
  const auto& cases = cell_cases();
  for (std::uint32_t n = 0; n < block.cells; ++n) {
    const int place = block.places[n];
    visit(Cell{
        {place / (kBlockSide * kBlockSide), place / kBlockSide % kBlockSide, place % kBlockSide},
        n,
        &cases[block.corners[n]]});
  }
}

/// The cell below another along an axis.
inline LocalPlace lowered(LocalPlace at, int axis) {
  (axis == 0 ? at.i : axis == 1 ? at.j : at.k) -= 1;
  return at;
}

/// What is known of a cell of a block or of the blocks below it.
inline const CellCase& case_at(const BlockNeighbours& blocks, LocalPlace at) {
  const CellBlock& block = blocks.of(at);
  return cell_cases()[block.corners_at(at.i, at.j, at.k)];
}

/// Whether the lines through a cell's lower face get vertices in their middles.
inline bool has_middles(const BlockNeighbours& blocks, const Cell& cell, int axis) {
  return is_ambiguous(cell.kind->low_face[static_cast<std::size_t>(axis)]) ||
         cell.kind->cycles > 1 || case_at(blocks, lowered(cell.at, axis)).cycles > 1;
}

/// Where an edge of a cell is: what the block of the edge calls it.
inline LocalPlace edge_place(const LocalPlace& cell, unsigned edge) {
  const int d = static_cast<int>(edge & 1) - 1, e = static_cast<int>(edge >> 1 & 1) - 1;
  switch (edge / 4) {
    case 0:
      return {cell.i, cell.j + d, cell.k + e};
    case 1:
      return {cell.i + d, cell.j, cell.k + e};
    default:
      return {cell.i + d, cell.j + e, cell.k};
  }
}

/// The cut of an edge of a cell. @pre it is cut
inline const CellBlock::Crossing& crossing_at(const BlockNeighbours& blocks, const LocalPlace& cell,
                                              unsigned edge) {
  LocalPlace at = edge_place(cell, edge);
  const CellBlock& block = blocks.of(at);
  return block.crossings[block.crossing(static_cast<int>(edge / 4), at)];
}

/// The lattice point at the lower corner of a cell. @param low  the block's first voxel
inline glm::ivec3 lower_corner(const glm::ivec3& low, const LocalPlace& cell) {
  return (low + glm::ivec3(cell.i, cell.j, cell.k)) * kLatticeSteps - kLatticeSteps / 2;
}

/// The cells around the edge of a cell that runs along `axis` at its lower side, in the order of
/// edge_shape(); the last but one is the cell itself.
inline std::array<LocalPlace, 4> ring_of(const LocalPlace& cell, int axis) {
  const int p = (axis + 1) % 3, q = (axis + 2) % 3;
  const LocalPlace left = lowered(cell, p);
  return {lowered(left, q), lowered(cell, q), cell, left};
}

}  // namespace strata::contouring
