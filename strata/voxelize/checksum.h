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

}  // namespace strata
