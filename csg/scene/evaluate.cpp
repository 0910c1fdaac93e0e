#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>
#include <utility>

#include "csg/outline/extrude.h"
#include "csg/scene/evaluator.h"
#include "csg/scene/vast_solids.h"

namespace strata::csg {
namespace {

struct Module {
  std::string_view name;
  NodeKind kind;
};
constexpr Module kModules[] = {
    {"multmatrix", NodeKind::kUnion},
    {"group", NodeKind::kUnion},
    {"color", NodeKind::kUnion},
    {"cube", NodeKind::kLeaf},
    {"cylinder", NodeKind::kLeaf},
    {"sphere", NodeKind::kLeaf},
    {"square", NodeKind::kLeaf},
    {"circle", NodeKind::kLeaf},
    {"polygon", NodeKind::kLeaf},
    {"difference", NodeKind::kDifference},
    {"linear_extrude", NodeKind::kLinearExtrude},
    {"union", NodeKind::kUnion},
    {"intersection", NodeKind::kIntersection},
    {"hull", NodeKind::kHull},
    {"polyhedron", NodeKind::kLeaf},
    {"rotate_extrude", NodeKind::kRotateExtrude},
    {"import", NodeKind::kLeaf},
    {"text", NodeKind::kLeaf},
    {"projection", NodeKind::kProjection},
    {"render", NodeKind::kUnion},
    {"minkowski", NodeKind::kMinkowski},
    {"resize", NodeKind::kResize},
    {"offset", NodeKind::kOffset},
    {"fill", NodeKind::kFill},
    {"roof", NodeKind::kRoof},
    {"surface", NodeKind::kLeaf},
};

const Module* find_module(std::string_view name) {
  const auto* found = std::find_if(std::begin(kModules), std::end(kModules),
                                   [&](const Module& module) { return module.name == name; });
  return found == std::end(kModules) ? nullptr : found;
}

bool has_own_frame(NodeKind kind) { return kind >= NodeKind::kHull && kind < NodeKind::kLeaf; }

/// Whether a version after 2021.01 wrote the file. Such versions leave out default values.
bool is_newer_dialect(const Ast& ast) {
  for (const AstNode& node : ast.nodes) {
    const NodeArguments arguments(ast, node);
    if (node.name == "linear_extrude" &&
        (!arguments.find("center").given() || !arguments.find("scale").given())) {
      return true;
    }
    if (node.name == "rotate_extrude" && arguments.find("start").given()) return true;
  }
  return false;
}

/// Reads the argument of multmatrix. Missing entries are those of the identity.
/// @param fault  describes an entry that is not a finite number, if there is one
glm::dmat4 read_matrix(const ValueRef& value, std::string& fault) {
  glm::dmat4 matrix(1.0);
  int row = 0;
  if (value.given() && !value.is_list()) fault = value.shown();
  for (const ValueRef line : value) {
    if (row == 4) break;
    int column = 0;
    for (const ValueRef element : line) {
      if (column == 4) break;
      double& entry = matrix[column++][row];
      entry = element.number(entry);
      if (fault.empty() && (!element.is_number() || !std::isfinite(entry))) {
        fault = fmt::format("{} in row {}, column {}", element.shown(), row + 1, column);
      }
    }
    ++row;
  }
  // The homogeneous coordinate is divided out; perspective is ignored, as in OpenSCAD.
  const double w = matrix[3][3];
  if (w != 1.0 && w != 0.0 && std::isfinite(w)) matrix *= 1.0 / w;
  matrix[0][3] = matrix[1][3] = matrix[2][3] = 0.0;
  if (std::isfinite(w)) matrix[3][3] = 1.0;
  return matrix;
}

bool is_finite(const glm::dmat4& matrix) {
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 4; ++row) {
      if (!std::isfinite(matrix[column][row])) return false;
    }
  }
  return true;
}

bool same_colour(const std::optional<glm::vec4>& a, const std::optional<glm::vec4>& b) {
  return a.has_value() == b.has_value() && (!a || *a == *b);
}

}  // namespace

