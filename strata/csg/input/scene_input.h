#pragma once

#include <string>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/input/mesh_input.h"
#include "strata/csg/scene/scene.h"

namespace strata::csg {

/// Whether a file is a scene by its name: .csg or .scad.
[[nodiscard]] bool is_scene_name(const std::string& path);

/// The inputs as one scene: a single scene as it is, else the result of the expression or the union
/// of all inputs.
/// @param facts  gets the facts of each file; a scene is closed when all solids of its result are
/// @return as read_scene() and load_mesh(); kUsage for the expression; kLimit when the tree becomes
/// too large
Result<Scene> load_scene(const SceneInput& input, const InputMessages& messages = {},
                         const Execution& execution = {}, std::vector<InputFacts>* facts = nullptr);

/// The box that a camera should see: around the result and the ghosts.
Result<Bounds> visible_box(const Scene& scene, const Execution& execution = {});

}  // namespace strata::csg
