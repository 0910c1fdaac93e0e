#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace strata {

/// Triangles of a region in the plane, indices into all contours' points one after another. Outer
/// contours run counter-clockwise, holes clockwise. Every point is a corner and none is added: by
/// position, the boundary of the triangles is that of the contours, edge for edge, even where these
/// touch or cross. Contours of fewer than 3 points are left out.
/// @pre finite coordinates whose products do not overflow
[[nodiscard]] std::vector<glm::uvec3> triangulate(
    std::span<const std::vector<glm::dvec2>> contours);

}  // namespace strata