Evaluator::Evaluator(const Ast& ast, const Execution& execution, std::string folder,
                     std::string root)
    : ast_(ast),
      execution_(execution),
      folder_(std::move(folder)),
      root_(std::move(root)),
      job_(execution_) {}

Result<Scene> Evaluator::run() {
  newer_ = is_newer_dialect(ast_);
  scene_.relative_precision = 5e-6;
  const auto count = static_cast<std::uint32_t>(ast_.nodes.size());
  std::uint32_t first = 0, end = count;
  // The first subtree with `!` is the whole scene, without the transforms around it.
  bool found = false;
  for (std::uint32_t i = 0; i < count; ++i) {
    const AstNode& node = ast_.nodes[i];
    if (node.modifiers & AstNode::kDisabled) {
      i = node.end - 1;
    } else if (node.modifiers & AstNode::kRoot) {
      if (found) {
        warn(i, "ignored", "a second root modifier (!) is ignored");
        continue;
      }
      found = true;
      first = i;
      end = node.end;
    }
  }
  walk(first, end);
  job_ended(first);
  if (error_) return tl::unexpected(*error_);
  Scene scene = take_scene();
  job_ended(first);
  if (error_) return tl::unexpected(*error_);
  if (auto checked = check_coordinates(scene); !checked) {
    return tl::unexpected(checked.error());
  }
  return scene;
}

void Evaluator::walk(std::uint32_t first, std::uint32_t end) {
  Frame top;
  top.node = static_cast<std::uint32_t>(ast_.nodes.size());
  top.end = end;
  frames_.push_back(std::move(top));
  walk_first_ = first, walk_end_ = end;
  for (std::uint32_t node = first; !error_;) {
    while (frames_.size() > 1 && frames_.back().end <= node && !error_) leave();
    if (node >= end || error_) break;
    if (execution_.stop.stop_requested()) {
      error_ = {ErrorCode::kCancelled, "stopped"};
      break;
    }
    if ((node & 63u) == 0) {
      report(static_cast<double>(node - first) / (end - first));
    }
    const std::size_t depth = frames_.size();
    if (!(ast_.nodes[node].modifiers & AstNode::kDisabled)) enter(node);
    // A leaf is complete now; its children, if any, are skipped.
    node = frames_.size() > depth ? node + 1 : ast_.nodes[node].end;
  }
}

/// Reports progress. The share never decreases: work on a node follows the work on its children.
void Evaluator::report(double done) {
  reported_ = std::max(reported_, done);
  if (execution_.progress) execution_.progress(reported_);
}

Execution Evaluator::part_execution(const Frame& frame) {
  Execution execution = execution_;
  const double count = walk_end_ - walk_first_;
  const double begin = std::max(reported_, (frame.node - walk_first_) / count);
  const double end = std::max(begin, (frame.end - walk_first_) / count);
  execution.progress = [this, begin, end](double done) { report(begin + done * (end - begin)); };
  return execution;
}

void Evaluator::enter(std::uint32_t node) {
  const AstNode& call = ast_.nodes[node];
  const Context& around = frames_.back().inside;
  Frame frame;
  frame.node = node;
  frame.end = call.end;
  frame.modifiers = call.modifiers;
  frame.base = operands_.size();
  frame.outside = around;
  if (call.modifiers & AstNode::kBackground) {
    // Ghosts are placed in the world, outside all frames.
    frame.outside.world = around.outer * around.world;
    frame.outside.outer = glm::dmat4(1.0);
    frame.outside.keep_flattened = false;
  }
  frame.inside = frame.outside;
  if (call.modifiers & AstNode::kHighlight) frame.inside.highlighted = true;

  const Module* module = find_module(call.name);
  frame.kind = module ? module->kind : NodeKind::kUnion;
  if (!module) {
    warn(node, "not-done",
         fmt::format("'{}' is not known; {}", call.name,
                     call.end > node + 1 ? "the union of its children is shown instead"
                                         : "nothing is shown for it"));
  }
  if (frame.kind == NodeKind::kLeaf) {
    leaf(node, frame.inside);
    const bool any = operands_.size() > frame.base;
    const Dimension dimension = !any                         ? Dimension::kNone
                                : operands_[frame.base].flat ? Dimension::kFlat
                                                             : Dimension::kSolid;
    return finish(node, frame.modifiers, frame.outside, frame.base, dimension);
  }
  if (call.name == "multmatrix" && !enter_transform(frame)) {
    return finish(node, frame.modifiers, frame.outside, frame.base, Dimension::kNone);
  }
  if (call.name == "color") enter_colour(frame);
  if (has_own_frame(frame.kind)) {
    frame.inside.outer = frame.outside.outer * frame.outside.world;
    frame.inside.world = glm::dmat4(1.0);
    frame.inside.plane = glm::dmat3(1.0);
    frame.inside.keep_flattened =
        frame.kind == NodeKind::kHull || frame.kind == NodeKind::kMinkowski;
  }
  frames_.push_back(std::move(frame));
}

