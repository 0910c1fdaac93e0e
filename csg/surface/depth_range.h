#pragma once

#include <glm/vec2.hpp>
#include <optional>

#include "csg/geometry.h"
#include "strata/core/execution.h"
#include "strata/raster/view.h"

// How near and how far a perspective picture reaches. Private to csg/.

namespace strata::csg {

/// The least distance of a face, and a bound of the greatest, of what stands in `seen` and in the
/// picture: from the eye along the view axis. Empty when there is nothing.
/// @param view  its depths do not matter @param seen  around the result
[[nodiscard]] std::optional<glm::dvec2> seen_distances(const Geometry& geometry, const View& view,
                                                       const Bounds& seen,
                                                       const Execution& execution);

}  // namespace strata::csg
