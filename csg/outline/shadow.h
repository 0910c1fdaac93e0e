#pragma once

#include "csg/outline/outline.h"
#include "strata/mesh/triangle_soup.h"

namespace strata::csg {

/// The shadow of triangles on the xy plane.
[[nodiscard]] Outline shadow(const TriangleSoup& mesh, OutlineJob* job = nullptr);
/// The cross-section at z = 0 of a closed mesh.
[[nodiscard]] Outline cross_section(const TriangleSoup& mesh);

}  // namespace strata::csg
