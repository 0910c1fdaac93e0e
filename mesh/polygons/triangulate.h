#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace strata {

/// Triangulates a region in the plane. The triangles are indices into the points of all contours,
/// one contour after another. Outer contours run counter-clockwise, holes clockwise. Every point is
/// a corner, and none is added. By position, the boundary of the triangles equals that of the
/// contours, edge for edge, even where contours touch or cross. Contours of fewer than 3 points are
/// ignored.
/// @pre finite coordinates whose products do not overflow
[[nodiscard]] std::vector<glm::uvec3> triangulate(
    std::span<const std::vector<glm::dvec2>> contours);

}  // namespace strata
