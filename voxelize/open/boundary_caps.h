#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "mesh/edge_balance.h"
#include "strata/core/execution.h"
#include "strata/mesh/triangle_soup.h"
#include "strata/raster/lattice_mesh.h"

// Triangles that close an open mesh. Private to voxelize/.

namespace strata {

/// Whether a mesh counts as closed.
struct MeshClosedness {
  bool closed = true;
  /// Its edges that are unbalanced by index, if they were found and are few.
  std::optional<std::vector<detail::EdgeSum>> seams = std::nullopt;
};

/// @param even_is_closed  whether it is enough that every edge has an even number of triangles
[[nodiscard]] MeshClosedness find_closedness(const TriangleSoup& mesh, bool even_is_closed,
                                             const Execution& execution);

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
/// @param found  of the mesh before it was snapped; its seams are used
[[nodiscard]] BoundaryCaps boundary_caps(const LatticeMesh& mesh, const MeshClosedness& found,
                                         const Execution& execution);

}  // namespace strata
