#pragma once

#include <array>
#include <cstdint>

#include "contour/block_walk.h"
#include "contour/cell_blocks.h"

// Cut edges in a row whose triangles lie in one plane. Private to contour/.
//
// The vertices of the cells on either side of an edge are its rails. Where both vertices of each
// rail lie at the same place of their cells, the rails are parallel to an axis, and next to such an
// edge another one goes on in the same plane. Such a run becomes a strip between two straight
// rails. The vertices along a rail vanish unless another shape needs them; if one does, the
// triangles of all strips at the rail have it. So the surface stays the same, point by point.

namespace strata::contouring {

/// The runs of a block.
class StripFinder {
 public:
  /// Adds the edge along `axis` at the lower side of a cell. @param points  of the cells around it,
  /// as edge_shape() takes them
  void add(const LocalPlace& cell, int axis, const std::array<glm::ivec3, 4>& points);
  /// Sets CellBlock::strips, EdgeShape::kStrip of their edges, and CellBlock::strip_uses. Forgets
  /// what was added.
  void find(const BlockNeighbours& blocks);

 private:
  void add_strip(const BlockNeighbours& blocks, const Strip& strip);

  using Columns = std::array<std::uint32_t, kBlockSide * kBlockSide>;
  /// By axis of the edge, and whether the run is along the second axis after it; then by the cell's
  /// place along the axes that the run is not along. Bit: the place along the run.
  std::array<std::array<Columns, 2>, 3> straight_{};
};

/// The vertices of the mesh along both rails of a strip, from its beginning. Seen from the end of
/// its edges, the strip lies to the left of the rail that its outline goes forward along.
/// @pre the vertices are numbered
struct StripRails {
  std::array<std::uint32_t, kBlockSide + 1> forward{}, back{};
  std::array<std::uint8_t, kBlockSide + 1> forward_at{}, back_at{};  ///< cells from the beginning
  std::size_t forward_count = 0, back_count = 0;

  StripRails(const BlockNeighbours& blocks, const Strip& strip);
  [[nodiscard]] std::size_t triangles() const { return forward_count + back_count - 2; }
};

}  // namespace strata::contouring
