#pragma once

#include <vector>

#include "csg/lattice/lattice_solids.h"
#include "strata/csg/boundary/boundary_mesh.h"

namespace strata::csg {

/// Closes the solids: afterwards every piece of an edge, between two vertices on it, is used as
/// often in one direction as in the other by the triangles of a solid; for InsideRule::kParity an
/// even number of times in all. Equal lattice points count as one vertex. Triangles of two equal
/// corners do not count, those without area do. The triangles that close a hole follow those of
/// their solid; they lie in its box.
///
/// The edges that are not balanced are split where they end within each other (a vertex on the edge
/// of another triangle); pieces that cancel are no holes. The others are chained to loops, which do
/// not depend on the order of triangles. A flat loop is triangulated, any other gets a fan from its
/// middle. It does not matter where fans intersect: the walk of the tree sees closed solids.
///
/// Closed solids cost one pass over their triangles.
/// @param tree  names the solids and has their inside rules
/// @pre no vertex is used by two solids, as snap_solids() makes them
/// @return the loops that were closed, by solid; without cracks that are no wider than a step of
/// the lattice: snapping makes these of vertices that lay on edges. kGeometry naming the first
/// solid with a hole and the least open edge, for OpenSolids::kFail; kLimit for more than 2^32 - 1
/// vertices or triangles; kCancelled
Result<std::vector<BoundaryCap>> close_solids(LatticeSolids& solids, OpenSolids policy,
                                              const Tree& tree, const Execution& execution = {});

}  // namespace strata::csg
