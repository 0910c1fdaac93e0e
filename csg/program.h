#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "strata/csg/tree.h"

namespace strata::csg {

/// A tree compiled for evaluation. Every node is a union of edges, and an edge may turn its child
/// around: A - B is not(not A or B), A and B is not(not A or not B). So one kind of node serves all
/// of them, and unions below unions melt into one node.
///
/// A solid appears once as a leaf. Leaves are solids by their index; a solid that the root does not
/// reach has no parent.
struct Program {
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// [child:30 | leaf:1 | inverted:1]
  struct Edge {
    std::uint32_t bits = 0;
    Edge() = default;
    Edge(std::uint32_t child, bool leaf, bool inverted)
        : bits(child << 2 | (leaf ? 2u : 0u) | (inverted ? 1u : 0u)) {}
    [[nodiscard]] std::uint32_t child() const { return bits >> 2; }  ///< a solid or a node
    [[nodiscard]] bool leaf() const { return (bits & 2) != 0; }
    [[nodiscard]] bool inverted() const { return (bits & 1) != 0; }
  };
  /// Above a leaf or node: the node whose edge it hangs from, and whether that edge is inverted.
  struct Up {
    std::uint32_t parent = kNone;
    bool inverted = false;
  };
  struct Node {
    std::uint32_t first = 0, count = 0;  ///< edges
    std::uint32_t idle_true = 0;         ///< edges that say true while every solid is outside
    Up up;
  };

  std::vector<Edge> edges;
  std::vector<Node> nodes;  ///< children before parents; the last one is the root
  std::vector<Up> leaves;   ///< of each solid of the tree

  /// Whether a solid is united with all the rest: inside it is inside the tree.
  [[nodiscard]] bool plain(std::uint32_t solid) const {
    const Up& up = leaves[solid];
    return up.parent + 1 == nodes.size() && !up.inverted;
  }
  [[nodiscard]] bool idle(std::uint32_t node) const { return nodes[node].idle_true > 0; }
  /// The tree's value with every solid outside.
  [[nodiscard]] bool idle_value() const {
    return !nodes.empty() && idle(static_cast<std::uint32_t>(nodes.size() - 1));
  }
};

/// Compiles the tree below `root`; kNone gives the empty set. O(nodes), without recursion.
[[nodiscard]] Program compile(const Tree& tree, Tree::NodeId root);

/// The state of a program along one ray: for each solid whether the ray is inside, for each node
/// how many of its edges say true. A flip climbs only while nodes change.
class ProgramState {
 public:
  explicit ProgramState(const Program& program);

  /// Every solid outside again. O(nodes + solids), in words.
  void reset();
  /// Turns a solid's bit around.
  void flip(std::uint32_t solid) {
    ++known_stamp_;
    inside_[solid] ^= 1;
    Program::Up up = program_->leaves[solid];
    if (up.parent == Program::kNone) return;
    bool value = inside_[solid] != 0;
    while (up.parent != Program::kNone) {
      std::uint32_t& count = counts_[up.parent];
      const bool before = count > 0;
      count += value != up.inverted ? 1u : ~0u;
      const bool after = count > 0;
      if (before == after) return;
      value = after;
      up = program_->nodes[up.parent].up;
    }
    value_ = !value_;
  }
  /// Turns the bits of all of them around at once: each node is asked once, however many of its
  /// solids turn. In a chain of differences one after another would each climb to the root.
  void flip_all(std::span<const std::uint32_t> solids);
  [[nodiscard]] bool inside(std::uint32_t solid) const { return inside_[solid] != 0; }
  [[nodiscard]] bool value() const { return value_; }  ///< of the whole tree
  [[nodiscard]] const Program& program() const { return *program_; }
  /// Whether the tree has its value also because of this solid's: on the way up, no node that is
  /// true stands on other edges alone. Asked for all solids between two flips it is O(nodes).
  [[nodiscard]] bool supports(std::uint32_t solid) { return above(solid).supports; }
  /// Whether the tree has its value because of this solid's alone: a flip would turn it around. As
  /// quick as supports().
  [[nodiscard]] bool decides(std::uint32_t solid) { return above(solid).decides; }

 private:
  /// How the tree's value rests on one of its nodes or solids.
  struct Weight {
    bool supports = true, decides = true;
  };
  struct Known {
    std::uint64_t stamp = 0;
    Weight weight;
    std::uint64_t touched = 0;  ///< flip_all(): a stamp, and its value before
    bool before = false;
  };
  [[nodiscard]] Weight above(std::uint32_t solid);

  const Program* program_;
  std::vector<std::uint32_t> idle_counts_, counts_;
  std::vector<std::uint8_t> inside_;
  bool value_ = false;
  std::uint64_t known_stamp_ = 1;  ///< of the state as it is
  std::vector<Known> known_;       ///< of nodes
  std::vector<std::uint32_t> climbed_, touched_;
};

}  // namespace strata::csg
