#include "apps/strata/csg_scene.h"

#include <algorithm>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "apps/session/option_values.h"
#include "apps/strata/expression.h"
#include "apps/strata/mesh_input.h"
#include "csg/measure/result_bounds.h"
#include "strata/mesh/diagnose.h"
#include "strata/mesh/shapes.h"

namespace strata::apps {
namespace {

using csg::Operation;
using csg::Tree;

/// An input that is used more than once is copied, for a node stands in one place only.
constexpr std::size_t kMaxNodes = std::size_t{1} << 24;

bool is_scene(const std::string& path, const CsgCommand& command) {
  if (command.scene_format) {
    // As format_of(): beside standard input, meshes are known by their names.
    return !reads_standard_input(command.input) || mesh_format_of(path) == MeshFormat::kAuto;
  }
  return format_of(path, command.input) == MeshFormat::kAuto && is_scene_name(path);
}

/// What a scene's file is, and what the solids of its result hold.
InputFacts facts_of(const std::string& path, const csg::Scene& scene, const CsgCommand& command,
                    const Execution& execution) {
  InputFacts facts;
  facts.path = path;
  facts.is_scene = true;
  facts.closed = true;
  const bool program = has_extension(path, ".scad");
  facts.stats.format = program && !command.scene_format ? "scad" : "csg";
  std::error_code unknown;
  const auto bytes = std::filesystem::file_size(path, unknown);
  if (!unknown) facts.stats.bytes = bytes;
  const Tree& tree = scene.tree;
  if (tree.root() == Tree::kNone) return facts;
  facts.bounds = csg::bounds(tree, tree.root());
  std::vector<Tree::NodeId> stack{tree.root()};
  std::set<const TriangleSoup*> diagnosed;
  while (!stack.empty()) {
    const Tree::NodeId id = stack.back();
    stack.pop_back();
    if (tree.nodes()[id].operation != Operation::kSolid) {
      const auto operands = tree.operands(id);
      stack.insert(stack.end(), operands.rbegin(), operands.rend());
      continue;
    }
    const csg::Solid& solid = tree.solids()[tree.nodes()[id].first];
    if (!solid.mesh) continue;
    facts.stats.triangles += solid.mesh->triangles.size();
    facts.stats.vertices += solid.mesh->positions.size();
    // Scenes take meshes by parity where their edges are not balanced, and only there.
    if (solid.rule != InsideRule::kParity || !diagnosed.insert(solid.mesh.get()).second) continue;
    const MeshDiagnosis found = diagnose(*solid.mesh, execution);
    facts.unbalanced_edges += found.unbalanced_edges;
    if (found.even) continue;
    facts.closed = false;
    if (!facts.open.empty()) continue;
    facts.open = fmt::format("{} is not closed: {} of {} edges are unbalanced", solid.name,
                             found.unbalanced_edges, found.edges);
  }
  return facts;
}

Result<csg::Scene> load_one(const std::string& path, const CsgCommand& command, Session& session,
                            std::vector<InputFacts>* told) {
  if (is_scene(path, command)) {
    const double share = 0.5 / static_cast<double>(command.input.files.size());
    Execution execution = session.execution("reading", share);
    auto scene = csg::read_scene(path, command.input.scene, execution);
    execution.progress = {};
    if (scene && told != nullptr) told->push_back(facts_of(path, *scene, command, execution));
    return scene;
  }
  if (command.input.format == MeshFormat::kAuto && path == "-") {
    return fail(ErrorCode::kUsage,
                "standard input needs --input-format: csg, obj, stl, ply or off");
  }
  if (auto named = check_input_name(path, command.input, true); !named) {
    return tl::unexpected(named.error());
  }
  csg::Scene scene;
  TriangleSoup soup;
  auto facts = load_mesh(path, command.input,
                         {.keep_orientation = command.keep_orientation, .rule = command.rule},
                         session, soup);
  if (!facts) return tl::unexpected(facts.error());
  csg::Solid solid;
  solid.mesh = std::make_shared<const TriangleSoup>(std::move(soup));
  solid.rule = facts->rule;
  solid.name = path;
  scene.tree.set_root(scene.tree.add_solid(std::move(solid)));
  if (told != nullptr) told->push_back(*std::move(facts));
  return scene;
}

/// Adds all of a scene to another one. Gives the root.
Tree::NodeId add_scene(csg::Scene& all, const csg::Scene& part, bool with_ghosts) {
  std::vector<Tree::NodeId> nodes(part.tree.nodes().size());
  std::iota(nodes.begin(), nodes.end(), Tree::NodeId{0});
  const std::vector<Tree::NodeId> copies = all.tree.append(part.tree, nodes);
  if (with_ghosts) {
    for (const Tree::NodeId ghost : part.backgrounds) all.backgrounds.push_back(copies[ghost]);
    for (const Tree::NodeId ghost : part.highlights) all.highlights.push_back(copies[ghost]);
  }
  if (part.tree.root() == Tree::kNone) return all.tree.add(Operation::kUnion, {});
  return copies[part.tree.root()];
}

/// Builds an expression over inputs.
class Builder {
 public:
  Builder(const Expression& expression, const std::vector<csg::Scene>& inputs)
      : expression_(expression), inputs_(inputs), used_(inputs.size(), false) {}

