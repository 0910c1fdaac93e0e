#pragma once

#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "strata/core/inside_rule.h"
#include "strata/core/result.h"
#include "strata/mesh/soup_tools.h"
#include "strata/mesh/triangle_soup.h"

// The words of csg/:
//   solid             a mesh at its place; a leaf of the tree
//   crossing          a point where a ray meets a triangle of a solid
//   transition        a point where a ray enters or leaves a solid; one or several crossings
//   visible surface   the first point of the tree's result on each ray; picture: its shaded image
//   coincide          two crossings so close that they may be the same face, stored twice (law 5)
//   program           the compiled tree: unions of edges, each of which may be inverted
//   flattened         a union below a union became part of it
//   true outside      the value of a node is true where a ray is outside of all solids
//   union operand     a solid that is an operand of the union at the top of the tree
//   subtracted        an odd number of differences above a solid subtract it
//   active box        the box outside of which a solid cannot change the result
//   vast              much larger than the result (kVast): half spaces made of huge cubes
//   ghost             a part that a picture shows beside the result, transparent
//   label             a number of a stretch of a result's list: names its solid or its colour
//   slot              the index of a solid in a tile; leaf: a solid as an operand of a program

namespace strata::csg {

/// Marks a colour whose red, green and blue come from the colour scheme; only alpha is set.
inline constexpr glm::vec3 kSchemeColour{-1.0f};

/// The colour of a face of a solid, which may have none or only an alpha.
[[nodiscard]] inline glm::vec4 colour_or(const std::optional<glm::vec4>& colour,
                                         const glm::vec4& scheme_colour) {
  if (!colour) return scheme_colour;
  return colour->r < 0.0f ? glm::vec4(glm::vec3(scheme_colour), colour->a) : *colour;
}

/// A leaf, or what a node does with its operands.
enum class Operation : std::uint8_t { kSolid, kUnion, kIntersection, kDifference };

/// A leaf of a tree: a mesh at its place. Many solids may share one mesh.
struct Solid {
  /// It may overlap itself, be open or inside out; null is the empty solid.
  std::shared_ptr<const TriangleSoup> mesh;
  glm::dmat4 world_from_mesh{1.0};  ///< affine; a mirroring one reverses the triangles
  /// Red, green, blue (or kSchemeColour), alpha in [0, 1]; empty: the scheme's.
  std::optional<glm::vec4> colour = {};
  InsideRule rule = InsideRule::kWinding;  ///< which winding numbers are inside
  std::string name = {};                   ///< for messages and pick: `cube at plate.csg:12:3`
};

/// A Boolean tree of solids, as a value. No limit on solids, depth or shape; nothing is required of
/// the solids (convexity, closedness, disjointness).
///
/// Trees combine by operators: `(a - b) | c`. Each operator copies the nodes of its right operand,
/// so a tree may be used any number of times; meshes are shared, not copied. `all |= part` takes
/// time in proportion to `part`.
///
/// Trees are also built node by node, bottom up: operands exist before the node that takes them.
/// Below one root each node is an operand once; append() makes further copies. check_tree() tells
/// whether a tree keeps these rules.
class Tree {
 public:
  using NodeId = std::uint32_t;                 ///< index into nodes()
  static constexpr NodeId kNone = 0xffffffffu;  ///< no node

  /// A node [kind | range of operands]. For a solid `first` is its index into solids().
  struct Node {
    Operation operation = Operation::kUnion;  ///< kSolid: a leaf
    std::uint32_t first = 0;                  ///< index into the operands, or of the solid
    std::uint32_t count = 0;                  ///< of operands
  };

  /// The empty set.
  Tree() = default;
  /// One solid.
  explicit Tree(Solid solid);
  /// One solid of the winding rule, without a name or a colour.
  explicit Tree(TriangleSoup mesh);

  /// A leaf. @return its node
  NodeId add_solid(Solid solid);
  /// A node over `operands`: union (none: empty), intersection (none: empty), difference (the first
  /// minus all others; none: empty). @pre all ids come from this tree
  NodeId add(Operation operation, std::span<const NodeId> operands);
  /// The same for operands in braces.
  NodeId add(Operation operation, std::initializer_list<NodeId> operands);
  /// Copies the subtrees below nodes of a tree, which may be this one, and moves the copies. Nodes
  /// and solids keep their order; nodes that several of the subtrees share are copied once.
  /// @return the copies of `nodes`
  std::vector<NodeId> append(const Tree& from, std::span<const NodeId> nodes,
                             const glm::dmat4& target_from_source = glm::dmat4(1.0));
  /// The same for one subtree.
  NodeId append(const Tree& from, NodeId node,
                const glm::dmat4& target_from_source = glm::dmat4(1.0));

