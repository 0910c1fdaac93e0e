#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "exact/cut_points.h"
#include "strata/core/execution.h"

namespace strata {

/// For each vertex, whether its triangles are known to meet in vertices and edges of both alone:
/// there is a direction along which they are seen side by side, once around the vertex. The time is
/// linear, also for a vertex of many triangles. A vertex with 0 may be as well.
///
/// How: the direction n is the sum of the normals. All triangles face n, so seen along n each turns
/// left around the vertex; together they turn around once, since one of them only passes from the
/// right to the left of a half-plane that n bounds. So no two of them are seen one behind the
/// other, and two that are neighbours in the turn have the edge between them in common.
/// @pre each directed edge is there as often as its opposite, by index
/// @tparam Point  exact::FilePoint or exact::LatticePoint
template <class Point>
std::vector<std::uint8_t> plain_stars(std::span<const Point> points,
                                      std::span<const glm::uvec3> triangles,
                                      const Execution& execution);

}  // namespace strata
