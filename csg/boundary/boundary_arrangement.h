#pragma once

#include "csg/arrangement/boundary_faces.h"
#include "csg/lattice/lattice_solids.h"
#include "strata/csg/boundary/boundary_mesh.h"

namespace strata::csg {

/// The exact boundary of a tree's result, before it is rounded and triangulated.
struct ExactBoundary {
  Lattice lattice;
  BoundaryFaces faces;
  BoundaryReport report;  ///< as far as it is known
};

/// Errors as for boundary_mesh(). Labels of faces are indices into the tree's solids, or all 0 with
/// BoundaryParts::kOne.
Result<ExactBoundary> find_exact_boundary(const Tree& tree, Tree::NodeId root,
                                          const BoundaryOptions& options,
                                          const Execution& execution);

/// The same for solids that are on a lattice already.
/// @param most_rows  as LiveZone::find(): 0 arranges all space
Result<BoundaryFaces> arrange_solids(LatticeSolids solids, const Tree& tree, Tree::NodeId root,
                                     const std::vector<InsideRule>& rules,
                                     const BoundaryOptions& options, const Execution& execution,
                                     BoundaryReport& report, std::uint64_t most_rows);

}  // namespace strata::csg