  Result<csg::Scene> run() {
    // Nodes of the tree that each node of the expression will take.
    std::vector<double> sizes(expression_.nodes.size());
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      const Expression::Node& node = expression_.nodes[i];
      const double both = node.kind == Expression::Kind::kInput
                              ? static_cast<double>(inputs_[node.input].tree.nodes().size()) + 1
                              : sizes[node.first] + sizes[node.second] + 1;
      sizes[i] = node.kind == Expression::Kind::kExclusive ? 2 * both : both;
    }
    if (sizes.back() > kMaxNodes) {
      return fail(ErrorCode::kLimit, "--expr: the tree has {:.3g} nodes; the limit is {}",
                  sizes.back(), kMaxNodes);
    }
    for (const csg::Scene& input : inputs_) {
      all_.relative_precision = std::max(all_.relative_precision, input.relative_precision);
    }
    all_.tree.set_root(build(expression_.nodes.size() - 1));
    return std::move(all_);
  }

 private:
  /// Depth: as many parentheses as the parser allows. A chain without them is walked from the left:
  /// a run of one operator becomes one node, in which an input is not repeated.
  Tree::NodeId build(std::size_t at) {
    std::vector<std::size_t> chain;  // from the right
    while (expression_.nodes[at].kind != Expression::Kind::kInput &&
           expression_.nodes[at].kind != Expression::Kind::kExclusive) {
      chain.push_back(at);
      at = expression_.nodes[at].first;
    }
    Tree::NodeId left = build_one(expression_.nodes[at]);
    // What stands first counts as repeated where that changes nothing: not in a - a.
    std::optional<std::size_t> first = input_of(at);
    while (!chain.empty()) {
      const Expression::Kind kind = expression_.nodes[chain.back()].kind;
      std::vector<Tree::NodeId> operands{left};
      std::set<std::size_t> had;
      if (first && kind != Expression::Kind::kDifference) had.insert(*first);
      for (; !chain.empty() && expression_.nodes[chain.back()].kind == kind; chain.pop_back()) {
        const std::size_t next = expression_.nodes[chain.back()].second;
        const auto input = input_of(next);
        if (!input || had.insert(*input).second) operands.push_back(build(next));
      }
      if (operands.size() == 1) continue;  // a * a
      left = all_.tree.add(operation_of(kind), operands);
      first.reset();
    }
    return left;
  }
  Tree::NodeId build_one(const Expression::Node& node) {
    if (node.kind == Expression::Kind::kInput) {
      const bool first = !used_[node.input];
      used_[node.input] = true;
      return add_scene(all_, inputs_[node.input], first);
    }
    const Tree::NodeId left = build_pair(node, Operation::kDifference, false);
    const Tree::NodeId right = build_pair(node, Operation::kDifference, true);
    return all_.tree.add(Operation::kUnion, {left, right});
  }
  [[nodiscard]] std::optional<std::size_t> input_of(std::size_t at) const {
    const Expression::Node& node = expression_.nodes[at];
    if (node.kind != Expression::Kind::kInput) return {};
    return node.input;
  }
  static Operation operation_of(Expression::Kind kind) {
    return kind == Expression::Kind::kUnion          ? Operation::kUnion
           : kind == Expression::Kind::kIntersection ? Operation::kIntersection
                                                     : Operation::kDifference;
  }
  Tree::NodeId build_pair(const Expression::Node& node, Operation operation, bool swapped) {
    const Tree::NodeId first = build(swapped ? node.second : node.first);
    const Tree::NodeId second = build(swapped ? node.first : node.second);
    return all_.tree.add(operation, {first, second});
  }

