#include "strata/csg/input/solid_input.h"

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "core/printable.h"
#include "csg/input/input_parts.h"
#include "strata/csg/input/scene_input.h"
#include "strata/mesh/soup_tools.h"
#include "strata/raster/lattice_mesh.h"

namespace strata::csg {
namespace {

Solid solid_of(TriangleSoup soup, InsideRule rule, const std::string& name) {
  Solid solid;
  solid.mesh = std::make_shared<const TriangleSoup>(std::move(soup));
  solid.rule = rule;
  solid.name = name;
  return solid;
}

void set_union(SolidInput& all, std::vector<Solid> solids) {
  Tree tree;
  std::vector<Tree::NodeId> nodes;
  for (Solid& solid : solids) nodes.push_back(tree.add_solid(std::move(solid)));
  tree.set_root(tree.add(Operation::kUnion, nodes));
  all.set_tree(std::move(tree));
}

/// Appends a mesh to the one soup of those that share a rule.
/// @param elements  face elements of its file
Result<void> append_mesh(SolidInput& all, TriangleSoup soup, MeshAttributes attributes,
                         std::uint64_t elements, const std::string& path) {
  if (all.soup.triangles.empty()) {
    all.soup = std::move(soup);
    all.attributes = std::move(attributes);
    return {};
  }
  const std::size_t before = all.soup.positions.size();
  if (before + soup.positions.size() > 0xfffffffeu ||
      all.attributes.corners.size() + attributes.corners.size() > 0xffffffffu) {
    return fail(ErrorCode::kLimit, "{}: the inputs up to this one have more than 2^32 - 2 vertices",
                path);
  }
  append(all.soup, all.attributes, soup, std::move(attributes), elements);
  return {};
}

/// The attributes of a file, of which the facts keep the parts.
MeshAttributes take_attributes(InputFacts& facts) {
  MeshAttributes attributes = std::move(facts.attributes);
  facts.attributes = {};
  facts.attributes.parts = attributes.parts;
  return attributes;
}

/// Names of parts that several files have get the file's name before them.
void name_apart(std::vector<Solid>& solids, const std::vector<std::string>& files) {
  std::map<std::string, std::size_t> times;
  for (const Solid& solid : solids) ++times[solid.name];
  for (std::size_t i = 0; i < solids.size(); ++i) {
    if (!files[i].empty() && times[solids[i].name] > 1) {
      solids[i].name = files[i] + ":" + solids[i].name;
    }
  }
}

/// What the options say of the space of all inputs.
SolidInput begun(const SceneInput& input) {
  SolidInput all;
  all.unit_metres = world_unit(input);
  all.turned = input.space_from_world != glm::dmat3(1.0);
  return all;
}

/// Meshes, or their parts, as solids of a tree.
Result<SolidInput> load_apart(SceneInput input, const InputMessages& messages,
                              const Execution& execution) {
  input.split_parts = true;
  SolidInput all = begun(input);
  std::vector<Solid> apart;
  std::vector<std::string> files;  // of each that is a part
  for (std::size_t i = 0; i < input.files.size(); ++i) {
    const std::string& path = input.files[i];
    const detail::Stopwatch watch;
    std::vector<MeshSolid> solids;
    double read_ms = 0;
    auto facts =
        load_mesh_solids(path, kind_of(path, input), input, messages,
                         detail::part_of(execution, i, input.files.size()), solids, &read_ms);
    if (!facts) return tl::unexpected(facts.error());
    all.read_ms += read_ms;
    (void)take_attributes(*facts);
    all.add(*std::move(facts));
    for (MeshSolid& one : solids) {
      turn_mesh(input.space_from_world, one.soup, execution);
      apart.push_back(solid_of(std::move(one.soup), one.rule, one.name));
      files.push_back(one.is_part ? path : std::string());
    }
    all.diagnose_ms += watch.milliseconds() - read_ms;
  }
  if (input.files.size() > 1) name_apart(apart, files);
  set_union(all, std::move(apart));
  return all;
}

/// Meshes as one soup, or as a tree where they have several rules.
Result<SolidInput> load_meshes(const SceneInput& input, const InputMessages& messages,
                               const Execution& execution) {
  SolidInput all = begun(input);
  all.rule = input.rule;     // solids of a tree have their own
  std::vector<Solid> apart;  // those with a rule of their own
  for (std::size_t i = 0; i < input.files.size(); ++i) {
    const std::string& path = input.files[i];
    const detail::Stopwatch watch;
    TriangleSoup soup;
    double read_ms = 0;
    auto facts = load_mesh(path, kind_of(path, input), input, messages,
                           detail::part_of(execution, i, input.files.size()), soup, &read_ms);
    if (!facts) return tl::unexpected(facts.error());
    all.read_ms += read_ms;
    turn_mesh(input.space_from_world, soup, execution);
    const InsideRule rule = facts->rule;
    const std::uint64_t elements = facts->stats.faces;
    MeshAttributes attributes = take_attributes(*facts);
    all.add(*std::move(facts));
    if (input.files.size() == 1) {
      all.soup = std::move(soup);
      all.attributes = std::move(attributes);
      all.rule = rule;
    } else if (rule != input.rule) {
      apart.push_back(solid_of(std::move(soup), rule, path));
    } else if (auto added =
                   append_mesh(all, std::move(soup), std::move(attributes), elements, path);
               !added) {
      return tl::unexpected(added.error());
    }
    all.diagnose_ms += watch.milliseconds() - read_ms;
  }
  if (apart.empty()) return all;
  all.attributes = {};
  if (!all.soup.triangles.empty()) {
    apart.push_back(solid_of(std::move(all.soup), input.rule, input.files.front()));
  }
  set_union(all, std::move(apart));
  return all;
}

}  // namespace

void SolidInput::add(InputFacts facts) {
  closed = closed && facts.closed;
  area += facts.area;
  volume += facts.volume;
  longest_edge = std::max(longest_edge, facts.longest_edge);
  bounds.include(facts.bounds);
  files.push_back(std::move(facts));
}

void SolidInput::set_tree(Tree made) {
  tree = std::make_shared<SolidLists>(made, made.root());
  soup = tree->take_soup();
  // The soup has all triangles that are needed from here on.
  for (Solid& solid : made.solids()) solid.mesh.reset();
  scene = std::make_shared<Tree>(std::move(made));
}

Result<void> SolidInput::fit(const VoxelGrid& grid, const Execution& execution) {
  if (tree) return tree->fit(grid, &soup, execution);
  const Bounds box = turned ? strata::bounds(soup, execution) : bounds;
  const auto done = fit_lattice(soup, box, grid, execution);
  if (!done) return tl::unexpected(done.error());
  return {};
}

bool SolidInput::has_scene() const {
  return std::any_of(files.begin(), files.end(), [](const auto& file) { return file.is_scene; });
}

Result<SolidInput> load_solids(const SceneInput& input, bool as_tree, const InputMessages& messages,
                               const Execution& execution) {
  if (input.format == MeshFormat::kAuto && reads_standard_input(input)) {
    return fail(ErrorCode::kUsage,
                "standard input: the format must be given: obj, stl, ply, off or glb");
  }
  if (input.expression.empty() &&
      std::none_of(input.files.begin(), input.files.end(), is_scene_name)) {
    return as_tree ? load_apart(input, messages, execution)
                   : load_meshes(input, messages, execution);
  }
  const detail::Stopwatch watch;
  SolidInput all = begun(input);
  SceneInput apart = input;
  apart.split_parts = as_tree;
  auto scene = load_scene(apart, messages, execution, &all.files);
  if (!scene) return tl::unexpected(scene.error());
  all.bounds = strata::csg::bounds(scene->tree, scene->tree.root());
  if (all.bounds.empty()) {
    return fail(ErrorCode::kGeometry, "{}: the {} is empty", input.files.front(),
                input.expression.empty() ? "scene" : "result of the expression");
  }
  if (all.turned) {
    scene->tree = transform(glm::dmat4(input.space_from_world), std::move(scene->tree));
  }
  all.set_tree(std::move(scene->tree));
  for (const InputFacts& facts : all.files) all.closed = all.closed && facts.closed;
  all.read_ms = watch.milliseconds();
  detail::note(messages, fmt::format("{}: {}, {}", input.files.front(),
                                     counted(all.scene->solids().size(), "solid"),
                                     counted(all.soup.triangles.size(), "triangle")));
  return all;
}

}  // namespace strata::csg
