#pragma once

#include <memory>

#include "csg/picture/shade.h"
#include "csg/program.h"
#include "csg/translucent/translucent.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/raster/view.h"
#include "transparency/stream/fragment_source.h"

// The fragments of translucent trees, for techniques of transparency. Private to csg/input.

namespace strata::csg {

/// Translucent trees in a view.
struct TreeFragmentsInput {
  const TranslucentTrees& trees;
  View view;                        ///< of the samples
  const Program* opaque = nullptr;  ///< what stands among the translucent trees; null: nothing
};

/// Surfaces of translucent trees become fragments with the triangle, facing and colour of the solid
/// that they come from. What lies behind an opaque surface is hidden.
/// @param shader  gives the colours, in this call only @param owner  what `input` borrows from,
/// kept
/// @return kGeometry, kLimit, kCancelled
Result<std::shared_ptr<const transparency::FragmentSource>> make_tree_fragments(
    TreeFragmentsInput input, const Shader& shader, std::shared_ptr<const void> owner,
    const Execution& execution);

}  // namespace strata::csg
