#pragma once

#include "csg/arrangement/boundary_faces.h"
#include "csg/lattice/lattice_solids.h"
#include "strata/csg/boundary/boundary_mesh.h"
#include "strata/csg/boundary/face_parts.h"

namespace strata::csg {

/// The exact boundary of a tree's result, before it is rounded and triangulated.
struct ExactBoundary {
  Lattice lattice;
  BoundaryFaces faces;
  BoundaryReport report;  ///< as far as it is known
};

/// Errors as for boundary_mesh(). Labels of faces are indices into the tree's solids, behind them
/// those of the parts of `faces`; or all are 0 with BoundaryParts::kOne.
Result<ExactBoundary> find_exact_boundary(const Tree& tree, Tree::NodeId root,
                                          const BoundaryOptions& options,
                                          const Execution& execution, const FaceParts& faces = {});

/// The same for solids that are on a lattice already.
/// @param most_rows  as LiveZone::find(): 0 arranges all space
/// @param labels  of the faces of each solid that has no labels of triangles; empty: all are 0
Result<BoundaryFaces> arrange_solids(LatticeSolids solids, const Tree& tree, Tree::NodeId root,
                                     const std::vector<InsideRule>& rules,
                                     const BoundaryOptions& options, const Execution& execution,
                                     BoundaryReport& report, std::uint64_t most_rows,
                                     std::vector<std::uint32_t> labels = {});

}  // namespace strata::csg
