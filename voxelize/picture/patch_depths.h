#pragma once

#include <glm/vec2.hpp>
#include <limits>
#include <vector>

#include "strata/core/execution.h"
#include "strata/raster/view.h"
#include "strata/voxelize/intervals.h"
#include "voxelize/picture/occupied_blocks.h"

namespace strata {

/// Between which distances along the view axis the rays of each 8 x 8 pixels of a view may meet
/// solid voxels: those of the bricks that cover the pixels. Rays need not search elsewhere.
class PatchDepths {
 public:
  static constexpr int kSide = 8;  ///< pixels

  struct Range {
    double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
    /// No brick covers the pixels.
    [[nodiscard]] bool empty() const { return !(nearest <= farthest); }
  };

  PatchDepths(const VoxelIntervals& set, const OccupiedBlocks& blocks, const View& view,
              const Execution& execution);

  /// Of the patch with pixel (u, v).
  [[nodiscard]] const Range& at(int u, int v) const {
    return ranges_[static_cast<std::size_t>(v / kSide) * static_cast<std::size_t>(across_) +
                   static_cast<std::size_t>(u / kSide)];
  }

 private:
  int across_ = 0;
  std::vector<Range> ranges_;
};

}  // namespace strata