/// @return whether the subtree is kept
bool Evaluator::enter_transform(Frame& frame) {
  std::string fault;
  const glm::dmat4 matrix = read_matrix(arguments(frame.node).find("m", 0), fault);
  const bool stays = is_finite(matrix);
  if (!fault.empty() || !stays) {
    warn(frame.node, "geometry",
         fmt::format("the matrix has {}; {}", fault.empty() ? "numbers that are not finite" : fault,
                     stays ? "using the identity's entry there" : "its children are left out"));
  }
  if (!stays) return false;
  Context& inside = frame.inside;
  inside.world = inside.world * matrix;
  const glm::dmat3 plane(matrix[0].x, matrix[0].y, 0.0, matrix[1].x, matrix[1].y, 0.0, matrix[3].x,
                         matrix[3].y, 1.0);
  inside.plane = inside.plane * plane;
  return true;
}

void Evaluator::enter_colour(Frame& frame) {
  double numbers[4] = {-1.0, -1.0, -1.0, 1.0};
  const NodeArguments given = arguments(frame.node);
  given.find("c", 0).numbers(numbers, 4);
  numbers[3] = given.find("alpha", 1).number(numbers[3]);
  const bool is_set = numbers[0] >= 0.0 && numbers[1] >= 0.0 && numbers[2] >= 0.0;
  std::optional<glm::vec4>& inside = frame.inside.colour;
  if (inside && inside->r >= 0.0f) return;  // the outermost colour wins
  glm::vec4 colour(kSchemeColour, 1.0f);
  for (int i = 0; i < 4; ++i) {
    if (numbers[i] >= 0.0 && (is_set || i == 3)) {
      colour[i] = static_cast<float>(std::min(numbers[i], 1.0));
    }
  }
  inside = colour;
  if (!is_set && colour.a == 1.0f) inside.reset();
}

void Evaluator::leave() {
  Frame frame = std::move(frames_.back());
  frames_.pop_back();
  if (frame.emptied && operands_.size() > frame.base) {
    show_highlights(frame.base, operands_.size(), frame.inside.outer);
    operands_.resize(frame.base);
    leftovers_ = true;
  }
  if (has_own_frame(frame.kind)) {
    show_highlights(frame.base, operands_.size(), frame.inside.outer);
    operate(frame);
  } else if (operands_.size() > frame.base) {
    combine(frame);
  }
  if (operands_.size() == frame.base) {
    frame.dimension = Dimension::kNone;
  } else {
    frame.dimension = operands_[frame.base].flat ? Dimension::kFlat : Dimension::kSolid;
  }
  finish(frame.node, frame.modifiers, frame.outside, frame.base, frame.dimension);
}

