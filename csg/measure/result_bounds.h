#pragma once

#include "csg/geometry.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"

namespace strata::csg {

/// The box around the result of `node`, not only around its operands: what a difference cuts off
/// does not count. Sides that corners of the operands do not settle are looked at from outside, on
/// 256 x 256 rays.
/// @param relative_precision as Preview has it
/// @return as Preview::draw()
Result<Bounds> result_bounds(const Tree& tree, Tree::NodeId node, double relative_precision = 0,
                             const Execution& execution = {});

/// A box around vertices of the solids that lie outside of `known` and that the result of `root`
/// reaches: close to each there are points of the result. Of each side the outermost vertices are
/// tried, until one is reached; one that lies within `tolerance` of another solid's surface is not
/// known to be. Empty where there is none.
/// @param geometry  of `tree`
[[nodiscard]] Bounds reached_vertices(const Tree& tree, Tree::NodeId root, const Geometry& geometry,
                                      const Bounds& known, double tolerance);

}  // namespace strata::csg
