#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

// Private to voxelize/.

namespace strata {

/// What a walk saw of the columns of a tile.
struct TileCounts {
  std::uint64_t unbalanced = 0;  ///< columns whose winding number does not return to 0
  std::uint64_t negative = 0;    ///< columns whose winding number falls below 0
  std::uint64_t max_depth = 0;
  /// Columns with n = 1..63 fragments at [n], the deeper ones at [64]; filled when asked for.
  std::uint64_t histogram[65] = {};

  void clear() { *this = {}; }
  /// Counts a column.
  /// @param winding behind its last crossing, `lowest` anywhere
  void add(int winding, int lowest, std::size_t depth, bool with_histogram) {
    if (winding != 0) ++unbalanced;
    if (lowest < 0) ++negative;
    max_depth = std::max<std::uint64_t>(max_depth, depth);
    if (with_histogram && depth > 0) ++histogram[std::min<std::size_t>(depth, 64)];
  }
};

}  // namespace strata
