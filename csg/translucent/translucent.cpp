#include "csg/translucent/translucent.h"

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>
#include <utility>

namespace strata::csg {
namespace {

/// std::stable_sort() without the memory that it asks for at each call: rays cross few faces, and
/// most lists are in order.
template <class T, class Less>
void sort_few(std::vector<T>& items, Less&& less) {
  constexpr std::size_t kFew = 32;
  if (std::is_sorted(items.begin(), items.end(), less)) return;
  if (items.size() > kFew) return std::stable_sort(items.begin(), items.end(), less);
  for (auto item = items.begin(); item != items.end(); ++item) {
    std::rotate(std::upper_bound(items.begin(), item, *item, less), item, item + 1);
  }
}

/// Whether all solids below each node have an alpha below 1 (false for none). What is taken away
/// does not count: its faces have their own colours.
std::vector<std::uint8_t> translucent_nodes(const Tree& tree) {
  std::vector<std::uint8_t> result(tree.nodes().size(), 0);
  for (Tree::NodeId id = 0; id < result.size(); ++id) {
    const Tree::Node& node = tree.nodes()[id];
    if (node.operation == Operation::kSolid) {
      const auto& colour = tree.solids()[node.first].colour;
      result[id] = colour && colour->a < 1.0f ? 1 : 0;
      continue;
    }
    auto operands = tree.operands(id);
    if (node.operation == Operation::kDifference) {
      operands = operands.first(std::min<std::size_t>(1, operands.size()));
    }
    result[id] = !operands.empty() && std::all_of(operands.begin(), operands.end(),
                                                  [&](Tree::NodeId o) { return result[o] != 0; })
                     ? 1
                     : 0;
  }
  return result;
}

/// The tree below `node` alone: its solids, without meshes, in the order of `solids`.
Tree subtree(const Tree& tree, Tree::NodeId root, std::vector<std::uint32_t>& solids) {
  std::vector<Tree::NodeId> order{root};  // parents before operands
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (tree.nodes()[order[i]].operation == Operation::kSolid) continue;
    const auto operands = tree.operands(order[i]);
    order.insert(order.end(), operands.begin(), operands.end());
  }
  Tree out;
  std::vector<Tree::NodeId> made(order.size()), operands;
  // Operands of order[i] stand one after another, after those of all earlier nodes.
  std::size_t next = order.size();
  for (std::size_t i = order.size(); i-- > 0;) {
    const Tree::Node& node = tree.nodes()[order[i]];
    if (node.operation == Operation::kSolid) {
      made[i] = out.add_solid({});
      solids.push_back(node.first);
      continue;
    }
    next -= node.count;
    operands.assign(made.begin() + static_cast<std::ptrdiff_t>(next),
                    made.begin() + static_cast<std::ptrdiff_t>(next + node.count));
    made[i] = out.add(node.operation, operands);
  }
  out.set_root(made.front());
  return out;
}

}  // namespace

Tree::NodeId take_translucent(Tree& tree, std::vector<Translucent>& out) {
  const Tree::NodeId root = tree.root();
  if (root == Tree::kNone) return root;
  const std::vector<std::uint8_t> translucent = translucent_nodes(tree);
  if (std::find(translucent.begin(), translucent.end(), 1) == translucent.end()) return root;
  // Down the unions; what they unite stays or goes as a whole.
  std::vector<Tree::NodeId> stack{root}, kept;
  const std::size_t before = out.size();
  while (!stack.empty()) {
    const Tree::NodeId id = stack.back();
    stack.pop_back();
    if (tree.nodes()[id].operation == Operation::kUnion) {
      const auto operands = tree.operands(id);
      stack.insert(stack.end(), operands.rbegin(), operands.rend());
    } else if (translucent[id] != 0) {
      out.push_back({id, {}});
    } else {
      kept.push_back(id);
    }
  }
  return out.size() == before ? root : tree.add(Operation::kUnion, kept);
}

TranslucentTrees::TranslucentTrees(const Tree& tree, std::span<const Translucent> translucent,
                                   const Geometry& geometry, double world_error)
    : geometry_(&geometry), world_error_(world_error) {
  for (const Translucent& one : translucent) {
    if (one.node == Tree::kNone) continue;
    std::vector<std::uint32_t> solids;
    const Tree part = subtree(tree, one.node, solids);
    for (std::uint32_t leaf = 0; leaf < solids.size(); ++leaf) {
      slots_.push_back({static_cast<std::uint32_t>(parts_.size()), solids[leaf], leaf});
    }
    parts_.push_back({compile(part, part.root()), one.colour});
  }
}

