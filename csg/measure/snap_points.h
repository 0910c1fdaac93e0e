#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "csg/measure/tree_rays.h"

namespace strata::csg {

/// Where a pick is moved to.
enum class Snap : std::uint8_t {
  kFace,      ///< nowhere
  kVertex,    ///< a corner of a solid, or where an edge of one pierces a face of another
  kMidpoint,  ///< of a solid's edge
  kEdge       ///< the nearest point of an edge of a solid, or of where faces of two solids meet
};

struct SnapPoint {
  Snap kind = Snap::kFace;
  glm::dvec3 at{0.0};  ///< world space
};

/// What a pick at `at` may be moved to within `radius`: points of the solids' surfaces, of which
/// the tree's result may lack some. Edges between coplanar facets do not count. Next to more than
/// a few hundred triangles only corners are looked for.
std::vector<SnapPoint> snap_points(const TreeRays& rays, const glm::dvec3& at, double radius);

}  // namespace strata::csg