  const Expression& expression_;
  const std::vector<csg::Scene>& inputs_;
  std::vector<bool> used_;
  csg::Scene all_;
};

/// The box [0, size] turned so that z points along `normal`, its bottom at the plane.
std::shared_ptr<const TriangleSoup> half_space(const glm::dvec3& normal, double offset,
                                               const glm::dvec3& centre, double radius) {
  const glm::dvec3 other = std::abs(normal.z) > 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 0, 1);
  const glm::dvec3 u = glm::normalize(glm::cross(other, normal)), v = glm::cross(normal, u);
  const glm::dvec3 foot = centre + normal * (offset - glm::dot(normal, centre));
  const glm::dmat4 place(glm::dvec4(u, 0), glm::dvec4(v, 0), glm::dvec4(normal, 0),
                         glm::dvec4(foot, 1));
  const TriangleSoup box =
      make_box(glm::dvec3(-radius, -radius, 0), glm::dvec3(radius, radius, 2 * radius));
  return std::make_shared<const TriangleSoup>(transform(box, place));
}

/// What the unions at the top of a node unite.
std::vector<Tree::NodeId> united(const Tree& tree, Tree::NodeId node) {
  std::vector<Tree::NodeId> stack{node}, parts;
  while (!stack.empty()) {
    const Tree::NodeId id = stack.back();
    stack.pop_back();
    if (tree.nodes()[id].operation != Operation::kUnion) {
      parts.push_back(id);
      continue;
    }
    const auto operands = tree.operands(id);
    stack.insert(stack.end(), operands.rbegin(), operands.rend());
  }
  return parts;
}

}  // namespace

bool is_scene_name(const std::string& path) {
  for (const char* end : {".csg", ".scad", ".CSG", ".SCAD"}) {
    if (path.ends_with(end)) return true;
  }
  return false;
}

Result<csg::Scene> load_scene(const CsgCommand& command, Session& session,
                              std::vector<InputFacts>* facts) {
  const std::vector<std::string>& files = command.input.files;
  Expression expression;
  if (!command.expression.empty()) {
    auto parsed = parse_expression(command.expression, files);
    if (!parsed) return tl::unexpected(parsed.error());
    expression = *std::move(parsed);
  }
  std::vector<csg::Scene> inputs;
  std::vector<FileIdentity> files_read;
  for (const std::string& path : files) {
    auto scene = load_one(path, command, session, facts);
    if (!scene) return tl::unexpected(scene.error());
    if (auto kept = session.opened(scene->files); !kept) return tl::unexpected(kept.error());
    for (const std::string& note : scene->notes) {
      note.starts_with("ECHO: ") ? session.echo(note) : session.note(note);
    }
    for (const csg::SceneWarning& warning : scene->warnings) {
      session.warn(warning.code, warning.message);
    }
    files_read.insert(files_read.end(), scene->files.begin(), scene->files.end());
    inputs.push_back(*std::move(scene));
  }
  const bool flat =
      std::all_of(inputs.begin(), inputs.end(), [](const csg::Scene& input) { return input.flat; });
  if (!command.expression.empty()) {
    auto built = Builder(expression, inputs).run();
    if (built) built->flat = flat, built->files = std::move(files_read);
    return built;
  }
  if (inputs.size() == 1) return std::move(inputs.front());
  csg::Scene all;
  all.flat = flat;
  all.files = std::move(files_read);
  std::vector<Tree::NodeId> roots, shown;
  for (const csg::Scene& input : inputs) {
    const auto before = static_cast<Tree::NodeId>(all.tree.nodes().size());
    roots.push_back(add_scene(all, input, true));
    // Nodes are added in their order.
    for (const Tree::NodeId node : input.shown) shown.push_back(before + node);
    if (input.shown.empty()) shown.push_back(roots.back());
    all.relative_precision = std::max(all.relative_precision, input.relative_precision);
  }
  all.tree.set_root(all.tree.add(Operation::kUnion, roots));
  if (shown != roots) all.shown = std::move(shown);
  return all;
}

