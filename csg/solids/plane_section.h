#pragma once

#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <span>
#include <vector>

#include "csg/outline/outline.h"
#include "strata/csg/tree.h"
#include "strata/mesh/soup_tools.h"

/// Sections of one solid by planes; used by csg/solids/boundary.h.
namespace strata::csg {

/// A plane with a coordinate system in it.
struct Plane {
  glm::dvec3 origin{0.0}, normal{0.0, 0.0, 1.0}, u{1.0, 0.0, 0.0}, v{0.0, 1.0, 0.0};
  Bounds window;  ///< box around the triangles that lie in it; empty: the whole plane counts

  [[nodiscard]] glm::dvec2 flat(const glm::dvec3& p) const {
    return {glm::dot(p - origin, u), glm::dot(p - origin, v)};
  }
};

/// A rectangle in a plane.
struct Rectangle {
  glm::dvec2 low{std::numeric_limits<double>::infinity()};
  glm::dvec2 high{-std::numeric_limits<double>::infinity()};
};

/// The plane through `origin`, with any axes in it. @pre `normal` is a unit vector
[[nodiscard]] Plane make_plane(const glm::dvec3& origin, const glm::dvec3& normal);

/// The rectangle that covers a plane's window, with a margin.
[[nodiscard]] Rectangle rectangle_of(const Plane& plane);

/// Whether two boxes come within `margin` of each other.
[[nodiscard]] bool meet(const Bounds& box, const Bounds& other, double margin);

/// A tree of boxes around triangles, which finds the triangles near a plane.
class BoxTree {
 public:
  /// Builds the tree. Sorts `triangles`.
  void build(std::span<const glm::dvec3> positions, std::vector<glm::uvec3>& triangles);

  /// Calls body(triangle) for the triangles whose box comes within `margin` of the plane. @return
  /// number of boxes visited
  template <class Body>
  std::uint64_t visit(const Plane& plane, double margin, const Body& body) const {
    if (nodes_.empty()) return 0;
    const glm::dvec3 extent = glm::abs(plane.normal);
    std::uint32_t waiting[64];
    int count = 0;
    std::uint64_t steps = 0;
    waiting[count++] = 0;
    while (count > 0) {
      const Node& node = nodes_[waiting[--count]];
      ++steps;
      const glm::dvec3 half = 0.5 * (node.box.high - node.box.low);
      const double distance = glm::dot(node.box.low + half - plane.origin, plane.normal);
      if (std::abs(distance) > glm::dot(half, extent) + margin) continue;
      if (node.children != 0) {  // each child has half of the triangles: 32 levels at most
        waiting[count++] = node.children;
        waiting[count++] = node.children + 1;
        continue;
      }
      for (std::uint32_t t = node.first; t < node.first + node.count; ++t) body(t);
      steps += node.count;
    }
    return steps;
  }

 private:
  static constexpr std::uint32_t kFew = 8;
  struct Node {
    Bounds box;
    std::uint32_t first, count, children;  // children: index of the first of two; 0: a leaf
  };
  std::vector<Node> nodes_;
};

/// A leaf of the Boolean tree in the space of the tree, its vertices welded by position.
struct Leaf {
  std::vector<glm::dvec3> positions;
  std::vector<glm::uvec3> triangles;
  BoxTree boxes;
  Bounds box;
  Fill fill = Fill::kNonzero;
};

[[nodiscard]] Leaf make_leaf(const Solid& solid);

/// The side from which a plane is approached.
enum class Side { kBelow, kAbove };  // infinitesimally below or above the plane

/// The section of a leaf with a plane that is moved by an infinitesimal distance to `side`.
/// Vertices within `tolerance` lie in the plane. If the plane has a window, the section is valid
/// only in the window's rectangle.
/// @param steps  is increased by the work done, in units of some 10 ns
[[nodiscard]] Outline section(const Leaf& leaf, const Plane& plane, double tolerance, Side side,
                              std::uint64_t& steps);

}  // namespace strata::csg