/// Combines the operands of a difference or an intersection. The operands of a union stay on the
/// stack.
void Evaluator::combine(Frame& frame) {
  if (frame.kind == NodeKind::kUnion) return;
  if (frame.dimension == Dimension::kFlat) return combine_flat(frame);
  const bool difference = frame.kind == NodeKind::kDifference;
  // As in OpenSCAD, a difference is highlighted if its first operand is, and an intersection if all
  // its operands are.
  std::size_t first_end = frame.base;
  while (first_end < operands_.size() &&
         (!difference || operands_[first_end].child == operands_[frame.base].child)) {
    ++first_end;
  }
  const bool highlighted = all_highlighted(frame.base, first_end);
  show_highlights(highlighted ? first_end : frame.base, operands_.size(), frame.inside.outer);
  std::vector<Tree::NodeId> operands, group;
  for (std::size_t i = frame.base; i < operands_.size();) {
    const std::uint32_t child = operands_[i].child;
    group.clear();
    for (; i < operands_.size() && operands_[i].child == child; ++i) {
      group.push_back(operands_[i].solid);
    }
    if (difference && !operands.empty()) {
      operands.insert(operands.end(), group.begin(), group.end());
    } else {
      operands.push_back(group.size() == 1 ? group[0] : scene_.tree.add(Operation::kUnion, group));
    }
  }
  Operand result;
  result.node = frame.node;
  result.highlight = highlighted ? ++highlights_ : 0;
  result.solid = operands.size() == 1 ? operands[0]
                                      : scene_.tree.add(difference ? Operation::kDifference
                                                                   : Operation::kIntersection,
                                                        operands);
  operands_.resize(frame.base);
  operands_.push_back(std::move(result));
}

void Evaluator::combine_flat(Frame& frame) {
  // The pieces of the first child keep their colours.
  std::size_t first_end = frame.base;
  while (first_end < operands_.size() &&
         operands_[first_end].child == operands_[frame.base].child) {
    ++first_end;
  }
  show_highlights(first_end, operands_.size(), frame.inside.outer);
  std::vector<Outline> regions{Outline{}};  // the piece, then the operands it is combined with
  if (frame.kind == NodeKind::kDifference) {
    for (std::size_t i = first_end; i < operands_.size(); ++i) {
      regions.push_back(std::move(operands_[i].outline));
    }
  } else {
    for (std::size_t i = first_end; i < operands_.size();) {
      std::vector<Outline> group;
      const std::uint32_t child = operands_[i].child;
      for (; i < operands_.size() && operands_[i].child == child; ++i) {
        group.push_back(std::move(operands_[i].outline));
      }
      regions.push_back(group.size() == 1 ? std::move(group[0]) : unite(group, &job_));
    }
  }
  operands_.resize(first_end);
  if (regions.size() == 1) return;
  if (frame.kind == NodeKind::kDifference && regions.size() > 2 && first_end > frame.base + 1) {
    Outline all = unite(std::span(regions).subspan(1), &job_);
    regions.resize(2);
    regions[1] = std::move(all);
  }
  for (std::size_t i = frame.base; i < first_end; ++i) {
    if (job_ended(frame.node)) return;
    regions[0] = std::move(operands_[i].outline);
    operands_[i].outline =
        frame.kind == NodeKind::kDifference ? subtract(regions, &job_) : intersect(regions, &job_);
  }
  if (job_ended(frame.node)) return;
  const auto from = operands_.begin() + static_cast<std::ptrdiff_t>(frame.base);
  operands_.erase(std::remove_if(from, operands_.end(),
                                 [](const Operand& operand) { return operand.outline.empty(); }),
                  operands_.end());
}

/// Completes a node: shows its ghosts and leaves its operands to the node around it.
void Evaluator::finish(std::uint32_t node, std::uint8_t modifiers, const Context& outside,
                       std::size_t base, Dimension dimension) {
  if (error_) return;
  if (modifiers & AstNode::kBackground) {
    if (dimension != Dimension::kNone) {
      scene_.backgrounds.push_back(ghost(base, operands_.size()));
    }
    operands_.resize(base);
    return;
  }
  if ((modifiers & AstNode::kHighlight) && !outside.highlighted && dimension != Dimension::kNone) {
    ++highlights_;
    for (std::size_t i = base; i < operands_.size(); ++i) operands_[i].highlight = highlights_;
  }
  take_child(frames_.back(), node, base, dimension);
}

