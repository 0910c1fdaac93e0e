#pragma once

#include "mesh/repair/mesh_conflicts.h"
#include "mesh/repair/written_positions.h"

namespace strata {

/// What repair_mesh() did.
struct MeshRepair {
  std::uint64_t places = 0;  ///< edges contracted or flipped, vertices moved, bodies taken out
  int rounds = 0;            ///< of repairs, each with a search for conflicts before
};

/// Changes a closed 2-manifold mesh until no two triangles meet but in vertices and edges of both:
/// contracts short edges, flips edges that a vertex lies on, moves vertices to positions beside
/// theirs, and takes out tetrahedra that have become flat. A change is made where it leaves fewer
/// conflicts than before, and it is as small as rounding is. The mesh stays closed and 2-manifold.
/// The result depends on the positions alone, not on the order of vertices and triangles, unless
/// several vertices of a conflict have one position.
/// @return kGeometry when conflicts are left after five rounds; kCancelled, kLimit
Result<MeshRepair> repair_mesh(RoundedMesh& mesh, const WrittenPositions& written,
                               const Execution& execution = {});

}  // namespace strata
