#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"
#include "strata/raster/view.h"

namespace strata::bench {

/// A tree, and where it is looked at from.
struct CsgScene {
  std::string name;
  csg::Tree tree;
  Camera camera;
  double relative_precision = 0;
  unsigned concave_convexity = 1;  ///< of the solids that are not convex, for OpenCSG
  std::uint64_t triangles = 0;     ///< of all solids
};

/// All scenes that the frames are measured on.
[[nodiscard]] std::vector<std::string> csg_scene_names();

/// A scene of a folder that bench/csg_make_scenes.py has made. `bunny-75k` and `bunny-1m` are a
/// mesh minus itself turned by 40 degrees; any other name is `folder`/NAME.csg.
Result<CsgScene> csg_scene(const std::string& folder, const std::string& name,
                           const Execution& execution);

/// `depth` boxes, each taken away from the one around it: b1 - (b2 - (b3 - ...)).
[[nodiscard]] CsgScene nested_differences(int depth);

/// Half of `count` boxes minus the other half, in a unit cube. The area of their pictures does not
/// depend on `count`.
[[nodiscard]] CsgScene small_boxes(int count);

}  // namespace strata::bench
