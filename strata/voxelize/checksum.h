#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/voxelize/intervals.h"

namespace strata {

/// A 64-bit hash of a set of solid voxels and its grid. Equal for equal sets and grids, whatever
/// the axis of the intervals, the slabs and their order, the threads or the machine; different for
/// different sets, except with a probability of about 2^-60.
///
/// The sum over the solid voxels of f(x) g(y) h(z), modulo the prime 2^61 - 1, with f, g, h
/// pseudo-random: a polynomial that vanishes only by chance (Schwartz, 1980; Zippel, 1979), and
/// whose sum along an interval is a difference of two prefix sums. Not safe against adversaries.
class SetChecksum {
 public:
  /// Of the empty set on `grid`.
  explicit SetChecksum(const VoxelGrid& grid);
  /// Adds the voxels of a slab; the voxels of different calls must be disjoint. O(intervals).
  /// @pre slab.grid() is the grid given above
  void add(const VoxelIntervals& slab, const Execution& execution = {});
  /// The sum so far, which other parts of the set, added elsewhere, are added to. Below 2^61.
  [[nodiscard]] std::uint64_t sum() const { return sum_; }
  /// Adds the sum of other voxels of the same grid. @pre below 2^61
  void add_sum(std::uint64_t sum);
  /// The hash of all that was added.
  [[nodiscard]] std::uint64_t value() const;

 private:
  VoxelGrid grid_;
  /// By axis: prefix[i] is the sum of the factors of indices 0 .. i-1, modulo the prime.
  std::array<std::vector<std::uint64_t>, 3> prefix_;
  std::uint64_t sum_ = 0;
};

/// The checksum of a set held in one piece.
[[nodiscard]] std::uint64_t set_checksum(const VoxelIntervals& set,
                                         const Execution& execution = {});

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