void Evaluator::take_child(Frame& parent, std::uint32_t node, std::size_t base,
                           Dimension dimension) {
  if (dimension == Dimension::kNone) {
    parent.emptied |= parent.kind == NodeKind::kIntersection ||
                      (parent.kind == NodeKind::kDifference && parent.children == 0);
    ++parent.children;
    return;
  }
  if (parent.dimension != Dimension::kNone && parent.dimension != dimension) {
    const bool flat = dimension == Dimension::kFlat;
    const bool shown = show_beside(base);
    warn(node, "ignored",
         fmt::format("'{}' is {} but its siblings are {}; {}", name(node), flat ? "flat" : "solid",
                     flat ? "solid" : "flat",
                     shown ? "previews show it, but the result leaves it out" : "it is left out"));
    operands_.resize(base);
    leftovers_ = true;
    return;
  }
  parent.dimension = dimension;
  if (parent.kind != NodeKind::kUnion) {
    for (std::size_t i = base; i < operands_.size(); ++i) operands_[i].child = parent.children;
  }
  ++parent.children;
}

Tree::NodeId Evaluator::ghost(std::size_t begin, std::size_t end, bool placed) {
  std::vector<Tree::NodeId> nodes;
  for (std::size_t i = begin; i < end; ++i) {
    const Operand& operand = operands_[i];
    if (!operand.flat) {
      nodes.push_back(operand.solid);
      continue;
    }
    Solid solid;
    solid.mesh = std::make_shared<TriangleSoup>(make_slab(operand.outline, -0.5, 0.5, &job_));
    if (placed) solid.world_from_mesh = operand.place;
    solid.colour = operand.colour;
    solid.name = fmt::format("{} at {}", name(operand.node), place(operand.node));
    nodes.push_back(scene_.tree.add_solid(std::move(solid)));
  }
  leftovers_ = true;
  return nodes.size() == 1 ? nodes[0] : scene_.tree.add(Operation::kUnion, nodes);
}

bool Evaluator::all_highlighted(std::size_t begin, std::size_t end) const {
  return begin < end && std::all_of(operands_.begin() + static_cast<std::ptrdiff_t>(begin),
                                    operands_.begin() + static_cast<std::ptrdiff_t>(end),
                                    [](const Operand& one) { return one.highlight != 0; });
}

void Evaluator::show_highlights(std::size_t begin, std::size_t end, const glm::dmat4& outer) {
  for (std::size_t i = begin; i < end;) {
    const std::uint32_t highlight = operands_[i].highlight;
    std::size_t next = i;
    for (; next < end && operands_[next].highlight == highlight; ++next) {
    }
    if (highlight != 0) {
      const Tree::NodeId shown = ghost(i, next);
      scene_.highlights.push_back(scene_.tree.append(scene_.tree, shown, outer));
    }
    for (; i < next; ++i) operands_[i].highlight = 0;
  }
}

bool Evaluator::show_beside(std::size_t base) {
  const std::size_t end = operands_.size();
  const bool at_top = std::all_of(frames_.begin(), frames_.end(), [](const Frame& frame) {
    return frame.kind == NodeKind::kUnion && !(frame.modifiers & AstNode::kBackground);
  });
  if (!at_top) return false;
  if (all_highlighted(base, end)) {
    show_highlights(base, end, glm::dmat4(1.0));
  } else {
    beside_.push_back(ghost(base, end, true));
  }
  return true;
}

