#pragma once

#include <string>
#include <vector>

#include "apps/session/session.h"
#include "apps/strata/commands.h"
#include "apps/strata/mesh_input.h"
#include "strata/core/result.h"
#include "strata/csg/scene/scene.h"

namespace strata::apps {

/// Whether a file is a scene by its name: .csg or .scad.
[[nodiscard]] bool is_scene_name(const std::string& path);

/// The inputs of `strata csg` as one scene: a single scene as it is, else all inputs united or what
/// --expr makes of them. Warnings go to the session. @return as read_scene() and load_mesh();
/// kUsage for the expression; kLimit when it becomes too large
/// @param facts gets what each file holds; a scene is closed when all solids of its result are
Result<csg::Scene> load_scene(const CsgCommand& command, Session& session,
                              std::vector<InputFacts>* facts = nullptr);

/// What the camera should see: the result, and the ghosts.
Result<Bounds> visible_box(const csg::Scene& scene, const Execution& execution);

/// Takes the sections away from the scene and its ghosts.
void cut_scene(csg::Scene& scene, const std::vector<SectionPlane>& cuts, const csg::Camera& camera);

}  // namespace strata::apps
