#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

#include "contour/cell_blocks.h"
#include "contour/cell_vertex.h"
#include "strata/core/grid.h"

// The vertices and triangles of a block of cells. Private to contour/.
//
// A line through a face between two cells joins two cut edges of it. It gives a triangle to each of
// them, with the vertices of both cells. So the triangles around a cut edge are a fan about the
// point where it is cut, and no grid edge is met by another fan: all vertices of cells lie inside
// their cells. In a cell, the surface is a cone from its vertex over a closed line on its faces.
// The lines on faces do not meet, since where two of them cross a face both run straight through a
// vertex in their middle; so one cone does not meet itself. Several cones in a cell end in the
// means of their cuts, and all faces of such a cell get middle vertices, so that each cone stays
// within the hull of its cuts, and these do not meet.

namespace strata::contouring {

/// Counts the triangles and the middle vertices of a block.
void count_block(CellBlock& block, const BlockNeighbours& blocks);

/// Writes what a block gives to a mesh.
class BlockMesh {
 public:
  /// @param place  of the block; @param planes of all triangles
  BlockMesh(const BlockNeighbours& blocks, const glm::ivec3& place, const VoxelGrid& grid,
            std::span<const Plane> planes)
      : blocks_(blocks),
        block_(blocks.own()),
        low_(place * kBlockSide),
        grid_(grid),
        planes_(planes) {}

  /// @param positions, triangles of the whole mesh @return vertices that were moved into their
  /// cells
  std::uint64_t write(std::span<glm::dvec3> positions, std::span<glm::uvec3> triangles);

 private:
  struct Cell {
    LocalPlace at;
    const CellCase* kind = nullptr;
  };
  void write_crossings(std::span<glm::dvec3> positions) const;
  void write_cells(std::span<glm::dvec3> positions);
  void write_face(const Cell& cell, int axis, std::span<glm::dvec3> positions,
                  std::span<glm::uvec3> triangles);
  [[nodiscard]] glm::dvec3 middle(const Cell& cell, unsigned axis, const FaceSegment& line) const;
  [[nodiscard]] const CellBlock::Crossing& crossing_at(const Cell& cell, unsigned edge) const;
  [[nodiscard]] std::uint32_t crossing_vertex(const Cell& cell, unsigned edge) const;
  [[nodiscard]] CellBounds bounds_of(const LocalPlace& cell) const;
  [[nodiscard]] CellCut cut_of(const Cell& cell, unsigned edge) const;
  [[nodiscard]] glm::ivec3 corner(const LocalPlace& cell) const {
    return (low_ + glm::ivec3(cell.i, cell.j, cell.k)) * 256 - 128;
  }
  [[nodiscard]] glm::dvec3 world(const glm::ivec3& lattice) const {
    return grid_.origin + glm::dvec3(lattice) / 256.0 * grid_.voxel_size;
  }

  const BlockNeighbours& blocks_;
  const CellBlock& block_;
  glm::ivec3 low_;  ///< voxel
  const VoxelGrid& grid_;
  std::span<const Plane> planes_;
  std::uint64_t next_triangle_ = 0;
  std::uint32_t next_middle_ = 0;
  std::uint64_t clamped_ = 0;
};

}  // namespace strata::contouring
