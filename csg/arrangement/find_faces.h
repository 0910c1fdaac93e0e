#pragma once

#include <cstdint>
#include <vector>

#include "csg/arrangement/boundary_faces.h"
#include "csg/arrangement/cell_values.h"

namespace strata::csg {

/// How faces are made of pieces.
struct FaceRules {
  bool melt = true;  ///< pieces of one plane become one face
  /// The label of each solid; empty: all faces have the label 0.
  std::vector<std::uint32_t> label_of_solid;
};

/// Keeps the pieces where the tree's value changes, and makes faces of them. The result has no
/// points yet.
BoundaryFaces find_faces(const ArrangementInput& input, const BoundaryPoints& points,
                         const CutLines& lines, const Pieces& pieces, const RadialLists& lists,
                         const CellValues& values, const FaceRules& rules);

}  // namespace strata::csg
