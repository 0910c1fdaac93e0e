#include <utility>

#include "apps/commands.h"
#include "apps/csg_scene.h"
#include "apps/session.h"
#include "csg/picture.h"

namespace strata::apps {
namespace {

void add(Bounds& box, const Bounds& other) {
  if (other.empty()) return;
  box.low = glm::min(box.low, other.low);
  box.high = glm::max(box.high, other.high);
}

/// What the camera should see.
Bounds visible_box(const csg::Scene& scene) {
  Bounds box = csg::bounds(scene.tree, scene.tree.root());
  for (const auto* ghosts : {&scene.backgrounds, &scene.highlights}) {
    for (const csg::Tree::NodeId ghost : *ghosts) add(box, csg::bounds(scene.tree, ghost));
  }
  return box;
}

std::vector<csg::Ghost> ghosts_of(const csg::Scene& scene) {
  std::vector<csg::Ghost> ghosts;
  for (const csg::Tree::NodeId node : scene.backgrounds) {
    ghosts.push_back({node, csg::kBackgroundGhost});
  }
  for (const csg::Tree::NodeId node : scene.highlights) {
    ghosts.push_back({node, csg::kHighlightGhost});
  }
  return ghosts;
}

}  // namespace

Result<void> run_csg(const CsgCommand& command, Session& session) {
  auto scene = load_scene(command, session);
  if (!scene) return tl::unexpected(scene.error());
  if (auto strict = session.check_strict(); !strict) return strict;

  csg::Camera camera = command.camera;
  const Bounds box = visible_box(*scene);
  if (command.auto_centre) csg::centre_camera(camera, box);
  if (command.view_all) csg::fit_camera(camera, box);
  cut_scene(*scene, command.cuts, camera);

  const Execution execution = session.execution("drawing");
  std::vector<csg::Ghost> ghosts = ghosts_of(*scene);
  csg::Preview preview(std::move(scene->tree), std::move(ghosts), scene->relative_precision,
                       execution);
  auto picture = preview.picture(camera, command.size, command.picture, execution);
  if (!picture) return tl::unexpected(picture.error());
  session.note(
      fmt::format("{}, {}, {} pixels covered", counted(preview.tree().solids().size(), "solid"),
                  counted(preview.report().fragments, "crossing"), preview.report().covered));
  if (!command.output.empty()) {
    if (auto done = csg::write_png(*picture, command.output); !done) return done;
  }
  return {};
}

}  // namespace strata::apps
