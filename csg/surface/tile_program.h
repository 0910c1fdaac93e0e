#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "csg/program.h"
#include "csg/surface/leaf_layers.h"

// What remains of a program in a tile. Private to csg/.

namespace strata::csg {

/// What remains of a program in a part of a tile, where all other solids are absent. Leaves are
/// indices into the tile's leaves.
struct TileProgram {
  struct Node {
    std::uint32_t first = 0, count = 0;  ///< edges
    std::uint32_t nearest = 0;           ///< no transition lies before
  };
  std::vector<Program::Edge> edges;  ///< of a node: those true outside first, then nearest first
  std::vector<std::uint32_t>
      nearest;              ///< of each edge: no transition lies before; 0 for those true outside
  std::vector<Node> nodes;  ///< children before parents
  std::vector<std::uint32_t> leaves;  ///< that occur
  std::uint32_t root = 0;
  bool root_inverted = false;
  bool constant = false;  ///< no leaf matters; then `value` is the tree's value
  bool value = false;
  int depth = 0;  ///< nodes on the longest way from the root to a leaf, 255 at most
};

/// Between which depths the surface of an area or a tile lies.
struct SurfaceWindow {
  std::uint64_t begin = 0, end = 0xffffffffu;
  /// How far apart faces are that coincide, whatever they are.
  std::uint64_t margin = std::uint64_t{1} << 32;
  /// A solid that is subtracted and that all rays are in just before the window, if there is one.
  Program::Edge cover;
};

/// Simplifies a program for the leaves at hand: nodes that no leaf reaches are constant, and nodes
/// of one edge vanish. Pruning a tree to a part of space goes back to J. R. Woodwark and K. M.
/// Quinlan, "Reducing the effect of complexity on volume model evaluation" (1982). We differ: work
/// grows with the leaves present and the nodes above them, not with the tree.
class Simplifier {
 public:
  explicit Simplifier(const Program& program);
  /// @param present indices into `leaves` of those that may be met here
  void simplify(std::span<const LeafLayers> leaves, std::span<const std::uint32_t> present,
                TileProgram& out);

 private:
  struct Seen {
    std::uint32_t stamp = 0;
    std::uint32_t first_child = Program::kNone;  ///< into children_
    std::uint32_t out = 0;                       ///< node of the output
    std::uint32_t leaf = 0;                      ///< where the node is just a leaf
    enum class Kind : std::uint8_t { kNode, kLeaf, kTrue, kFalse } kind = Kind::kNode;
    bool inverted = false;  ///< kLeaf, kNode: it is the opposite of that
  };
  struct Child {
    std::uint32_t id;
    bool leaf, inverted;
    std::uint32_t next;
  };
  struct Sorted {
    Program::Edge edge;
    std::uint32_t nearest;
  };

  /// Marks the nodes above the leaves present, and lists the marked children of each.
  void mark(std::span<const LeafLayers> leaves, std::span<const std::uint32_t> present);
  /// Gathers the output's edges of a marked node, whose children are simplified already.
  /// @return whether the node is true whatever these are
  bool gather(std::uint32_t node, std::span<const LeafLayers> leaves, const TileProgram& out);
  /// The same for one child. @return whether it makes its node true
  bool gather_child(const Child& child, std::span<const LeafLayers> leaves, const TileProgram& out);
  /// Makes a node of the output of what was gathered. @return its index
  std::uint32_t add_node(std::span<const LeafLayers> leaves, TileProgram& out);
  /// Makes the root of the output of what the program's root became.
  void set_root(const Seen& top, std::span<const LeafLayers> leaves, TileProgram& out);

  const Program* program_;
  std::vector<Seen> seen_;
  std::vector<Child> children_;
  std::vector<std::uint32_t> marked_, stack_;
  std::vector<Sorted> gathered_;
  std::vector<std::uint8_t> out_true_outside_;  ///< of the output's nodes
  std::vector<std::uint8_t> out_depth_;
  std::uint32_t stamp_ = 0;
};

}  // namespace strata::csg
