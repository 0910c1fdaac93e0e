#pragma once

#include <cstdint>
#include <vector>

#include "csg/arrangement/radial_lists.h"
#include "csg/program.h"
#include "strata/core/inside_rule.h"

namespace strata::csg {

/// What the tree is in each cell.
struct CellValues {
  std::vector<bool> inside;  ///< of each cell
  /// Of each patch whose two sides differ, the solid that its face is of; if labels were wanted.
  std::vector<std::uint32_t> solid_of_patch;
};

/// Walks from cell to cell and keeps the program's state up to date. Where the winding numbers of
/// a component begin is counted along a ray.
/// @param rules  of each solid
/// @return kGeometry: winding numbers contradict each other, which open solids lead to; kCancelled
Result<CellValues> find_cell_values(const ArrangementInput& input, const BoundaryPoints& points,
                                    const CutLines& lines_of_cuts, const Pieces& pieces,
                                    const RadialLists& lists, const Program& program,
                                    const std::vector<InsideRule>& rules, bool labels,
                                    const Execution& execution);

}  // namespace strata::csg
