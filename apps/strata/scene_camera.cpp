#include "apps/strata/scene_camera.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "csg/input/frame_scene.h"
#include "strata/csg/input/scene_input.h"

namespace strata::apps {
namespace {

Result<FittedCamera> finite(FittedCamera fitted) {
  if (std::isfinite(fitted.camera.distance)) return fitted;
  const Bounds& box = fitted.box;
  return fail(ErrorCode::kGeometry,
              "the scene reaches from ({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g}); "
              "these coordinates are too large for a picture",
              box.low.x, box.low.y, box.low.z, box.high.x, box.high.y, box.high.z);
}

}  // namespace

void take_scene_view(const csg::Scene& scene, Session& session, PictureRequest& request) {
  if (!request.default_camera || !scene.view) return;
  const csg::SceneView& view = *scene.view;
  Camera& camera = request.camera;
  camera.target = view.target.value_or(camera.target);
  camera.rotation = view.rotation.value_or(camera.rotation);
  camera.distance = view.distance.value_or(camera.distance);
  camera.field_of_view = view.field_of_view.value_or(camera.field_of_view);
  if (request.asked_view) {
    session.warn("ignored", fmt::format("{}: the file sets $vpr, $vpt, $vpd or $vpf, so --view-all "
                                        "and --auto-center have no effect",
                                        request.input.files.front()));
  }
  request.default_camera = request.view_all = request.auto_centre = false;
}

Camera turned_camera(Camera camera, int turn, int turns) {
  camera.rotation.z += 360.0 * turn / turns;
  return camera;
}

Result<FittedCamera> fitted_camera(const PictureRequest& request, const csg::Scene& scene,
                                   bool from_above, Session& session) {
  FittedCamera result{request.camera, {}};
  Camera& camera = result.camera;
  Bounds& box = result.box;
  if (request.auto_centre || request.view_all) {
    auto visible = csg::visible_box(scene, session.execution("measuring"));
    if (!visible) return tl::unexpected(visible.error());
    box = *visible;
    if (from_above && !box.empty()) box.low.z = box.high.z = 0.0;  // an outline has no thickness
  }
  if (request.default_camera && !request.asked_view) {
    const double aspect = static_cast<double>(request.size.x) / request.size.y;
    std::vector<Camera> turns;
    constexpr int kMostTurns = 72;  // between them nothing reaches noticeably farther
    const int count = std::min(request.turntable, kMostTurns);
    for (int i = 0; i < count; ++i) turns.push_back(turned_camera(camera, i, count));
    if (auto done = csg::frame_scene(scene, box, request.cuts, turns, aspect, camera,
                                     session.execution("measuring"));
        !done) {
      return tl::unexpected(done.error());
    }
    return finite(std::move(result));
  }
  if (request.auto_centre) centre_camera(camera, box);
  if (request.view_all) {
    fit_camera(camera, box, static_cast<double>(request.size.x) / request.size.y);
    if (!(camera.distance > 0)) camera.distance = Camera{}.distance;  // nothing to fit
  }
  return finite(std::move(result));
}

}  // namespace strata::apps
