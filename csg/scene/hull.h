#pragma once

#include <glm/vec3.hpp>
#include <span>

#include "core/result.h"
#include "mesh/triangle_soup.h"

namespace strata::csg {

/// The convex hull, closed and outward; its vertices are among `points`, bit for bit. Points that
/// stand out by rounding only are left out (Qhull: C. B. Barber, D. P. Dobkin, H. Huhdanpaa, "The
/// Quickhull algorithm for convex hulls", 1996). Any thread may call it. @pre finite
/// @return kGeometry when the points lie in a plane; kLimit
Result<TriangleSoup> convex_hull(std::span<const glm::dvec3> points);

}  // namespace strata::csg
