#pragma once

#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "strata/core/inside_rule.h"
#include "strata/mesh/soup_tools.h"
#include "strata/mesh/triangle_soup.h"

namespace strata::csg {

/// Red, green and blue of a colour that is the scheme's but for its alpha.
inline constexpr glm::vec3 kSchemesOwn{-1.0f};

/// The colour of a face. @param own  the scheme's
[[nodiscard]] inline glm::vec4 colour_or(const std::optional<glm::vec4>& colour,
                                         const glm::vec4& own) {
  if (!colour) return own;
  return colour->r < 0.0f ? glm::vec4(glm::vec3(own), colour->a) : *colour;
}

enum class Operation : std::uint8_t { kSolid, kUnion, kIntersection, kDifference };

/// A leaf of a tree: a mesh at its place. Many solids may share one mesh.
struct Solid {
  /// May overlap itself, may be open or inside out; null is the empty solid.
  std::shared_ptr<const TriangleSoup> mesh;
  glm::dmat4 world_from_mesh{1.0};  ///< affine; one that mirrors turns the triangles around
  /// Red, green, blue (or kSchemesOwn), alpha in [0, 1]; empty: the scheme's.
  std::optional<glm::vec4> colour = {};
  InsideRule rule = InsideRule::kWinding;  ///< which winding numbers are inside
  std::string name = {};                   ///< for messages and pick: `cube at plate.csg:12:3`
};

/// A Boolean tree of solids, as a value. No limit on solids, depth or shape; nothing is required of
/// the solids (convexity, closedness, disjointness). Built bottom up: operands exist before the
/// node that takes them, and each node is an operand once at most.
class Tree {
 public:
  using NodeId = std::uint32_t;
  static constexpr NodeId kNone = 0xffffffffu;

  /// A node [kind | range of operands]; of a solid, `first` is its index into solids().
  struct Node {
    Operation operation = Operation::kUnion;
    std::uint32_t first = 0;  ///< into operands(), or the solid
    std::uint32_t count = 0;
  };

  NodeId add_solid(Solid solid);
  /// A node over `operands`: union (none: empty), intersection (none: empty), difference (the first
  /// minus all others; none: empty).
  NodeId add(Operation operation, std::span<const NodeId> operands);
  NodeId add(Operation operation, std::initializer_list<NodeId> operands);

  /// The node that is pictured, measured, voxelized; kNone: the empty set.
  void set_root(NodeId root) { root_ = root; }
  [[nodiscard]] NodeId root() const { return root_; }

  [[nodiscard]] std::span<const Solid> solids() const { return solids_; }
  [[nodiscard]] std::span<Solid> solids() { return solids_; }
  [[nodiscard]] std::span<const Node> nodes() const { return nodes_; }
  [[nodiscard]] std::span<const NodeId> operands(NodeId node) const {
    return std::span(operands_).subspan(nodes_[node].first, nodes_[node].count);
  }

 private:
  std::vector<Solid> solids_;
  std::vector<Node> nodes_;  ///< operands before the nodes that take them
  std::vector<NodeId> operands_;
  NodeId root_ = kNone;
};

/// The least box around a solid in world space.
[[nodiscard]] Bounds bounds(const Solid& solid);

/// How many times larger than a result its solids are from where on they count as vast: such
/// solids bound no picture, and are cut off where they cannot matter.
inline constexpr double kVast = 1000.0;

/// A box that the result of `node` lies in: union of the operands' for a union, intersection for an
/// intersection, the first operand's for a difference. Of a first operand that is vast beside what
/// axis-parallel boxes leave of it, as of half spaces that are made of vast cubes, only that.
[[nodiscard]] Bounds bounds(const Tree& tree, Tree::NodeId node);
/// The same from the boxes of the tree's solids.
[[nodiscard]] Bounds bounds(const Tree& tree, Tree::NodeId node, std::span<const Bounds> solids);
/// Where a solid can matter.
struct Mattering {
  Bounds box;  ///< beyond it the nodes above the solid are empty, whatever it is there
  bool taken_away = false;
};
/// Of each solid. @param solids  boxes of the tree's solids
[[nodiscard]] std::vector<Mattering> mattering(const Tree& tree, std::span<const Bounds> solids);
/// The box that gives a picture its depths, from the boxes of the tree's solids: around all of
/// them; without cutters that are far larger than `shown`, which are the nodes that can be seen:
/// they would leave it no depth.
[[nodiscard]] Bounds picture_box(const Tree& tree, std::span<const Bounds> solids,
                                 std::span<const Tree::NodeId> shown);

}  // namespace strata::csg
