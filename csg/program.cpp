#include "csg/program.h"

#include <algorithm>
#include <functional>
#include <utility>

namespace strata::csg {
namespace {

/// Edges of each program node in the order of the tree; nodes are numbered from the root down.
using EdgeLists = std::vector<std::vector<Program::Edge>>;

/// Whether a node's edges go to the union above it, which sees the node inverted or not:
/// not(A - B) = not A or B and not(A and B) = not A or not B are unions of inverted edges.
bool is_flattened(const Tree::Node& node, bool inverted) {
  if (node.count == 0 && inverted) return false;  // everything: a node of its own
  return inverted ? node.operation != Operation::kUnion : node.operation == Operation::kUnion;
}

/// The edges below `root`.
EdgeLists flatten(const Tree& tree, Tree::NodeId root) {
  struct Visit {
    Tree::NodeId node;
    std::uint32_t target;  // the program node that takes its edges
    bool inverted;         // how the target sees it
  };
  EdgeLists lists(1);
  std::vector<Visit> stack{{root, 0, false}};
  while (!stack.empty()) {
    const Visit visit = stack.back();
    stack.pop_back();
    const Tree::Node& node = tree.nodes()[visit.node];
    if (node.operation == Operation::kSolid) {
      lists[visit.target].emplace_back(node.first, true, visit.inverted);
      continue;
    }
    const auto operands = tree.operands(visit.node);
    std::uint32_t target = visit.target;
    bool inverted = visit.inverted;  // of `target`'s union over this node
    if (!is_flattened(node, inverted)) {
      target = static_cast<std::uint32_t>(lists.size());
      lists[visit.target].emplace_back(target, false, true);
      lists.emplace_back();
      inverted = !inverted;
      if (operands.empty()) {
        // inverted was true: not(empty); the new node is empty, and its edge is inverted. A node
        // that is not inverted and no union is an empty difference: the new node must be true.
        if (inverted) {
          lists.emplace_back();
          lists[target].emplace_back(static_cast<std::uint32_t>(lists.size() - 1), false, true);
        }
        continue;
      }
    }
    // In `target`'s union, an operand that counts positively in this node has the node's inversion.
    for (std::size_t i = operands.size(); i-- > 0;) {
      const bool negative = node.operation == Operation::kDifference && i > 0;
      stack.push_back({operands[i], target, inverted != negative});
    }
  }
  return lists;
}

}  // namespace

Program compile(const Tree& tree, Tree::NodeId root) {
  Program program;
  program.leaves.resize(tree.solids().size());
  if (root == Tree::kNone) return program;
  const EdgeLists lists = flatten(tree, root);
  // Numbered from the root down, parents come first; the other way around children do.
  const auto count = static_cast<std::uint32_t>(lists.size());
  const auto renumbered = [count](std::uint32_t node) { return count - 1 - node; };
  program.nodes.resize(count);
  for (std::uint32_t id = 0; id < count; ++id) {
    const std::vector<Program::Edge>& list = lists[renumbered(id)];
    Program::Node& node = program.nodes[id];
    node.first = static_cast<std::uint32_t>(program.edges.size());
    node.count = static_cast<std::uint32_t>(list.size());
    for (const Program::Edge& edge : list) {
      const std::uint32_t child = edge.leaf() ? edge.child() : renumbered(edge.child());
      program.edges.emplace_back(child, edge.leaf(), edge.inverted());
      const Program::Up up{id, edge.inverted()};
      (edge.leaf() ? program.leaves[child] : program.nodes[child].up) = up;
      const bool true_outside = edge.leaf() ? false : program.true_when_outside(child);
      node.true_when_outside += true_outside != edge.inverted() ? 1 : 0;
    }
  }
  return program;
}

ProgramState::ProgramState(const Program& program)
    : program_(&program),
      outside_counts_(program.nodes.size()),
      inside_(program.leaves.size()),
      known_(program.nodes.size()) {
  for (std::size_t i = 0; i < outside_counts_.size(); ++i) {
    outside_counts_[i] = program.nodes[i].true_when_outside;
  }
  reset();
}

void ProgramState::reset() {
  ++known_stamp_;
  counts_ = outside_counts_;
  std::fill(inside_.begin(), inside_.end(), std::uint8_t{0});
  value_ = program_->value_when_outside();
}

void ProgramState::toggle_all(std::span<const std::uint32_t> solids) {
  ++known_stamp_;
  const auto count = [&](const Program::Up& up, bool value) {
    Known& known = known_[up.parent];
    if (known.touched != known_stamp_) {
      known.touched = known_stamp_;
      known.before = counts_[up.parent] > 0;
      touched_.push_back(up.parent);
      std::push_heap(touched_.begin(), touched_.end(), std::greater<>());
    }
    counts_[up.parent] += value != up.inverted ? 1u : ~0u;
  };
  for (const std::uint32_t solid : solids) {
    inside_[solid] ^= 1;
    const Program::Up& up = program_->leaves[solid];
    if (up.parent != Program::kNone) count(up, inside_[solid] != 0);
  }
  while (!touched_.empty()) {  // children before parents
    std::pop_heap(touched_.begin(), touched_.end(), std::greater<>());
    const std::uint32_t node = touched_.back();
    touched_.pop_back();
    const bool value = counts_[node] > 0;
    if (value == known_[node].before) continue;
    const Program::Up& up = program_->nodes[node].up;
    if (up.parent == Program::kNone) {
      value_ = !value_;
    } else {
      count(up, value);
    }
  }
}

void ProgramState::vary(std::span<const std::uint32_t> solids) {
  ++known_stamp_;
  for (const std::uint32_t solid : solids) {
    bool value = inside_[solid] != 0;
    Program::Up up = program_->leaves[solid];
    while (up.parent != Program::kNone) {  // to the first node that does not begin to vary
      Known& known = known_[up.parent];
      const bool varied = known.touched == known_stamp_ && known.steady == 0;
      if (known.touched != known_stamp_) {
        known.touched = known_stamp_;
        known.steady = counts_[up.parent];
      }
      if (value != up.inverted) --known.steady;
      if (varied || known.steady > 0) break;
      value = counts_[up.parent] > 0;
      up = program_->nodes[up.parent].up;
    }
  }
}

ProgramState::Weight ProgramState::above(std::uint32_t solid) {
  Weight weight;
  Program::Up up = program_->leaves[solid];
  if (up.parent == Program::kNone) return {false, false};
  climbed_.clear();
  while (up.parent != Program::kNone) {
    const Known& known = known_[up.parent];
    if (known.stamp == known_stamp_) {
      weight = known.weight;
      break;
    }
    climbed_.push_back(up.parent);
    up = program_->nodes[up.parent].up;
  }
  // How the tree's value rests on an edge whose value is `edge`, given how it rests on its node.
  const auto through = [&](Weight node, std::uint32_t index, bool edge) {
    const std::uint32_t count = counts_[index];
    const bool varies = known_[index].touched == known_stamp_ && known_[index].steady == 0;
    return Weight{node.contributes && varies && (edge || count == 0),
                  node.decides && count == (edge ? 1u : 0u)};
  };
  for (std::size_t i = climbed_.size(); i-- > 0;) {
    const std::uint32_t node = climbed_[i];
    const Program::Up& to = program_->nodes[node].up;
    if (to.parent != Program::kNone) {
      weight = through(weight, to.parent, (counts_[node] > 0) != to.inverted);
    }
    known_[node].stamp = known_stamp_;
    known_[node].weight = weight;
  }
  up = program_->leaves[solid];
  return through(known_[up.parent].weight, up.parent, inside(solid) != up.inverted);
}

}  // namespace strata::csg