  /// The node that is drawn, measured or voxelized; kNone: the empty set.
  void set_root(NodeId root) { root_ = root; }
  /// The node given to set_root(), else kNone.
  [[nodiscard]] NodeId root() const { return root_; }

  /// The union of the two roots becomes the root.
  Tree& operator|=(const Tree& other) { return combine(Operation::kUnion, other); }
  /// The intersection of the two roots becomes the root.
  Tree& operator&=(const Tree& other) { return combine(Operation::kIntersection, other); }
  /// The difference of the two roots becomes the root.
  Tree& operator-=(const Tree& other) { return combine(Operation::kDifference, other); }

  /// All leaves, in the order in which they were added.
  [[nodiscard]] std::span<const Solid> solids() const { return solids_; }
  /// The same, to move or colour them.
  [[nodiscard]] std::span<Solid> solids() { return solids_; }
  /// All nodes, operands first.
  [[nodiscard]] std::span<const Node> nodes() const { return nodes_; }
  /// The operands of a node, in order. @pre it is no leaf
  [[nodiscard]] std::span<const NodeId> operands(NodeId node) const {
    return std::span(operands_).subspan(nodes_[node].first, nodes_[node].count);
  }

 private:
  Tree& combine(Operation operation, const Tree& other);

  std::vector<Solid> solids_;
  std::vector<Node> nodes_;  ///< operands before the nodes that use them
  std::vector<NodeId> operands_;
  NodeId root_ = kNone;
};

/// Union.
[[nodiscard]] inline Tree operator|(Tree a, const Tree& b) { return std::move(a |= b); }
/// Intersection.
[[nodiscard]] inline Tree operator&(Tree a, const Tree& b) { return std::move(a &= b); }
/// Difference: `a` without `b`.
[[nodiscard]] inline Tree operator-(Tree a, const Tree& b) { return std::move(a -= b); }

/// Moves all solids of a tree. @pre the matrix is affine
[[nodiscard]] Tree transform(const glm::dmat4& target_from_source, Tree tree);

/// Checks that the nodes below `root` keep the rules of Tree, which functions that take a tree
/// require.
/// @return kUsage naming the node: an id that is unknown or not older than the node that takes it,
/// or a node that is an operand twice
Result<void> check_tree(const Tree& tree, Tree::NodeId root);

/// The least box around a solid in world space.
[[nodiscard]] Bounds bounds(const Solid& solid);

/// A solid this many times larger than the result counts as vast: it does not bound a picture, and
/// its vertices are clamped to the box in which it can change the result.
inline constexpr double kVast = 1000.0;

/// A box that the result of `node` lies in. For a union it is the union of the operands' boxes, for
/// an intersection their intersection, for a difference the box of the first operand. The first
/// operand may be vast compared with the part that axis-parallel boxes leave of it, such as a half
/// space made of a vast cube. Then it counts only with that part.
[[nodiscard]] Bounds bounds(const Tree& tree, Tree::NodeId node);
/// The same for the root.
[[nodiscard]] Bounds bounds(const Tree& tree);
/// The same, given the boxes of the tree's solids.
[[nodiscard]] Bounds bounds(const Tree& tree, Tree::NodeId node, std::span<const Bounds> solids);
/// Where a solid can change the result.
struct ActiveBox {
  Bounds box;  ///< outside of it the nodes above the solid are empty, whatever the solid is there
  bool subtracted = false;  ///< an odd number of differences above the solid subtract it
};
/// The active box of each solid. @param solids  boxes of the tree's solids
[[nodiscard]] std::vector<ActiveBox> active_boxes(const Tree& tree, std::span<const Bounds> solids);
/// The box that sets the depth range of a picture, given the boxes of the tree's solids: the box
/// around all of them, without cutters that are far larger than the visible nodes `shown`, since
/// those would leave no depth resolution.
[[nodiscard]] Bounds picture_box(const Tree& tree, std::span<const Bounds> solids,
                                 std::span<const Tree::NodeId> shown);

}  // namespace strata::csg
