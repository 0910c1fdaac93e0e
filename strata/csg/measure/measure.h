#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"

namespace strata::csg {

/// Sizes of a tree's result, from depth lists along three axes. Intervals and gaps between faces of
/// different solids that coincide (law 5) are left out: they have no thickness.
struct Measures {
  double volume = 0;  ///< cubic world units
  /// Bound for the parts that rays meet. It is the change of the inside length between two rays
  /// that the slopes of the faces met by both do not explain, plus half a lattice step of the
  /// surface for the snap, and more where the axes contradict each other.
  double volume_error = 0;
  double area = 0;        ///< square world units
  double area_error = 0;  ///< estimate: cells at outlines, or three times the spread between
                          ///< interleaved half grids
  glm::dvec3 centre{0};   ///< centre of mass, world space
  /// Bounds in world space: of the crossings and of the solids' vertices that lie on the result.
  glm::dvec3 low{0};
  glm::dvec3 high{0};  ///< the other corner
  /// Bound: no side of the result is farther from `low` or `high`. 0 where vertices decide all
  /// sides.
  double bounds_error = 0;
  int resolution = 0;                      ///< voxels along each side of the box measured on
  std::uint64_t result_crossings = 0;      ///< all axes
  std::uint64_t max_depth_complexity = 0;  ///< of the result
  bool empty = true;  ///< no ray met the result: it is empty or smaller than a voxel
};

/// Settings of measure().
struct MeasureOptions {
  /// Voxels along each side of the result's box, 1 to 32768. None: 256, then twice as many up to
  /// 1024 while volume_error is more than a thousandth of the volume and the lists are not very
  /// long.
  std::optional<int> resolution = {};
  /// As for Preview: faces nearer than this coincide.
  double relative_precision = 0;
};

/// Measures the result of `root` on a grid around result_bounds().
/// @return kUsage (resolution, a tree that check_tree() refuses), kGeometry, kLimit, kCancelled
Result<Measures> measure(const Tree& tree, Tree::NodeId root, const MeasureOptions& options = {},
                         const Execution& execution = {});
/// The same of the tree's root.
Result<Measures> measure(const Tree& tree, const MeasureOptions& options = {},
                         const Execution& execution = {});

}  // namespace strata::csg
