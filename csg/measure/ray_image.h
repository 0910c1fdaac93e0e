#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"
#include "strata/raster/view.h"

namespace strata::csg {

/// What the rays of a view meet in a tree; row by row, the top row first.
struct RayImage {
  int width = 0, height = 0;
  /// World length along the ray of the first interval inside the tree: the material behind the
  /// visible surface. 0 where the ray misses; infinity where it does not leave the tree again.
  std::vector<float> thickness;
  /// The depth complexity: crossings with the solids of the tree, visible or not.
  std::vector<std::uint32_t> crossings;
  std::uint64_t fragments = 0;  ///< sum of crossings
};

/// Measures along the rays of a tree, in one view after another. It draws every crossing of every
/// solid into the HA-buffer and walks the lists, without culling.
class RayMeter {
 public:
  /// Keeps the tree's meshes alive.
  /// @param relative_precision  as for Preview
  /// @param counted  counts only crossings of this many first solids. The remaining solids are
  /// section cutters; crossings inside them are skipped
  RayMeter(const Tree& tree, Tree::NodeId root, double relative_precision,
           const Execution& execution = {}, std::size_t counted = SIZE_MAX);
  ~RayMeter();
  RayMeter(RayMeter&&) noexcept;
  RayMeter& operator=(RayMeter&&) noexcept;

  /// Intervals and gaps shorter than a tenth of a pixel or than the scene's precision are ignored:
  /// coinciding faces make such intervals. @return kGeometry, kLimit, kCancelled
  Result<RayImage> measure(const View& view, const Execution& execution = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace strata::csg
