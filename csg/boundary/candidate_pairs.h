#pragma once

#include <cstdint>
#include <vector>

#include "csg/boundary/lattice_solids.h"

namespace strata::csg {

/// Two triangles of different solids.
struct TrianglePair {
  std::uint32_t first, second;  ///< first < second

  friend auto operator<=>(const TrianglePair&, const TrianglePair&) = default;
};

struct CandidatePairs {
  /// Each pair once, sorted: all pairs that share a point, and others whose boxes do and of which
  /// each reaches the plane of the other.
  std::vector<TrianglePair> pairs;
  /// Triangles in a cell that two solids touch, sorted: no other one meets another solid.
  std::vector<std::uint32_t> mixed_triangles;
  std::uint64_t mixed_cells = 0;  ///< cells of the first grid that two solids touch
};

/// Finds the triangles of different solids that may meet, with a grid of cells as raster/tile_bins
/// does in two dimensions. A cell that one solid touches is done; one that two touch and that has
/// many triangles is divided in eight. A triangle is in the cells that its box touches, without
/// those that lie on one side of its plane.
/// @return kCancelled; kLimit when the pairs take more than the memory limit
Result<CandidatePairs> find_candidate_pairs(const LatticeSolids& solids,
                                            const Execution& execution = {});

}  // namespace strata::csg