Result<TranslucentView> TranslucentView::make(const TranslucentTrees& trees, const View& view,
                                              const Execution& execution) {
  TranslucentView seen;
  const auto slots = trees.slots();
  seen.parts.resize(slots.size());
  std::vector<Result<void>> failures(slots.size());
  parallel_for(execution, slots.size(), [&](std::size_t i, int) {
    Execution alone;
    alone.threads = 1;
    auto part = view_part(trees.solid_of(slots[i]).placed(), view, alone);
    if (part) {
      seen.parts[i] = std::move(*part);
    } else {
      failures[i] = tl::unexpected(part.error());
    }
  });
  for (const auto& failure : failures) {
    if (!failure) return tl::unexpected(failure.error());
  }
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  std::size_t vertices = 0, triangles = 0;
  for (const ViewPart& part : seen.parts) {
    vertices += part.mesh.vertices.size(), triangles += part.mesh.triangles.size();
  }
  if (vertices > 0xffffffffu || triangles > 0x7fffffffu) {
    return fail(ErrorCode::kLimit, "{} triangles are transparent; the limit is {}", triangles,
                0x7fffffffu);
  }
  seen.slot_of.reserve(triangles);
  for (std::uint32_t i = 0; i < slots.size(); ++i) {
    seen.first_triangles.push_back(static_cast<std::uint32_t>(seen.slot_of.size()));
    seen.slot_of.resize(seen.slot_of.size() + seen.parts[i].mesh.triangles.size(), i);
  }
  return seen;
}

TranslucentView::Mesh TranslucentView::joined() const {
  Mesh all;
  std::size_t vertices = 0;
  for (const ViewPart& part : parts) vertices += part.mesh.vertices.size();
  all.mesh.vertices.reserve(vertices);
  all.triangles.reserve(slot_of.size());
  for (const ViewPart& part : parts) {
    const LatticeMesh& mesh = part.mesh;
    const auto first = static_cast<std::uint32_t>(all.mesh.vertices.size());
    all.mesh.vertices.insert(all.mesh.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (const glm::uvec3& triangle : mesh.triangles) all.triangles.push_back(triangle + first);
  }
  all.mesh.triangles = all.triangles;
  return all;
}

TranslucentWalk::TranslucentWalk(const TranslucentTrees& trees, const TranslucentView& seen,
                                 const View& view)
    : trees_(&trees), seen_(&seen), states_(trees.parts().size()) {
  // Depth steps of a tenth of a pixel and of the scene's own error: thinner is nothing.
  const glm::dmat4 image_from_eye = view.image_from_world * glm::inverse(view.eye_from_world);
  const double pixels = std::max(std::abs(image_from_eye[0][0]), std::abs(image_from_eye[1][1]));
  double steps = 0.0;
  if (view.perspective) {
    const double difference = 1.0 / view.near - 1.0 / view.far;
    steps = kPictureDepthLimit / difference;
    a_ = 1.0 / view.near, b_ = difference / kPictureDepthLimit;
  } else {
    steps = kPictureDepthLimit / (view.far - view.near);
  }
  pixel_ = steps * 0.1 / pixels;
  flat_ = steps * trees.world_error();
}

std::span<const TranslucentWalk::Fragment> TranslucentWalk::surfaces(
    std::span<const DepthItem> items) {
  fragments_.clear();
  sorted_.assign(items.begin(), items.end());
  sort_few(sorted_, [this](DepthItem a, DepthItem b) { return seen_->slot(a) < seen_->slot(b); });
  const auto slots = trees_->slots();
  for (std::size_t i = 0; i < sorted_.size();) {
    const std::uint32_t part = slots[seen_->slot(sorted_[i])].part;
    transitions_.clear();
    while (i < sorted_.size() && slots[seen_->slot(sorted_[i])].part == part) {
      const std::size_t begin = i;
      const std::uint32_t at = seen_->slot(sorted_[begin]);
      while (i < sorted_.size() && seen_->slot(sorted_[i]) == at) ++i;
      transitions_of(std::span(sorted_).subspan(begin, i - begin), slots[at].leaf,
                     trees_->solid_of(slots[at]).rule, seen_->parts[at].cut, transitions_);
    }
    walk(part);
  }
  sort_few(fragments_, [](const Fragment& a, const Fragment& b) { return a.depth < b.depth; });
  std::erase_if(fragments_, [](const Fragment& f) { return f.triangle == Transition::kNone; });
  return fragments_;
}

/// The surfaces of one tree, from its transitions.
void TranslucentWalk::walk(std::uint32_t part) {
  sort_few(transitions_,
           [](const Transition& a, const Transition& b) { return a.depth < b.depth; });
  const Program& program = trees_->parts()[part].program;
  if (!states_[part]) states_[part] = std::make_unique<ProgramState>(program);
  ProgramState& state = *states_[part];
  const std::size_t first = fragments_.size();
  bool value = state.value();
  for (std::size_t i = 0; i < transitions_.size();) {
    const std::size_t begin = i;
    std::size_t shown = begin;
    for (; i < transitions_.size() && transitions_[i].depth == transitions_[begin].depth; ++i) {
      const bool before = state.value();
      state.toggle(transitions_[i].solid);
      if (state.value() != before) shown = i;
    }
    if (state.value() == value) continue;
    value = !value;
    const Transition& transition = transitions_[shown];
    // Faces that coincide leave slivers and gaps that are none.
    if (fragments_.size() > first && fragments_.back().solid != transition.solid &&
        transition.depth - fragments_.back().depth <= slack(transition.depth)) {
      fragments_.pop_back();
      continue;
    }
    fragments_.push_back(
        {transition.depth, part, transition.solid, transition.triangle, transition.exit});
  }
  for (const Transition& transition : transitions_)
    state.toggle(transition.solid);  // an even number of each or all of them
  if (state.value() != program.value_when_outside()) states_[part].reset();
}

}  // namespace strata::csg
