#pragma once

#include "core/execution.h"
#include "core/result.h"
#include "csg/tree.h"

namespace strata::csg {

/// The box around the result of `node`, not only around its operands: what a difference cuts off
/// does not count. Sides that corners of the operands do not settle are looked at from outside, on
/// 256 x 256 rays.
/// @param relative_precision as Preview has it
/// @return as Preview::draw()
Result<Bounds> result_bounds(const Tree& tree, Tree::NodeId node, double relative_precision = 0,
                             const Execution& execution = {});

}  // namespace strata::csg
