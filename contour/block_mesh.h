#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

#include "contour/block_walk.h"
#include "contour/cell_blocks.h"
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
// within the hull of its cuts, and these do not meet. Where edge_shape()
// allows it, two triangles stand in for a fan, and those in one plane are joined to strips
// (contour/edge_strips.h).

namespace strata::contouring {

/// Numbers the vertices of a block's fans and cells. @pre all shapes are chosen
void number_vertices(CellBlock& block);
/// Counts the triangles and the middle vertices of a block. @pre all blocks' vertices are numbered
void count_block(CellBlock& block, const BlockNeighbours& blocks);

/// Writes what a block gives to a mesh.
class BlockMesh {
 public:
  /// @param place  of the block
  BlockMesh(const BlockNeighbours& blocks, const glm::ivec3& place, const VoxelGrid& grid)
      : blocks_(blocks),
        columns_(blocks),
        block_(blocks.own()),
        low_(place * kBlockSide),
        grid_(grid) {}

  /// @param positions, triangles of the whole mesh
  void write(std::span<glm::dvec3> positions, std::span<glm::uvec3> triangles);

 private:
  void write_fans(std::span<glm::dvec3> positions) const;
  void write_points(std::span<glm::dvec3> positions) const;
  void write_pairs(const Cell& cell, std::span<glm::uvec3> triangles);
  void write_strip(const Strip& strip, std::span<glm::uvec3> triangles);
  void write_face(const Cell& cell, int axis, std::span<glm::dvec3> positions,
                  std::span<glm::uvec3> triangles);
  [[nodiscard]] glm::dvec3 middle(const Cell& cell, unsigned axis, const FaceSegment& line) const;
  [[nodiscard]] std::uint32_t fan_vertex(const Cell& cell, unsigned edge) const;
  [[nodiscard]] glm::dvec3 world(const glm::ivec3& lattice) const {
    return grid_.origin +
           glm::dvec3(lattice) / static_cast<double>(kLatticeSteps) * grid_.voxel_size;
  }

  const BlockNeighbours& blocks_;
  CellColumns columns_;
  const CellBlock& block_;
  glm::ivec3 low_;  ///< voxel
  const VoxelGrid& grid_;
  std::uint64_t next_triangle_ = 0;
  std::uint32_t next_middle_ = 0;
};

}  // namespace strata::contouring
