#pragma once

#include <cstdint>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/voxelize/intervals.h"

namespace strata {

/// Counts the faces between the voxels of a set and the rest, slab by slab. Parts of a set may be
/// counted apart: faces between the rows of two parts are counted when both are there.
class BoundaryArea {
 public:
  /// For slabs of `grid` whose intervals run along `axis`.
  BoundaryArea(const VoxelGrid& grid, Axis axis);

  /// A row of voxels that the next row, or the one before, is missing of.
  struct Seam {
    struct Run {
      std::uint16_t u = 0;
      Interval interval;
      /// Equal members.
      friend bool operator==(const Run&, const Run&) = default;
    };
    int v = 0;
    bool first = false;     ///< the row before it is missing; else the one after it
    std::vector<Run> runs;  ///< its voxels: those of a column, in increasing u
    /// Equal members.
    friend bool operator==(const Seam&, const Seam&) = default;
  };

  /// Adds the rows of a slab. @pre slabs come in increasing v. O(columns + intervals)
  void add(const VoxelIntervals& slab, const Execution& execution);
  /// Adds what was counted elsewhere of other rows. @pre the arrays are faces() and take_seams()
  void add(const std::uint64_t (&faces)[3], std::vector<Seam> seams);
  /// The rows that are not counted in full, in increasing v. Call it after the last slab.
  [[nodiscard]] std::vector<Seam> take_seams();

  /// Faces whose normal is along x, y, z. @pre all rows were added, or take_seams() has the rest
  [[nodiscard]] const std::uint64_t (&faces() const)[3] { return faces_; }

  /// Area of the surface that the set approximates, in square world units: 2/3 of the area of the
  /// faces, since |nx| + |ny| + |nz| is 3/2 on average over all directions of a normal. Too small
  /// by a third for boxes along the axes, right for round shapes.
  [[nodiscard]] double estimate() const;

 private:
  void end_part();

  VoxelGrid grid_;
  AxisFrame frame_;
  std::uint64_t faces_[3] = {0, 0, 0};
  int next_v_ = 0;  ///< the row after the last one
  std::vector<Seam> seams_;
  std::vector<Seam::Run> last_row_;  ///< of the previous slab
};

}  // namespace strata
