#pragma once

#include <cstdint>
#include <vector>

#include "csg/arrangement/welded_solids.h"

namespace strata::csg {

/// Two triangles that may meet.
struct TrianglePair {
  std::uint32_t first, second;  ///< first < second

  friend auto operator<=>(const TrianglePair&, const TrianglePair&) = default;
};

struct CandidatePairs {
  /// Each pair once, sorted: all pairs that share a point other than one corner or one edge of
  /// both, and others whose boxes do and of which each reaches the plane of the other. Pairs of an
  /// embedded solid are not among them.
  std::vector<TrianglePair> pairs;
  std::uint64_t mixed_cells = 0;  ///< cells of the first grid that two solids touch
};

/// Finds the triangles that may meet other than in a corner or an edge that they share, with a grid
/// of cells as raster/tile_bins does in two dimensions. A cell that one solid touches which does
/// not meet itself is done; one that two touch and that has many triangles is divided in eight. A
/// triangle is in the cells that its box touches, without those that lie on one side of its plane.
/// @param embedded  of each solid: LatticeSolids::embedded
/// @return kCancelled; kLimit when the pairs take more than the memory limit
Result<CandidatePairs> find_candidate_pairs(const WeldedSolids& solids,
                                            const std::vector<bool>& embedded,
                                            const Execution& execution = {});

}  // namespace strata::csg
