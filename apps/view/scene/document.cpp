#include "apps/view/scene/document.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <map>
#include <utility>

#include "apps/commands/csg_options.h"
#include "apps/session/session.h"
#include "apps/strata/library_session.h"
#include "csg/measure/result_bounds.h"
#include "strata/csg/input/scene_input.h"

namespace strata::view {
namespace {

using csg::Operation;
using csg::Tree;

/// What is taken away is shown in this colour.
constexpr glm::vec4 kSubtracted{1.0f, 0.32f, 0.32f, 0.3f};
/// The colour of what is selected. Only faces that show are tinted, and drawing costs no more.
constexpr glm::vec3 kSelected{0.25f, 0.6f, 1.0f};

/// The model's tree without the hidden solids, which stay in the list, empty. Node ids change.
class Copier {
 public:
  Copier(const Tree& from, const Looks& looks) : from_(from), looks_(looks) {
    std::vector<Tree::NodeId> operands;
    made_.resize(from.nodes().size());
    for (Tree::NodeId id = 0; id < made_.size(); ++id) {
      const Tree::Node& node = from.nodes()[id];
      if (node.operation == Operation::kSolid) {
        made_[id] = solid(node.first);
        continue;
      }
      operands.clear();
      bool gone = false;
      const auto old = from.operands(id);
      for (std::size_t i = 0; i < old.size(); ++i) {
        const Tree::NodeId operand = made_[old[i]];
        if (operand != Tree::kNone) operands.push_back(operand);
        gone =
            gone || (i == 0 && operand == Tree::kNone && node.operation == Operation::kDifference);
      }
      gone = gone || (operands.empty() && !old.empty());
      made_[id] = gone ? Tree::kNone : tree_.add(node.operation, operands);
    }
    if (from.root() != Tree::kNone) tree_.set_root(made_[from.root()]);
  }

  [[nodiscard]] Tree& tree() { return tree_; }
  [[nodiscard]] Tree::NodeId made(Tree::NodeId old) const { return made_[old]; }

  /// The largest subtrees that take away, below a node of the new tree.
  [[nodiscard]] std::vector<Tree::NodeId> subtracted() const {
    std::vector<Tree::NodeId> found;
    if (tree_.root() == Tree::kNone) return found;
    std::vector<Tree::NodeId> stack{tree_.root()};
    while (!stack.empty()) {
      const Tree::NodeId id = stack.back();
      stack.pop_back();
      if (tree_.nodes()[id].operation == Operation::kSolid) continue;
      const auto operands = tree_.operands(id);
      const bool difference = tree_.nodes()[id].operation == Operation::kDifference;
      for (std::size_t i = 0; i < operands.size(); ++i) {
        (difference && i > 0 ? found : stack).push_back(operands[i]);
      }
    }
    return found;
  }

 private:
  Tree::NodeId solid(std::uint32_t index) {
    csg::Solid copy = from_.solids()[index];
    const bool hidden = index < looks_.hidden.size() && looks_.hidden[index] != 0;
    if (hidden) copy.mesh = nullptr;
    if (const auto found = looks_.colours.find(index); found != looks_.colours.end()) {
      copy.colour = found->second;
    }
    // Of a single solid the tint would say nothing.
    if (looks_.selected == index && from_.solids().size() > 1) {
      copy.colour = glm::vec4(kSelected, copy.colour ? copy.colour->a : 1.0f);
    }
    const Tree::NodeId node = tree_.add_solid(std::move(copy));
    return hidden ? Tree::kNone : node;
  }

