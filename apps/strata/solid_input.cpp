#include <algorithm>
#include <utility>

#include "apps/session/session.h"
#include "apps/strata/csg_scene.h"
#include "apps/strata/mesh_input.h"

namespace strata::apps {
namespace {

/// Meshes as the solids of a union, in their order.
Result<MeshInput> load_united(const InputOptions& input, const MeshInputRules& rules,
                              Session& session) {
  MeshInput all;
  csg::Tree tree;
  std::vector<csg::Tree::NodeId> solids;
  for (const std::string& path : input.files) {
    const double start = session.milliseconds();
    TriangleSoup soup;
    double read_ms = 0;
    auto facts = load_mesh(path, input, rules, session, soup, &read_ms);
    if (!facts) return tl::unexpected(facts.error());
    csg::Solid solid;
    solid.mesh = std::make_shared<const TriangleSoup>(std::move(soup));
    solid.rule = facts->rule;
    solid.name = path;
    solids.push_back(tree.add_solid(std::move(solid)));
    all.add(*std::move(facts));
    all.read_ms += read_ms;
    all.diagnose_ms += session.milliseconds() - start - read_ms;
  }
  tree.set_root(tree.add(csg::Operation::kUnion, solids));
  all.set_tree(std::move(tree));
  return all;
}

}  // namespace

Result<MeshInput> load_solids(const InputOptions& input, const MeshInputRules& rules,
                              Session& session) {
  if (input.format == MeshFormat::kAuto && reads_standard_input(input)) {
    return fail(ErrorCode::kUsage, "standard input needs --input-format: obj, stl, ply or off");
  }
  if (std::none_of(input.files.begin(), input.files.end(), is_scene_name)) {
    return rules.as_tree ? load_united(input, rules, session) : load_meshes(input, rules, session);
  }
  const double start = session.milliseconds();
  CsgCommand command;
  command.input = input;
  command.rule = rules.rule;
  command.keep_orientation = rules.keep_orientation;
  MeshInput all;
  auto scene = load_scene(command, session, &all.files);
  if (!scene) return tl::unexpected(scene.error());
  all.bounds = csg::bounds(scene->tree, scene->tree.root());
  if (all.bounds.empty()) {
    return fail(ErrorCode::kGeometry, "{}: the scene is empty", input.files.front());
  }
  all.set_tree(std::move(scene->tree));
  for (const InputFacts& facts : all.files) all.closed = all.closed && facts.closed;
  all.read_ms = session.milliseconds() - start;
  session.note(fmt::format("{}: {}, {}", input.files.front(),
                           counted(all.scene->solids().size(), "solid"),
                           counted(all.soup.triangles.size(), "triangle")));
  return all;
}

}  // namespace strata::apps
