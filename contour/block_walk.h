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

/// The axes along which the cells of ring_of() lie below the last but one: bit 0 for x and so on.
template <int axis>
inline constexpr std::array<unsigned, 4> kRingBelow = {7u & ~(1u << axis), 1u << (axis + 2) % 3, 0u,
                                                       1u << (axis + 1) % 3};

/// The numbers of the cells around those of one column after another.
class CellColumns {
 public:
  explicit CellColumns(const BlockNeighbours& blocks) : blocks_(blocks) {}

  struct Numbered {
    const CellBlock* block = nullptr;
    std::uint32_t number = 0;
  };
  void go_to(const LocalPlace& cell) {
    at_.k = cell.k;
    if (cell.i == at_.i && cell.j == at_.j) return;
    at_ = cell;
    for (unsigned below = 0; below < 4; ++below) {
      LocalPlace at = {cell.i - static_cast<int>(below & 1), cell.j - static_cast<int>(below >> 1),
                       0};
      Column& column = columns_[below];
      column.block = blocks_.find(at);
      if (column.block == nullptr) continue;
      const std::size_t c = CellBlock::column(at.i, at.j);
      column.passed = column.block->active[c];
      column.before = column.block->before[3][c];
    }
  }
  /// The cell below the one gone to, along some axes. @pre the surface passes it
  [[nodiscard]] Numbered below(unsigned axes) const {
    const Column& column = columns_[axes & 3];
    const int k = at_.k - static_cast<int>(axes >> 2);
    if (k >= 0) {
      const std::uint32_t lower = (std::uint32_t{1} << k) - 1;
      return {column.block, column.before + bit_count(column.passed & lower)};
    }
    LocalPlace at = {at_.i - static_cast<int>(axes & 1), at_.j - static_cast<int>(axes >> 1 & 1),
                     -1};
    const CellBlock& block = blocks_.of(at);
    return {&block, block.cell(at)};
  }

 private:
  struct Column {
    const CellBlock* block = nullptr;
    std::uint32_t passed = 0, before = 0;
  };
  const BlockNeighbours& blocks_;
  LocalPlace at_{-1, -1, -1};
  std::array<Column, 4> columns_;  ///< by whether they lie below along x and y
};

/// The cuts of the edges of cells of one column after another.
class EdgeColumns {
 public:
  explicit EdgeColumns(const BlockNeighbours& blocks) : blocks_(blocks) {}

  void go_to(const LocalPlace& cell) {
    at_.k = cell.k;
    if (cell.i == at_.i && cell.j == at_.j) return;
    at_ = cell;
    for_each_axis([&](auto axis) {
      for (unsigned n = 0; n < (axis == 2 ? 4u : 2u); ++n) {
        LocalPlace at = edge_place({cell.i, cell.j, 1}, 4 * axis + n);
        Column& column = columns_[axis][n];
        const CellBlock* block = blocks_.find(at);
        if (block == nullptr) continue;
        column.cut = block->cut(axis, at.i, at.j);
        column.first = block->crossings.data() + block->first_crossing[axis] +
                       block->before[axis][CellBlock::column(at.i, at.j)];
      }
    });
  }
  /// The cut of an edge of the cell gone to: edge 4 axis + n. @pre it is cut
  template <int axis>
  [[nodiscard]] const CellBlock::Crossing& at(unsigned n) const {
    const int k = axis == 2 ? at_.k : at_.k - 1 + static_cast<int>(n >> 1);
    if (k < 0) return crossing_at(blocks_, at_, 4 * axis + n);
    const Column& column = columns_[axis][axis == 2 ? n : n & 1];
    return column.first[bit_count(column.cut & ((std::uint32_t{1} << k) - 1))];
  }

 private:
  struct Column {
    const CellBlock::Crossing* first = nullptr;
    std::uint32_t cut = 0;
  };
  const BlockNeighbours& blocks_;
  LocalPlace at_{-1, -1, -1};
  std::array<std::array<Column, 4>, 3> columns_;  ///< by axis and place of the edge
};

}  // namespace strata::contouring
