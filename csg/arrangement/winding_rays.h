#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "csg/arrangement/cut_lines.h"

namespace strata::csg {

/// A place next to the front of a triangle: so near to a point that nothing is closer than the
/// triangle's own piece, p + d along + d^2 across + d^3 normal for all d that are small enough.
struct Nearby {
  std::uint32_t triangle;
  std::uint32_t point;
  exact::Cross along;          ///< an edge of the piece
  exact::LatticePoint across;  ///< into the piece, in the plane of the triangle
};

/// Counts winding numbers along rays towards -x from places, through all triangles. All comparisons
/// are exact.
/// @return for each place the solids whose winding number is not 0, sorted; kCancelled
Result<std::vector<std::vector<SolidCount>>> count_windings(const ArrangementInput& input,
                                                            const BoundaryPoints& points,
                                                            std::span<const Nearby> places,
                                                            const Execution& execution);

/// Sorts by solids and adds up what is of the same solid.
void merge_counts(std::vector<SolidCount>& counts);

}  // namespace strata::csg