  const Tree& from_;
  const Looks& looks_;
  Tree tree_;
  std::vector<Tree::NodeId> made_;
};

/// The parameters of the input's program, if it is one.
std::vector<Parameter> parameters_of(const csg::SceneInput& input) {
  if (input.files.size() != 1 || !has_extension(input.files.front(), ".scad")) return {};
  std::ifstream in(input.files.front(), std::ios::binary);
  const std::string program{std::istreambuf_iterator<char>(in), {}};
  return parse_parameters(program);
}

Result<std::shared_ptr<const Model>> load_voxel_model(const std::string& path,
                                                      const apps::Session& session,
                                                      const Execution& execution) {
  auto voxels = VoxelScene::load(path, execution);
  if (!voxels) return tl::unexpected(voxels.error());
  auto model = std::make_shared<Model>();
  model->voxels = *std::move(voxels);
  model->box = model->voxels->box();
  model->warnings = model->voxels->volume().notes;
  model->scene.files.push_back(identify_file(path));
  model->load_ms = session.milliseconds();
  return model;
}

}  // namespace

bool operator==(const Looks& a, const Looks& b) {
  const auto same_plane = [&] {
    if (!a.section || !b.section) return a.section.has_value() == b.section.has_value();
    return a.section->normal == b.section->normal && a.section->offset == b.section->offset;
  };
  return a.hidden == b.hidden && a.colours == b.colours && a.ghosts == b.ghosts &&
         a.selected == b.selected && a.voxels == b.voxels && same_plane();
}

Result<std::shared_ptr<const Model>> load_model(const apps::CsgCommand& command,
                                                const Execution& execution) {
  apps::Session session(apps::Session::Clock::now(), execution);
  session.set_outputs(command.outputs);
  const std::vector<std::string>& files = command.input.files;
  if (files.size() == 1 && is_voxel_file(files.front())) {
    return load_voxel_model(files.front(), session, execution);
  }
  auto scene = csg::load_scene(command.input, apps::messages_of(session), execution);
  if (!scene) return tl::unexpected(scene.error());
  auto model = std::make_shared<Model>();
  const auto box = csg::visible_box(*scene, execution);
  if (!box) return tl::unexpected(box.error());
  model->box = *box;
  for (const csg::Solid& solid : scene->tree.solids()) {
    if (solid.mesh) model->triangles += solid.mesh->triangles.size();
  }
  for (const apps::Warning& warning : session.warnings()) {
    model->warnings.push_back(warning.message);
  }
  model->scene = *std::move(scene);
  model->parameters = parameters_of(command.input);
  model->load_ms = session.milliseconds();
  return model;
}

std::shared_ptr<const Arrangement> arrange(const Model& model, const Looks& looks) {
  if (model.voxels) {
    auto result = std::make_shared<Arrangement>();
    result->voxels = model.voxels;
    result->voxel_looks = looks.voxels;
    result->section = looks.section;
    return result;
  }
  const csg::Scene& scene = model.scene;
  Copier copier(scene.tree, looks);
  if (!scene.shown.empty()) {
    std::vector<Tree::NodeId> nodes;
    for (const Tree::NodeId node : scene.shown) {
      if (copier.made(node) != Tree::kNone) nodes.push_back(copier.made(node));
    }
    copier.tree().set_root(copier.tree().add(Operation::kUnion, nodes));
  }
  csg::Scene shown;
  // What each ghost is drawn in, in the order of first the backgrounds, then the highlights.
  std::vector<glm::vec4> colours;
  const auto keep = [&](const std::vector<Tree::NodeId>& ghosts, std::vector<Tree::NodeId>& out,
                        const glm::vec4& colour) {
    for (const Tree::NodeId ghost : ghosts) {
      if (copier.made(ghost) == Tree::kNone) continue;
      out.push_back(copier.made(ghost));
      colours.push_back(colour);
    }
  };
  keep(scene.backgrounds, shown.backgrounds, csg::kBackgroundGhost);
  keep(scene.highlights, shown.highlights, csg::kHighlightGhost);
  if (looks.ghosts) {
    // As one ghost: a section cuts each ghost by a box of its own that covers the whole picture.
    std::vector<Tree::NodeId> copies;
    for (const Tree::NodeId node : copier.subtracted())
      copies.push_back(copier.tree().append(copier.tree(), node));
    if (!copies.empty()) {
      shown.highlights.push_back(copier.tree().add(Operation::kUnion, copies));
      colours.push_back(kSubtracted);
    }
  }
  shown.tree = std::move(copier.tree());
  if (looks.section) csg::cut_scene(shown, std::span(&*looks.section, 1), Camera{});

  auto result = std::make_shared<Arrangement>();
  result->tree = std::move(shown.tree);
  std::size_t next = 0;
  for (const auto* ghosts : {&shown.backgrounds, &shown.highlights}) {
    for (const Tree::NodeId node : *ghosts) result->ghosts.push_back({node, colours[next++]});
  }
  result->relative_precision = scene.relative_precision;
  result->model_solids = scene.tree.solids().size();
  result->flat = scene.flat;
  return result;
}

Result<std::vector<std::uint32_t>> find_solids(const Model& model, std::string_view pattern) {
  const auto solids = model.scene.tree.solids();
  std::vector<std::uint32_t> whole, part;
  if (pattern.starts_with('@')) {
    std::uint64_t index = 0;
    for (const char c : pattern.substr(1)) {
      if (c < '0' || c > '9' || index > solids.size()) index = solids.size();
      if (index < solids.size()) index = index * 10 + static_cast<std::uint64_t>(c - '0');
    }
    if (pattern.size() == 1 || index >= solids.size()) {
      return fail(ErrorCode::kUsage, "the solid must be @0 to @{1}, got '{0}'", pattern,
                  solids.empty() ? 0 : solids.size() - 1);
    }
    return std::vector{static_cast<std::uint32_t>(index)};
  }
  for (std::uint32_t i = 0; i < solids.size(); ++i) {
    if (pattern == "all" || solids[i].name == pattern) whole.push_back(i);
    if (!pattern.empty() && solids[i].name.find(pattern) != std::string::npos) part.push_back(i);
  }
  if (!whole.empty()) return whole;
  if (!part.empty()) return part;
  return fail(ErrorCode::kUsage, "no solid has '{}' in its name", pattern);
}

std::string short_name(std::string_view name) {
  const std::size_t slash = name.rfind('/');
  if (slash == std::string_view::npos) return std::string(name);
  const std::size_t at = name.find(" at ");
  const std::string_view what =
      at != std::string_view::npos && at < slash ? name.substr(0, at + 4) : std::string_view();
  return fmt::format("{}{}", what, name.substr(slash + 1));
}

Looks carry_over(const Looks& looks, const Model& before, const Model& after) {
  using Key = std::pair<std::string, int>;
  const auto keys_of = [](const Model& model) {
    std::vector<Key> keys;
    std::map<std::string, int> count;
    for (const csg::Solid& solid : model.scene.tree.solids()) {
      keys.emplace_back(solid.name, count[solid.name]++);
    }
    return keys;
  };
  const std::vector<Key> old_keys = keys_of(before), new_keys = keys_of(after);
  std::map<Key, std::uint32_t> where;
  for (std::uint32_t i = 0; i < old_keys.size(); ++i) where.emplace(old_keys[i], i);
  Looks result;
  result.section = looks.section;
  result.ghosts = looks.ghosts;
  result.voxels = looks.voxels;
  if (before.voxels && after.voxels &&
      before.voxels->volume().grid().dims != after.voxels->volume().grid().dims) {
    result.voxels.slice.reset();
  }
  for (std::uint32_t i = 0; i < new_keys.size(); ++i) {
    const auto found = where.find(new_keys[i]);
    if (found == where.end()) continue;
    const std::uint32_t old = found->second;
    if (old < looks.hidden.size() && looks.hidden[old] != 0) {
      result.hidden.resize(new_keys.size(), 0);
      result.hidden[i] = 1;
    }
    if (const auto colour = looks.colours.find(old); colour != looks.colours.end()) {
      result.colours.emplace(i, colour->second);
    }
    if (looks.selected == old) result.selected = i;
  }
  return result;
}

std::optional<glm::vec4> parse_colour(std::string_view text) {
  int alpha = 255;
  if (text.size() == 9 && text[0] == '#') {
    const auto last = apps::parse_colour("", fmt::format("#0000{}", text.substr(7)));
    if (!last) return {};
    alpha = last->b;
    text = text.substr(0, 7);
  }
  const auto colour = apps::parse_colour("", text);
  if (!colour) return {};
  return glm::vec4(glm::vec3(*colour), alpha) / 255.0f;
}

}  // namespace strata::view
