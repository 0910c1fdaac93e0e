#pragma once

#include "strata/core/result.h"
#include "strata/csg/scene/scene.h"

namespace strata::csg {

/// Checks the coordinates of all solids. Warns of a solid so large that its faces are too imprecise
/// for the solids it meets. @return kGeometry naming the first solid that is too large to be
/// handled
Result<void> check_coordinates(Scene& scene);

}  // namespace strata::csg
