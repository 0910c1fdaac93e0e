#pragma once

#include <glm/vec4.hpp>
#include <vector>

#include "csg/tree.h"

namespace strata::csg {

/// What of a tree's result has one colour.
struct ColourPart {
  glm::vec4 colour{0};  ///< red, green, blue, alpha in [0, 1]
  Tree tree;            ///< its root is the part
};

/// Cuts the result below `root` into parts of one colour each, by first appearance. They are
/// disjoint and together the result: a point has the colour of the first solid of the tree that
/// holds it, of those that are not taken away from something. `none` is the colour of solids
/// without one. An empty result has no parts.
[[nodiscard]] std::vector<ColourPart> colour_parts(const Tree& tree, Tree::NodeId root,
                                                   const glm::vec4& none);

}  // namespace strata::csg
