#include <algorithm>
#include <utility>

#include "apps/csg_scene.h"
#include "apps/mesh_input.h"
#include "apps/session.h"

namespace strata::apps {

Result<MeshInput> load_solids(const InputOptions& input, const MeshInputRules& rules,
                              Session& session) {
  if (std::none_of(input.files.begin(), input.files.end(),
                   [](const std::string& path) { return is_scene_name(path); })) {
    return load_meshes(input, rules, session);
  }
  const double start = session.milliseconds();
  CsgCommand command;
  command.input = input;
  command.rule = rules.rule;
  command.keep_orientation = rules.keep_orientation;
  auto scene = load_scene(command, session);
  if (!scene) return tl::unexpected(scene.error());
  const csg::Tree& tree = scene->tree;
  MeshInput all;
  all.bounds = csg::bounds(tree, tree.root());
  if (all.bounds.empty()) {
    return fail(ErrorCode::kGeometry, "{}: the scene is empty", input.files.front());
  }
  auto lists = std::make_shared<csg::SolidLists>(tree, tree.root());
  all.soup = lists->take_soup();
  all.tree = std::move(lists);
  all.scene = std::make_shared<csg::Tree>(tree);
  for (const std::string& path : input.files) {
    InputFacts facts;
    facts.path = path;
    facts.closed = true;
    facts.bounds = all.bounds;
    all.files.push_back(std::move(facts));
  }
  all.files.front().stats.triangles = all.soup.triangles.size();
  all.files.front().stats.vertices = all.soup.positions.size();
  all.read_ms = session.milliseconds() - start;
  session.note(fmt::format("{}: {}, {}", input.files.front(),
                           counted(tree.solids().size(), "solid"),
                           counted(all.soup.triangles.size(), "triangle")));
  return all;
}

}  // namespace strata::apps
