#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>

#include "csg/outline/outline.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"

/// The boundary meshes of Boolean trees, for operations that need the result itself: hulls,
/// shadows, Minkowski sums. A plane cuts every leaf into a flat region, and the tree is evaluated
/// on these regions. The boundary is where the regions just below and just above a plane differ. It
/// lies only in planes of the leaves' triangles.
/// triangles of leaves.
namespace strata::csg {

/// The cross-section of the closure of `node` with the plane z = 0: the union of the sections just
/// below and just above it.
[[nodiscard]] Outline cross_section(const Tree& tree, Tree::NodeId node, OutlineJob* job = nullptr);

/// A set of triangles that together are the boundary of `node`, facing outward. Neighbours in
/// different planes share no vertices and agree to the grid of the flat operations. A union of
/// leaves returns the leaves' own triangles, some of which may lie inside other leaves.
/// @param most_steps  limit of the work, in steps of some 10 ns
/// @return kLimit when the cuts would take too much work; kCancelled
Result<TriangleSoup> boundary(const Tree& tree, Tree::NodeId node, const Execution& execution = {},
                              std::uint64_t most_steps = 3'000'000'000);

/// Calls body(operand) for every operand of the union `node`, through nested unions. If `node` is
/// not a union, calls it for `node` itself.
void for_each_operand(const Tree& tree, Tree::NodeId node,
                      const std::function<void(Tree::NodeId)>& body);

/// The triangles of a leaf, in the space of the tree.
[[nodiscard]] TriangleSoup world_mesh(const Solid& solid);

}  // namespace strata::csg