Result<Bounds> visible_box(const csg::Scene& scene, const Execution& execution) {
  std::vector<Tree::NodeId> shown = scene.shown;
  if (shown.empty()) shown.push_back(scene.tree.root());
  Result<Bounds> box{Bounds{}};
  for (const Tree::NodeId node : shown) {
    const auto one = csg::result_bounds(scene.tree, node, scene.relative_precision, execution);
    if (!one) return one;
    box->include(*one);
  }
  for (const auto* ghosts : {&scene.backgrounds, &scene.highlights}) {
    for (const Tree::NodeId ghost : *ghosts) box->include(csg::bounds(scene.tree, ghost));
  }
  return box;
}

void cut_scene(csg::Scene& scene, const std::vector<SectionPlane>& cuts,
               const csg::Camera& camera) {
  Bounds box;
  for (const csg::Solid& solid : scene.tree.solids()) box.include(csg::bounds(solid));
  if (box.empty()) return;
  const glm::dvec3 centre = 0.5 * box.low + 0.5 * box.high;
  const glm::dvec3 to_eye =
      glm::transpose(glm::dmat3(csg::eye_from_world(camera))) * glm::dvec3(0, 0, 1);
  const auto solids = scene.tree.solids();
  const bool has_translucent = std::any_of(solids.begin(), solids.end(), [](const auto& solid) {
    return solid.colour && solid.colour->a < 1.0f;
  });
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    glm::dvec3 normal = cuts[i].normal;
    double offset = cuts[i].offset;
    if (cuts[i].towards_eye && glm::dot(normal, to_eye) < 0) normal = -normal, offset = -offset;
    // A little more than all solids reach, so that no other face of it touches them.
    const double radius = glm::length(box.high - box.low) * 0.55 + 1e-9;
    const double above = offset - glm::dot(normal, centre);
    if (above > radius) continue;  // beyond all solids
    const auto mesh = half_space(normal, offset, centre, radius + std::max(0.0, -above));
    // Each has a box of its own, for a node stands in one place only.
    const auto cut = [&](Tree::NodeId node, const std::string& of) {
      csg::Solid solid;
      solid.mesh = mesh;
      solid.name = fmt::format("section {}{}", i + 1, of);
      const Tree::NodeId half = scene.tree.add_solid(std::move(solid));
      return scene.tree.add(Operation::kDifference, {node, half});
    };
    const auto cut_root = [&](Tree::NodeId root) {
      // Translucent solids stay children of the root's union.
      std::vector<Tree::NodeId> parts;
      if (has_translucent) {
        parts = united(scene.tree, root);
        for (std::size_t k = 0; k < parts.size(); ++k) {
          parts[k] = cut(parts[k], parts.size() > 1 ? fmt::format(" of part {}", k + 1) : "");
        }
      }
      return has_translucent ? scene.tree.add(Operation::kUnion, parts) : cut(root, "");
    };
    if (scene.tree.root() != Tree::kNone) scene.tree.set_root(cut_root(scene.tree.root()));
    for (Tree::NodeId& node : scene.shown) node = cut_root(node);
    std::size_t ghosts = 0;
    for (auto* list : {&scene.backgrounds, &scene.highlights}) {
      for (Tree::NodeId& ghost : *list) ghost = cut(ghost, fmt::format(" of ghost {}", ++ghosts));
    }
  }
}

}  // namespace strata::apps
