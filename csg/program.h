#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "strata/csg/tree.h"

namespace strata::csg {

/// A tree compiled for evaluation. Every node is a union of edges, and an edge may invert its
/// child: A - B is not(not A or B), A and B is not(not A or not B). So one kind of node serves all
/// of them, and nested unions are flattened into one node.
///
/// Blist (J. Rossignac, "Blist: A Boolean list formulation of CSG trees", 1999) and Blister (J.
/// Hable and J. Rossignac, "Blister: GPU-based rendering of Boolean combinations of free-form
/// triangulated shapes", 2005) normalize operations, too. We differ: the tree stays a tree with
/// counts, so that a transition updates only the nodes that change; they evaluate a list of all
/// primitives with a few bits of state.
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
    std::uint32_t true_when_outside =
        0;  ///< edges that are true while the ray is outside of all solids
    Up up;
  };

  std::vector<Edge> edges;
  std::vector<Node> nodes;  ///< children before parents; the last one is the root
  std::vector<Up> leaves;   ///< of each solid of the tree

  /// Whether a solid is an operand of the union at the top: inside it is inside the tree.
  [[nodiscard]] bool is_union_operand(std::uint32_t solid) const {
    const Up& up = leaves[solid];
    return up.parent + 1 == nodes.size() && !up.inverted;
  }
  [[nodiscard]] bool true_when_outside(std::uint32_t node) const {
    return nodes[node].true_when_outside > 0;
  }
  /// The tree's value outside of all solids.
  [[nodiscard]] bool value_when_outside() const {
    return !nodes.empty() && true_when_outside(static_cast<std::uint32_t>(nodes.size() - 1));
  }
};

/// Compiles the tree below `root`; kNone gives the empty set. O(nodes), without recursion.
[[nodiscard]] Program compile(const Tree& tree, Tree::NodeId root);

/// The state of a program along one ray: for each solid whether the ray is inside, for each node
/// how many of its edges are true. A transition climbs only while nodes change.
///
/// To classify a ray against each solid and combine along the tree is S. D. Roth, "Ray casting for
/// modeling solids" (1982). We differ: no intervals are merged at the nodes; transitions of all
/// solids are sorted together and the tree's value is kept up to date from one to the next.
class ProgramState {
 public:
  explicit ProgramState(const Program& program);

  /// Every solid outside again. O(nodes + solids), in words.
  void reset();
  /// Enters or leaves a solid.
  void toggle(std::uint32_t solid) {
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
  /// Enters or leaves all of them at once: each node is updated once, however many of its solids
  /// change. In a chain of differences, each toggle() would climb to the root.
  void toggle_all(std::span<const std::uint32_t> solids);
  [[nodiscard]] bool inside(std::uint32_t solid) const { return inside_[solid] != 0; }
  [[nodiscard]] bool value() const { return value_; }  ///< of the whole tree
  [[nodiscard]] const Program& program() const { return *program_; }
  /// From now on until the next toggle, rays may be inside or outside of each of these solids, as
  /// contributes() has it. @param solids  each once
  void vary(std::span<const std::uint32_t> solids);
  /// Whether the tree has its value also because of this solid's, one of those that vary: on the
  /// way up, no node that is true stands on other edges alone, and none is true whatever the solids
  /// that vary. So a solid without effect does not contribute, such as a cutter of a solid that the
  /// ray is outside of, or a solid that the root does not reach. Asked for all solids between two
  /// transitions it is O(nodes).
  [[nodiscard]] bool contributes(std::uint32_t solid) { return above(solid).contributes; }
  /// Whether the tree has its value because of this solid's alone: a transition of that solid would
  /// change it. As quick as contributes().
  [[nodiscard]] bool decides(std::uint32_t solid) { return above(solid).decides; }

 private:
  /// How the tree's value rests on one of its nodes or solids.
  struct Weight {
    bool contributes = true, decides = true;
  };
  struct Known {
    std::uint64_t stamp = 0;  ///< known_stamp_ when `weight` was found
    Weight weight;
    std::uint64_t touched = 0;  ///< known_stamp_ when `before` or `steady` was found
    bool before = false;        ///< toggle_all(): the node's value before
    std::uint32_t steady = 0;   ///< vary(): edges that are true in any case
  };
  [[nodiscard]] Weight above(std::uint32_t solid);

  const Program* program_;
  std::vector<std::uint32_t> outside_counts_, counts_;
  std::vector<std::uint8_t> inside_;
  bool value_ = false;
  std::uint64_t known_stamp_ = 1;  ///< of the state as it is
  std::vector<Known> known_;       ///< of nodes
  std::vector<std::uint32_t> climbed_, touched_;
};

}  // namespace strata::csg
