#include "strata/csg/solid_lists.h"

#include <array>
#include <bit>
#include <map>
#include <numeric>
#include <utility>

namespace strata::csg {
namespace {

/// What orders colours: their bits, so that even one that is no number is equal to itself.
std::array<std::uint32_t, 4> key_of(const glm::vec4& colour) {
  std::array<std::uint32_t, 4> key{};
  for (int i = 0; i < 4; ++i) {
    key[static_cast<std::size_t>(i)] = std::bit_cast<std::uint32_t>(colour[i] + 0.0f);  // no -0
  }
  return key;
}

}  // namespace

std::vector<std::uint32_t> added_solids(const Tree& tree, Tree::NodeId root) {
  std::vector<std::uint32_t> solids;
  if (root == Tree::kNone) return solids;
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

ColourLabels colour_labels(const Tree& tree, Tree::NodeId root, const glm::vec4& none) {
  ColourLabels result;
  result.labels.resize(tree.solids().size(), 1);
  std::map<std::array<std::uint32_t, 4>, std::uint32_t> labels;
  for (const std::uint32_t solid : added_solids(tree, root)) {
    const glm::vec4 colour = colour_or(tree.solids()[solid].colour, none);
    const auto next = static_cast<std::uint32_t>(result.colours.size()) + 1;
    const auto [at, is_new] = labels.try_emplace(key_of(colour), next);
    result.labels[solid] = at->second;
    if (is_new) result.colours.push_back(colour);
  }
  return result;
}

std::vector<std::uint32_t> id_labels(const Tree& tree) {
  std::vector<std::uint32_t> labels(tree.solids().size());
  std::iota(labels.begin(), labels.end(), 1u);
  return labels;
}

}  // namespace strata::csg
