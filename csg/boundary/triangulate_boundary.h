#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "csg/arrangement/boundary_faces.h"
#include "csg/lattice/lattice_solids.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"

namespace strata::csg {

/// The boundary of a solid as triangles: each edge has two, and around each vertex they are one
/// fan.
struct TriangulatedBoundary {
  std::vector<exact::FilePoint> points;  ///< in 2^-24 step
  std::vector<glm::dvec3> positions;     ///< of the same, world space
  std::vector<glm::uvec3> triangles;     ///< counter-clockwise from outside
  std::vector<std::uint32_t> labels;     ///< of the triangles
  std::uint64_t vertices_split = 0;  ///< vertices that are there again: the solid touches itself
  std::uint64_t repaired = 0;        ///< places where rounding made triangles meet
  int repair_rounds = 0;
  std::uint64_t shells = 0;  ///< triangles that hang together
};

/// Triangulates the faces of a boundary. The faces of a plane become the constrained Delaunay
/// triangulation of their rounded points. The result is in canonical order: it does not depend on
/// the order of anything in `faces`, nor on the number of threads.
/// @param float_positions  positions are rounded to float instead of double
/// @return kGeometry (triangles that meet after all repairs, or positions that do not fit),
/// kInternal (faces that do not bound a solid), kCancelled
Result<TriangulatedBoundary> triangulate_boundary(const BoundaryFaces& faces,
                                                  const Lattice& lattice, bool float_positions,
                                                  const Execution& execution = {});

}  // namespace strata::csg
