#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <stop_token>
#include <vector>

#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"

namespace strata::csg {

/// The convex hull, closed and facing outward. Its vertices are bit for bit among `points`; points
/// that are extreme only by rounding are left out (Qhull: C. B. Barber, D. P. Dobkin, H. Huhdanpaa,
/// "The Quickhull algorithm for convex hulls", 1996). Any thread may call it. @pre finite points
/// @return kGeometry when the points lie in a plane; kLimit; kCancelled
Result<TriangleSoup> convex_hull(std::span<const glm::dvec3> points,
                                 const std::stop_token& stop = {});

/// A hull with the edges between its flat facets.
struct ConvexHull {
  struct Edge {
    std::uint32_t vertices[2];
    glm::dvec3 normals[2];  ///< unit outward normals of the two facets at the edge
  };
  TriangleSoup mesh;
  std::vector<Edge> edges;  ///< empty where facets that rounding bends do not fit together
};
Result<ConvexHull> convex_hull_with_edges(std::span<const glm::dvec3> points,
                                          const std::stop_token& stop = {});

}  // namespace strata::csg
