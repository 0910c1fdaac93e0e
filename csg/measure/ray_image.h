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

/// What the rays of a view meet in a tree, row by row from the top.
struct RayImage {
  int width = 0, height = 0;
  /// World length of the material behind the visible surface, along the ray: of the first interval
  /// that lies inside the tree. 0 where the ray misses; infinity where it does not come out again.
  std::vector<float> thickness;
  /// Crossings with the solids of the tree, whether they show or not: depth complexity.
  std::vector<std::uint32_t> crossings;
  std::uint64_t fragments = 0;  ///< sum of crossings
};

/// Measures along the rays of a tree, in one view after another. Draws every crossing of every
/// solid into the HA-buffer and walks the lists; nothing is culled.
class RayMeter {
 public:
  /// Keeps the tree's meshes alive. @param relative_precision as Preview has it
  /// @param counted crossings are counted with so many of the tree's first solids, and outside of
  /// all others: those are sections, which take away and are nothing themselves
  RayMeter(const Tree& tree, Tree::NodeId root, double relative_precision,
           const Execution& execution = {}, std::size_t counted = SIZE_MAX);
  ~RayMeter();
  RayMeter(RayMeter&&) noexcept;
  RayMeter& operator=(RayMeter&&) noexcept;

  /// Intervals and gaps that faces which coincide would leave (a tenth of a pixel, the scene's own
  /// digits) are none. @return kGeometry, kLimit, kCancelled
  Result<RayImage> measure(const View& view, const Execution& execution = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace strata::csg
