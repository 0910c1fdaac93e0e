#include "strata/csg/input/scene_input.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "core/printable.h"
#include "csg/input/expression.h"
#include "csg/input/input_parts.h"
#include "csg/measure/result_bounds.h"
#include "strata/mesh/diagnose.h"

namespace strata::csg {
namespace {

/// An input that is used more than once is copied, for a node stands in one place only.
constexpr std::size_t kMaxNodes = std::size_t{1} << 24;

/// What a scene's file is, and what the solids of its result hold.
InputFacts facts_of(const std::string& path, const Scene& scene, const SceneInput& input,
                    const Execution& execution) {
  InputFacts facts;
  facts.path = path;
  facts.is_scene = true;
  facts.closed = true;
  const bool program = has_extension(path, ".scad");
  facts.stats.format = program && !input.scene_format ? "scad" : "csg";
  std::error_code unknown;
  const auto bytes = std::filesystem::file_size(path, unknown);
  if (!unknown) facts.stats.bytes = bytes;
  const Tree& tree = scene.tree;
  if (tree.root() == Tree::kNone) return facts;
  facts.bounds = bounds(tree, tree.root());
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
    const Solid& solid = tree.solids()[tree.nodes()[id].first];
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

Result<Scene> load_one(const std::string& path, const SceneInput& input,
                       const InputMessages& messages, Execution execution,
                       std::vector<InputFacts>* told) {
  const InputKind kind = kind_of(path, input);
  if (kind.is_scene) {
    if (!input.parts.empty()) {
      return fail(ErrorCode::kUsage, "{}: a scene has no parts to choose from, got '{}'", path,
                  printable(input.parts.front(), 100));
    }
    auto scene = read_scene(path, input.scene, execution);
    execution.progress = {};
    if (!scene) return scene;
    if (auto placed = place_scene(path, input, *scene); !placed) {
      return tl::unexpected(placed.error());
    }
    if (told != nullptr) told->push_back(facts_of(path, *scene, input, execution));
    return scene;
  }
  if (input.format == MeshFormat::kAuto && path == "-") {
    return fail(ErrorCode::kUsage,
                "standard input: the format must be given: csg, obj, stl, ply, off or glb");
  }
  if (auto named = check_input_name(path, kind, true); !named) {
    return tl::unexpected(named.error());
  }
  Scene scene;
  std::vector<MeshSolid> solids;
  auto facts = load_mesh_solids(path, kind, input, messages, execution, solids);
  if (!facts) return tl::unexpected(facts.error());
  std::vector<Tree::NodeId> nodes;
  for (MeshSolid& one : solids) {
    Solid solid;
    solid.mesh = std::make_shared<const TriangleSoup>(std::move(one.soup));
    solid.rule = one.rule;
    solid.name = std::move(one.name);
    nodes.push_back(scene.tree.add_solid(std::move(solid)));
  }
  scene.tree.set_root(nodes.size() == 1 ? nodes.front() : scene.tree.add(Operation::kUnion, nodes));
  if (told != nullptr) told->push_back(*std::move(facts));
  return scene;
}

/// Hands on what a scene says of itself.
Result<void> tell(const Scene& scene, const InputMessages& messages) {
  if (messages.opened) {
    if (auto kept = messages.opened(scene.files); !kept) return kept;
  }
  for (const std::string& line : scene.notes) {
    const auto& say = line.starts_with("ECHO: ") ? messages.echo : messages.note;
    if (say) say(line);
  }
  for (const SceneWarning& warning : scene.warnings) {
    detail::warn(messages, warning.code, warning.message);
  }
  return {};
}

/// Adds all of a scene to another one. Gives the root.
Tree::NodeId add_scene(Scene& all, const Scene& part, bool with_ghosts) {
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
  Builder(const Expression& expression, const std::vector<Scene>& inputs)
      : expression_(expression), inputs_(inputs), used_(inputs.size(), false) {}

  Result<Scene> run() {
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
      return fail(ErrorCode::kLimit, "the expression: the tree has {:.3g} nodes; the limit is {}",
                  sizes.back(), kMaxNodes);
    }
    for (const Scene& input : inputs_) {
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
  const std::vector<Scene>& inputs_;
  std::vector<bool> used_;
  Scene all_;
};

/// All inputs side by side.
Scene unite(const std::vector<Scene>& inputs) {
  Scene all;
  std::vector<Tree::NodeId> roots, shown;
  for (const Scene& input : inputs) {
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

}  // namespace

bool is_scene_name(const std::string& path) {
  for (const char* end : {".csg", ".scad", ".CSG", ".SCAD"}) {
    if (path.ends_with(end)) return true;
  }
  return false;
}

Result<Scene> load_scene(const SceneInput& input, const InputMessages& messages,
                         const Execution& execution, std::vector<InputFacts>* facts) {
  Expression expression;
  if (!input.expression.empty()) {
    auto parsed = parse_expression(input.expression, input.files);
    if (!parsed) return tl::unexpected(parsed.error());
    expression = *std::move(parsed);
  }
  std::vector<Scene> parts;
  std::vector<FileIdentity> files_read;
  for (std::size_t i = 0; i < input.files.size(); ++i) {
    auto scene = load_one(input.files[i], input, messages,
                          detail::part_of(execution, i, input.files.size()), facts);
    if (!scene) return scene;
    if (auto kept = tell(*scene, messages); !kept) return tl::unexpected(kept.error());
    files_read.insert(files_read.end(), scene->files.begin(), scene->files.end());
    parts.push_back(*std::move(scene));
  }
  if (expression.nodes.empty() && parts.size() == 1) return std::move(parts.front());
  auto all =
      expression.nodes.empty() ? Result<Scene>(unite(parts)) : Builder(expression, parts).run();
  if (!all) return all;
  all->flat = std::all_of(parts.begin(), parts.end(), [](const Scene& part) { return part.flat; });
  all->files = std::move(files_read);
  return all;
}

Result<Bounds> visible_box(const Scene& scene, const Execution& execution) {
  std::vector<Tree::NodeId> shown = scene.shown;
  if (shown.empty()) shown.push_back(scene.tree.root());
  Result<Bounds> box{Bounds{}};
  for (const Tree::NodeId node : shown) {
    const auto one = result_bounds(scene.tree, node, scene.relative_precision, execution);
    if (!one) return one;
    box->include(*one);
  }
  for (const auto* ghosts : {&scene.backgrounds, &scene.highlights}) {
    for (const Tree::NodeId ghost : *ghosts) box->include(bounds(scene.tree, ghost));
  }
  return box;
}

}  // namespace strata::csg
