#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <vector>

#include "mesh/edge_balance.h"
#include "strata/raster/lattice_mesh.h"

// Triangles that close an open mesh. Private to voxelize/.

namespace strata {

/// Triangles over the mesh's own vertices such that the mesh and they are closed together: every
/// loop of unbalanced edges is filled by cutting it in halves.
struct BoundaryCaps {
  std::vector<glm::uvec3> triangles;
  /// The first ones may be wrong: they fill loops that are not flat, or pieces of the mesh that are
  /// hardly larger than their caps: loose triangles and sheets, patches that should be joined.
  std::size_t doubtful = 0;
};

/// No triangles when the snapped mesh is closed. The same ones, up to vertices of equal positions,
/// for any order of the mesh's.
/// @param seams  detail::unbalanced_by_index() of the mesh
[[nodiscard]] BoundaryCaps boundary_caps(const LatticeMesh& mesh,
                                         const std::vector<detail::EdgeSum>& seams);

}  // namespace strata
