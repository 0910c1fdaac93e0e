#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <vector>

#include "strata/csg/tree.h"

// Labels divide the result of a tree into parts. A point belongs to the first solid of the tree
// that holds it and is not subtracted. SolidLists::set_labels() makes lists that name the parts by
// the labels of their solids.

namespace strata::csg {

/// The solids below `root` that are not subtracted, in the order of the tree's operands.
[[nodiscard]] std::vector<std::uint32_t> added_solids(const Tree& tree, Tree::NodeId root);

/// Labels that divide a tree into parts of one colour.
struct ColourLabels {
  std::vector<std::uint32_t>
      labels;  ///< one for each solid of the tree; colour n has the label n + 1
  std::vector<glm::vec4>
      colours;  ///< of the solids that are not subtracted, in order of appearance
};

/// @param none  the colour of solids without one
[[nodiscard]] ColourLabels colour_labels(const Tree& tree, Tree::NodeId root,
                                         const glm::vec4& none);

/// Labels that divide a tree into its solids: solid n has the label n + 1.
[[nodiscard]] std::vector<std::uint32_t> id_labels(const Tree& tree);

}  // namespace strata::csg
