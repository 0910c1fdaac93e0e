#pragma once

#include <cstdint>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/boundary/boundary_mesh.h"
#include "strata/csg/tree.h"
#include "strata/mesh/solid_mesh.h"

namespace strata::csg {

/// Solids whose faces are of several parts, such as meshes of files with parts and colours.
struct FaceParts {
  std::vector<MeshPart> parts;  ///< names and colours, all different
  /// Of each solid of the tree, the part of each triangle of its mesh; or empty: the solid is one
  /// part. Caps have the part of a triangle at their rim.
  std::vector<std::vector<std::uint32_t>> of_triangles;
};

/// As boundary_mesh() without them. The mesh has those that have faces, behind the parts that are
/// whole solids.
/// @param faces  counts unless options.parts is BoundaryParts::kOne
/// @return also kUsage: `faces` is not that of the tree
Result<BoundaryMesh> boundary_mesh(const Tree& tree, Tree::NodeId root,
                                   const BoundaryOptions& options, const FaceParts& faces,
                                   const Execution& execution = {});

}  // namespace strata::csg
