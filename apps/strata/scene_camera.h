#pragma once

#include "apps/commands/commands.h"
#include "apps/session/session.h"
#include "strata/core/result.h"
#include "strata/csg/scene/scene.h"

namespace strata::apps {

/// Takes the camera that a scene's program sets, if the command line sets none. Warns where
/// --view-all has no effect for that.
void take_scene_view(const csg::Scene& scene, Session& session, PictureRequest& request);

/// A camera, and what it was fitted to.
struct FittedCamera {
  Camera camera;
  Bounds box;  ///< of what can be seen; empty: it was not needed
};

/// The camera after `turn` of `turns` equal parts of a turn about the vertical axis.
[[nodiscard]] Camera turned_camera(Camera camera, int turn, int turns);

/// The camera of a picture: moved to the centre of the scene and back until all is seen, where the
/// request asks for that. @param from_above  only outlines are seen, at z = 0
/// @return kGeometry if the coordinates are too large; as csg::visible_box()
Result<FittedCamera> fitted_camera(const PictureRequest& request, const csg::Scene& scene,
                                   bool from_above, Session& session);

}  // namespace strata::apps
