#pragma once

#include <cstdint>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/voxelize/intervals.h"

namespace strata {

/// Counts the faces between the voxels of a set and the rest, slab by slab.
class BoundaryArea {
 public:
  /// For slabs of `grid` whose intervals run along `axis`.
  BoundaryArea(const VoxelGrid& grid, Axis axis);

  /// Adds the rows of a slab. @pre slabs come in increasing v, without gaps. O(columns + intervals)
  void add(const VoxelIntervals& slab, const Execution& execution);

  /// Faces whose normal is along x, y, z. @pre all slabs were added
  [[nodiscard]] const std::uint64_t (&faces() const)[3] { return faces_; }

  /// Area of the surface that the set approximates, in square world units: 2/3 of the area of the
  /// faces, since |nx| + |ny| + |nz| is 3/2 on average over all directions of a normal. Too small
  /// by a third for boxes along the axes, right for round shapes.
  [[nodiscard]] double estimate() const;

 private:
  VoxelGrid grid_;
  AxisFrame frame_;
  std::uint64_t faces_[3] = {0, 0, 0};
  // The last row of the previous slab, to compare with: the intervals of its columns in order.
  std::vector<std::uint32_t> last_offsets_;
  std::vector<Interval> last_items_;
};

}  // namespace strata
