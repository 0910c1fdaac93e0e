#pragma once

#include <vector>

#include "csg/arrangement/welded_solids.h"
#include "csg/lattice/live_zone.h"
#include "mesh/check/box_pairs.h"

namespace strata::csg {

/// Finds the triangles that may meet other than in a corner or an edge that they share: all pairs
/// that do, and others whose boxes touch and of which each reaches the plane of the other. Only
/// pairs that may meet in `zone` are wanted.
/// @return each pair once, sorted; kCancelled; kLimit when they take more than the memory limit
Result<std::vector<BoxPair>> find_candidate_pairs(const WeldedSolids& solids,
                                                  const MeshEdges& edges, std::size_t solid_count,
                                                  const LiveZone& zone,
                                                  const Execution& execution = {});

}  // namespace strata::csg
