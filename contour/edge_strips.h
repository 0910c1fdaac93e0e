#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "contour/block_walk.h"
#include "contour/cell_blocks.h"

// Cut edges side by side whose triangles lie in one plane. Private to contour/.
//
// The vertices of the cells on either side of an edge are its rails. Where both vertices of each
// rail lie at the same place of their cells, the rails are parallel to an axis, and next to such an
// edge another one goes on in the same plane. Such a run becomes a strip between two straight
// rails. Runs side by side become one strip where their edges are straight along both axes. The
// vertices on the sides of a strip vanish unless another shape needs them; if one does, the
// triangles of all strips at that side have it. So the surface stays the same, point by point.

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
  using Columns = std::array<std::uint32_t, kBlockSide * kBlockSide>;

  void find_runs(int axis, std::size_t way);
  [[nodiscard]] bool is_flat(const Strip& line, int other) const;
  void add_strip(const BlockNeighbours& blocks, const Strip& strip) const;

  /// By axis of the edge, and whether the run is along the second axis after it; then by the cell's
  /// place along the axes that the run is not along. Bit: the place along the run.
  std::array<std::array<Columns, 2>, 3> straight_{};
  std::vector<Strip> found_, open_, next_;
};

/// The vertices of the mesh around a strip, counter-clockwise seen from the end of its edges: along
/// its first side, at the end of the run, back along the third side, and at the beginning of the
/// run. @pre the vertices are numbered
class StripOutline {
 public:
  StripOutline(const BlockNeighbours& blocks, const Strip& strip);
  [[nodiscard]] std::size_t triangles() const { return count_ - 2; }
  /// Calls visit(a, b, c) for the triangles between the vertices.
  template <class Visit>
  void triangulate(Visit&& visit) const;

 private:
  std::array<std::uint32_t, 4 * kBlockSide + 1> vertices_{};  ///< the first one again at the end
  std::array<std::uint8_t, 4 * kBlockSide> along_{};          ///< cells along the run
  std::array<std::size_t, 4> corners_{};                      ///< where the sides begin
  std::size_t count_ = 0;
};

// No triangle may have all its corners on one side. So the vertices at the ends of the run are
// joined to a vertex inside the first side, or of the third. Then the first and the third side are
// gone along at once.
template <class Visit>
void StripOutline::triangulate(Visit&& visit) const {
  std::size_t low = 0, low_end = corners_[1], high = corners_[3], high_end = corners_[2];
  const auto fan = [&](std::size_t from, std::size_t to, std::size_t apex) {
    for (std::size_t n = from; n < to; ++n) visit(vertices_[n], vertices_[n + 1], vertices_[apex]);
  };
  if (count_ - corners_[3] > 1) fan(corners_[3], count_, ++low);
  if (corners_[2] - corners_[1] > 1) {
    fan(corners_[1], corners_[2], low < low_end ? --low_end : ++high_end);
  }
  while (low < low_end || high > high_end) {
    if (high == high_end || (low < low_end && along_[low + 1] <= along_[high - 1])) {
      visit(vertices_[low], vertices_[low + 1], vertices_[high]);
      ++low;
    } else {
      visit(vertices_[low], vertices_[high - 1], vertices_[high]);
      --high;
    }
  }
}

}  // namespace strata::contouring
