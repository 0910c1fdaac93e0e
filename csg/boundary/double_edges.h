#pragma once

#include <span>
#include <vector>

#include "csg/boundary/face_triangulation.h"
#include "csg/boundary/written_positions.h"

namespace strata::csg {

/// A solid that touches itself along an edge may hang together at both ends of it, so that two
/// edges of the mesh have the same two vertices. Each of them gets a vertex in its middle, and
/// becomes two edges that no other one equals.
/// @param triangles  of vertices, after split_umbrellas()
/// @param labels     of the triangles
/// @param positions  of the vertices; those of the new ones are appended
/// @param wedges     the half-edges at edges with more than two triangles
/// @return how many vertices are new
std::size_t divide_double_edges(std::vector<glm::uvec3>& triangles,
                                std::vector<std::uint32_t>& labels,
                                std::vector<exact::FilePoint>& positions,
                                std::span<const WedgeEdge> wedges, const WrittenPositions& written);

}  // namespace strata::csg