/// Turns the flat operands from `base` on into slabs, one for each colour.
void Evaluator::make_slabs(std::size_t base) {
  std::vector<Operand> slabs;
  std::vector<bool> done(operands_.size(), false);
  for (std::size_t i = base; i < operands_.size(); ++i) {
    if (done[i]) continue;
    std::vector<Outline> pieces;
    for (std::size_t j = i; j < operands_.size(); ++j) {
      if (done[j] || !same_colour(operands_[j].colour, operands_[i].colour) ||
          operands_[j].highlight != operands_[i].highlight) {
        continue;
      }
      done[j] = true;
      pieces.push_back(std::move(operands_[j].outline));
    }
    const Outline region = pieces.size() == 1 ? std::move(pieces[0]) : unite(pieces, &job_);
    Solid solid;
    solid.mesh = std::make_shared<TriangleSoup>(make_slab(region, -0.5, 0.5, &job_));
    if (job_ended(operands_[i].node)) return;
    solid.colour = operands_[i].colour;
    solid.name = fmt::format("{} at {}", name(operands_[i].node), place(operands_[i].node));
    Operand slab;
    slab.node = operands_[i].node;
    slab.highlight = operands_[i].highlight;
    slab.solid = scene_.tree.add_solid(std::move(solid));
    slabs.push_back(std::move(slab));
  }
  operands_.resize(base);
  for (Operand& slab : slabs) operands_.push_back(std::move(slab));
}

/// Removes nodes from the tree that were only used to compute hulls and similar operations.
void Evaluator::drop_leftovers() {
  std::vector<Tree::NodeId> kept{scene_.tree.root()};
  kept.insert(kept.end(), scene_.backgrounds.begin(), scene_.backgrounds.end());
  kept.insert(kept.end(), scene_.highlights.begin(), scene_.highlights.end());
  kept.insert(kept.end(), beside_.begin(), beside_.end());
  Tree tree;
  kept = tree.append(scene_.tree, kept);
  tree.set_root(kept[0]);
  const auto ghosts = kept.begin() + 1;
  const auto backgrounds = static_cast<std::ptrdiff_t>(scene_.backgrounds.size());
  scene_.backgrounds.assign(ghosts, ghosts + backgrounds);
  const auto beside = kept.end() - static_cast<std::ptrdiff_t>(beside_.size());
  scene_.highlights.assign(ghosts + backgrounds, beside);
  beside_.assign(beside, kept.end());
  scene_.tree = std::move(tree);
}

Scene Evaluator::take_scene() {
  const bool placed = !beside_.empty() && !operands_.empty() && operands_[0].flat;
  if (!operands_.empty() && operands_[0].flat) {
    scene_.flat = true;
    // Beside solids, flat operands are shown where their transforms in space put them.
    for (std::size_t i = 0; i < operands_.size() && placed; ++i) {
      if (operands_[i].highlight == 0) beside_.push_back(ghost(i, i + 1, true));
    }
    make_slabs(0);
  }
  std::vector<Tree::NodeId> roots;
  std::vector<bool> is_ghost;  // highlighted parts of the scene are drawn as ghosts
  for (const Operand& operand : operands_) {
    roots.push_back(operand.solid);
    is_ghost.push_back(operand.highlight != 0);
  }
  const bool all_ghosts = all_highlighted(0, operands_.size()) && beside_.empty();
  const bool any_ghost = std::find(is_ghost.begin(), is_ghost.end(), true) != is_ghost.end();
  show_highlights(0, operands_.size(), glm::dmat4(1.0));
  const Tree::NodeId root =
      roots.size() == 1 ? roots[0] : scene_.tree.add(Operation::kUnion, roots);
  scene_.tree.set_root(root);
  if (leftovers_) drop_leftovers();
  if (!beside_.empty() || (any_ghost && !all_ghosts)) {
    std::vector<Tree::NodeId>& shown = scene_.shown;
    const auto parts = roots.size() == 1 ? std::span<const Tree::NodeId>()
                                         : scene_.tree.operands(scene_.tree.root());
    for (std::size_t i = 0; i < roots.size(); ++i) {
      if (!is_ghost[i] && !placed) shown.push_back(parts.empty() ? scene_.tree.root() : parts[i]);
    }
    shown.insert(shown.end(), beside_.begin(), beside_.end());
  }
  if (warnings_left_out_ > 0) {
    scene_.warnings.push_back(
        {"ignored", fmt::format("{}: {} more warnings", ast_.name, warnings_left_out_)});
  }
  return std::move(scene_);
}

}  // namespace strata::csg
