#include "csg/colour_parts.h"

#include <algorithm>
#include <utility>

namespace strata::csg {
namespace {

/// The solids below `root` that are not taken away, in the order of the tree's operands.
std::vector<std::uint32_t> added_solids(const Tree& tree, Tree::NodeId root) {
  std::vector<std::uint32_t> solids;
  std::vector<std::pair<Tree::NodeId, bool>> stack{{root, true}};  // and whether it adds
  while (!stack.empty()) {
    const auto [id, adds] = stack.back();
    stack.pop_back();
    const Tree::Node& node = tree.nodes()[id];
    if (node.operation == Operation::kSolid) {
      if (adds) solids.push_back(node.first);
      continue;
    }
    const auto operands = tree.operands(id);
    for (std::size_t i = operands.size(); i-- > 0;) {
      const bool taken = node.operation == Operation::kDifference && i > 0;
      stack.emplace_back(operands[i], adds != taken);
    }
  }
  return solids;
}

}  // namespace

std::vector<ColourPart> colour_parts(const Tree& tree, Tree::NodeId root, const glm::vec4& none) {
  std::vector<ColourPart> parts;
  if (root == Tree::kNone) return parts;
  const std::vector<std::uint32_t> solids = added_solids(tree, root);
  const auto colour_of = [&](std::uint32_t solid) {
    return tree.solids()[solid].colour.value_or(none);
  };
  for (const std::uint32_t solid : solids) {
    const glm::vec4 colour = colour_of(solid);
    const auto same = [&](const ColourPart& part) { return part.colour == colour; };
    if (std::none_of(parts.begin(), parts.end(), same)) parts.push_back({colour, tree});
  }
  for (ColourPart& part : parts) {
    part.tree.set_root(root);
    if (parts.size() == 1) break;
    // From the last solid to the first: one of this colour adds, any other takes what it holds.
    Tree::NodeId held = Tree::kNone;
    for (auto at = solids.rbegin(); at != solids.rend(); ++at) {
      const bool own = colour_of(*at) == part.colour;
      if (!own && held == Tree::kNone) continue;
      const Tree::NodeId solid = part.tree.add_solid(tree.solids()[*at]);
      held = held == Tree::kNone ? solid
             : own               ? part.tree.add(Operation::kUnion, {solid, held})
                                 : part.tree.add(Operation::kDifference, {held, solid});
    }
    part.tree.set_root(part.tree.add(Operation::kIntersection, {root, held}));
  }
  return parts;
}

}  // namespace strata::csg
