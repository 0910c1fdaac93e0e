#pragma once

#include <cstdint>
#include <functional>

#include "mesh/repair/mesh_conflicts.h"

namespace strata {

/// Puts a mesh into an order that depends on its geometry alone. Sorts vertices by (x, y, z), those
/// of equal positions by `compare`, and those that are equal in that too by the least of their
/// triangles; turns each triangle until its least vertex is the first; sorts the triangles.
/// Vertices without triangles are left out.
/// @param compare  the order of two vertices of one position, of which rounding may have taken the
///                 difference: below 0, 0, above 0; may be empty
/// @pre no two triangles have the same vertices in the same order
void canonical_order(RoundedMesh& mesh,
                     const std::function<int(std::uint32_t, std::uint32_t)>& compare = {},
                     const Execution& execution = {});

}  // namespace strata
