#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>

#include "csg/outline/outline.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"

/// Boolean trees as surfaces, for nodes that need the result itself: hulls, shadows, sums. A plane
/// cuts every leaf into a flat region, and the tree is evaluated on these regions in the plane.
/// What differs between the two sides of a plane is boundary; boundary lies only in planes of
/// triangles of leaves.
namespace strata::csg {

/// Where a tree meets the plane z = 0, from either side: the cross-section of its closure.
[[nodiscard]] Outline cross_section(const Tree& tree, Tree::NodeId node, OutlineJob* job = nullptr);

/// Triangles that together are the boundary of `node`, outward; neighbours in different planes
/// share no vertices, and agree to the grid of the flat operations. For unions of leaves alone the
/// leaves' triangles are given as they are, which may lie inside other leaves.
/// @param most_steps  of work, of some 10 ns each, before it is given up
/// @return kLimit when too much would have to be cut; kCancelled
Result<TriangleSoup> boundary(const Tree& tree, Tree::NodeId node, const Execution& execution = {},
                              std::uint64_t most_steps = 3'000'000'000);

/// Calls body(operand) for every operand of the union that `node` is, through nested unions; for
/// `node` itself if it is none.
void for_each_operand(const Tree& tree, Tree::NodeId node,
                      const std::function<void(Tree::NodeId)>& body);

/// The triangles of a leaf in the space of the tree.
[[nodiscard]] TriangleSoup world_mesh(const Solid& solid);

}  // namespace strata::csg
