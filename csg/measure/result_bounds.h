#pragma once

#include "csg/geometry.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"

namespace strata::csg {

/// The box around the result of `node`, not around its operands: parts that a difference removes do
/// not count. Sides that no vertex of the operands proves are measured from outside with 256 x 256
/// rays.
/// @param relative_precision  as for Preview
/// @return as Preview::draw()
Result<Bounds> result_bounds(const Tree& tree, Tree::NodeId node, double relative_precision = 0,
                             const Execution& execution = {});

/// A box around vertices outside of `known` that the result of `root` reaches, which means that
/// points of the result lie arbitrarily close to them. The outermost vertices of each side are
/// tried until the result reaches one. A vertex within `tolerance` of another solid's surface
/// counts as not reached. Empty where there is none.
/// @param geometry  the geometry of `tree`
[[nodiscard]] Bounds reached_vertices(const Tree& tree, Tree::NodeId root, const Geometry& geometry,
                                      const Bounds& known, double tolerance);

}  // namespace strata::csg
