#pragma once

#include <glm/vec3.hpp>
#include <vector>

#include "csg/outline/outline.h"
#include "mesh/polygons/triangulate.h"

namespace strata::csg {

/// Triangulates the outline as a whole (mesh/polygons/triangulate.h).
[[nodiscard]] inline std::vector<glm::uvec3> triangulate(const Outline& outline) {
  return strata::triangulate(outline.contours);
}
/// Triangulates piece by piece, an outer contour with its holes at a time, where there are many
/// pieces, such as the letters of a text.
[[nodiscard]] std::vector<glm::uvec3> triangulate_pieces(const Outline& outline,
                                                         OutlineJob* job = nullptr);

}  // namespace strata::csg
