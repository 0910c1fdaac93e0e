#pragma once

#include <span>

#include "mesh/repair/mesh_conflicts.h"
#include "mesh/repair/umbrellas.h"
#include "mesh/repair/written_positions.h"

namespace strata {

/// A solid that touches itself along an edge may hang together at both ends of it, so that two
/// edges of the mesh have the same two vertices. Each of them gets a vertex in its middle, and
/// becomes two edges that no other one equals.
/// @param mesh    after split_umbrellas()
/// @param wedges  the half-edges at edges with more than two triangles
/// @return how many vertices are new
std::size_t divide_double_edges(RoundedMesh& mesh, std::span<const WedgeEdge> wedges,
                                const WrittenPositions& written);

}  // namespace strata
