#include "csg/surface/tile_program.h"

#include <algorithm>

namespace strata::csg {

Simplifier::Simplifier(const Program& program) : program_(&program), seen_(program.nodes.size()) {}

void Simplifier::simplify(std::span<const LeafLayers> leaves,
                          std::span<const std::uint32_t> present, TileProgram& out) {
  out.edges.clear();
  out.nearest.clear();
  out.nodes.clear();
  out.leaves.clear();
  out_true_outside_.clear();
  out_depth_.clear();
  out.constant = true;
  out.value = program_->value_when_outside();
  out.depth = 0;
  if (program_->nodes.empty()) return;
  mark(leaves, present);
  const auto root = static_cast<std::uint32_t>(program_->nodes.size() - 1);
  if (marked_.empty() || seen_[root].stamp != stamp_) return;
  std::sort(marked_.begin(), marked_.end());  // children before parents
  for (const std::uint32_t id : marked_) {
    Seen& seen = seen_[id];
    seen.inverted = false;
    if (gather(id, leaves, out)) {
      seen.kind = Seen::Kind::kTrue;
    } else if (gathered_.empty()) {
      seen.kind = Seen::Kind::kFalse;
    } else if (gathered_.size() == 1) {
      const Program::Edge edge = gathered_.front().edge;
      seen.inverted = edge.inverted();
      seen.kind = edge.leaf() ? Seen::Kind::kLeaf : Seen::Kind::kNode;
      (edge.leaf() ? seen.leaf : seen.out) = edge.child();
    } else {
      seen.kind = Seen::Kind::kNode;
      seen.out = add_node(leaves, out);
    }
  }
  set_root(seen_[root], leaves, out);
}

void Simplifier::mark(std::span<const LeafLayers> leaves, std::span<const std::uint32_t> present) {
  ++stamp_;
  marked_.clear();
  children_.clear();
  for (const std::uint32_t slot : present) {
    Program::Up up = program_->leaves[leaves[slot].solid];
    std::uint32_t id = slot;
    bool leaf = true;
    while (up.parent != Program::kNone) {
      Seen& seen = seen_[up.parent];
      const bool known = seen.stamp == stamp_;
      if (!known) {
        seen.stamp = stamp_;
        seen.first_child = Program::kNone;
        marked_.push_back(up.parent);
      }
      children_.push_back({id, leaf, up.inverted, seen.first_child});
      seen.first_child = static_cast<std::uint32_t>(children_.size() - 1);
      if (known) break;
      id = up.parent;
      leaf = false;
      up = program_->nodes[id].up;
    }
  }
}

bool Simplifier::gather(std::uint32_t node, std::span<const LeafLayers> leaves,
                        const TileProgram& out) {
  std::uint32_t absent_true = program_->nodes[node].true_when_outside;
  gathered_.clear();
  bool is_true = false;
  for (std::uint32_t c = seen_[node].first_child; c != Program::kNone; c = children_[c].next) {
    const Child& child = children_[c];
    const bool true_outside = !child.leaf && program_->true_when_outside(child.id);
    absent_true -= true_outside != child.inverted ? 1 : 0;
    if (gather_child(child, leaves, out)) is_true = true;
  }
  return is_true || absent_true > 0;
}

bool Simplifier::gather_child(const Child& child, std::span<const LeafLayers> leaves,
                              const TileProgram& out) {
  if (child.leaf) {
    const std::uint32_t nearest = child.inverted ? 0 : leaves[child.id].nearest;
    gathered_.push_back({Program::Edge(child.id, true, child.inverted), nearest});
    return false;
  }
  const Seen& below = seen_[child.id];
  const bool inverted = child.inverted != below.inverted;
  switch (below.kind) {
    case Seen::Kind::kTrue:
      return !inverted;
    case Seen::Kind::kFalse:
      return inverted;
    case Seen::Kind::kLeaf: {
      const std::uint32_t nearest = inverted ? 0 : leaves[below.leaf].nearest;
      gathered_.push_back({Program::Edge(below.leaf, true, inverted), nearest});
      return false;
    }
    case Seen::Kind::kNode:
      break;
  }
  const TileProgram::Node& node = out.nodes[below.out];
  if (inverted) {
    const std::uint32_t nearest = out_true_outside_[below.out] != 0 ? node.nearest : 0;
    gathered_.push_back({Program::Edge(below.out, false, true), nearest});
  } else {  // a union in a union
    for (std::uint32_t e = node.first; e < node.first + node.count; ++e) {
      gathered_.push_back({out.edges[e], out.nearest[e]});
    }
  }
  return false;
}

std::uint32_t Simplifier::add_node(std::span<const LeafLayers> leaves, TileProgram& out) {
  std::sort(gathered_.begin(), gathered_.end(), [](const Sorted& a, const Sorted& b) {
    return a.nearest != b.nearest ? a.nearest < b.nearest : a.edge.bits < b.edge.bits;
  });
  TileProgram::Node node{static_cast<std::uint32_t>(out.edges.size()),
                         static_cast<std::uint32_t>(gathered_.size()), 0xffffffffu};
  bool true_outside = false;
  int depth = 0;
  for (const Sorted& sorted : gathered_) {
    out.edges.push_back(sorted.edge);
    out.nearest.push_back(sorted.nearest);
    const std::uint32_t child = sorted.edge.child();
    node.nearest = std::min(node.nearest,
                            sorted.edge.leaf() ? leaves[child].nearest : out.nodes[child].nearest);
    if (sorted.edge.leaf()) {
      true_outside = true_outside || sorted.edge.inverted();
    } else {
      true_outside = true_outside || (out_true_outside_[child] != 0) != sorted.edge.inverted();
      depth = std::max<int>(depth, out_depth_[child]);
    }
  }
  out.nodes.push_back(node);
  out_true_outside_.push_back(true_outside ? 1 : 0);
  out_depth_.push_back(static_cast<std::uint8_t>(std::min(255, depth + 1)));
  return static_cast<std::uint32_t>(out.nodes.size() - 1);
}

void Simplifier::set_root(const Seen& top, std::span<const LeafLayers> leaves, TileProgram& out) {
  if (top.kind == Seen::Kind::kTrue || top.kind == Seen::Kind::kFalse) {
    out.value = (top.kind == Seen::Kind::kTrue) != top.inverted;
    return;
  }
  out.constant = false;
  out.root_inverted = top.inverted;
  if (top.kind == Seen::Kind::kLeaf) {
    out.root = static_cast<std::uint32_t>(out.nodes.size());
    out.nodes.push_back(
        {static_cast<std::uint32_t>(out.edges.size()), 1, leaves[top.leaf].nearest});
    out.edges.emplace_back(top.leaf, true, false);
    out.nearest.push_back(leaves[top.leaf].nearest);
    out.leaves.push_back(top.leaf);
    out.depth = 1;
    return;
  }
  out.root = top.out;
  out.depth = out_depth_[top.out];
  stack_.assign(1, top.out);
  while (!stack_.empty()) {
    const TileProgram::Node& node = out.nodes[stack_.back()];
    stack_.pop_back();
    for (std::uint32_t e = node.first; e < node.first + node.count; ++e) {
      const Program::Edge edge = out.edges[e];
      (edge.leaf() ? out.leaves : stack_).push_back(edge.child());
    }
  }
}

}  // namespace strata::csg
