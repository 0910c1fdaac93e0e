#pragma once

#include <glm/vec3.hpp>
#include <span>

// Where the vertex of a cell lies. Private to contour/.

namespace strata::contouring {

/// The plane of a triangle: normal . p = offset, in lattice steps.
struct Plane {
  glm::dvec3 normal{0.0};  ///< of length 1; 0 if the triangle has no area
  double offset = 0.0;
};

/// Where the surface cuts an edge of a cell, in lattice steps from the cell's lower corner.
struct CellCut {
  glm::dvec3 point{0.0};
  Plane plane;  ///< normal 0: not known
};

struct CellVertex {
  glm::ivec3 at{0};      ///< lattice steps from the lower corner
  bool clamped = false;  ///< the best place lay outside the bounds
};

/// Where the vertex may lie: inside the cell and inside the grid.
struct CellBounds {
  glm::ivec3 low{1}, high{255};
};

/// The mean of the points, rounded.
[[nodiscard]] CellVertex mean_vertex(std::span<const CellCut> cuts, const CellBounds& bounds = {});
/// The point of the cell with the least sum of squared distances from the planes; of several, the
/// one nearest to the mean of the points. Where three planes meet in the cell, that point.
[[nodiscard]] CellVertex feature_vertex(std::span<const CellCut> cuts,
                                        const CellBounds& bounds = {});

}  // namespace strata::contouring
