#pragma once

#include <span>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/input/scene_input.h"
#include "strata/raster/view.h"

// A camera that a scene's result fills. Private to csg/ and the tools.

namespace strata::csg {

/// Moves a camera so that the result and the ghosts, without what sections cut away, fill the
/// picture up to a margin. Its rotation stays. Cutters do not count. Nothing happens where there is
/// nothing to see.
/// @param box  visible_box() of the scene
/// @param turns  cameras with the rotations that must all see it, from its middle; empty: that of
/// `camera` alone
/// @return kCancelled
Result<void> frame_scene(const Scene& scene, const Bounds& box, std::span<const SectionPlane> cuts,
                         std::span<const Camera> turns, double aspect, Camera& camera,
                         const Execution& execution = {});

}  // namespace strata::csg
