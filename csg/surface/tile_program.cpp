#include <algorithm>

#include "csg/surface/tile_surface.h"

namespace strata::csg {

Simplifier::Simplifier(const Program& program) : program_(&program), seen_(program.nodes.size()) {}

void Simplifier::simplify(std::span<const LeafLayers> leaves,
                          std::span<const std::uint32_t> present, TileProgram& out) {
  out.edges.clear();
  out.nearest.clear();
  out.nodes.clear();
  out.leaves.clear();
  out_idle_.clear();
  out_depth_.clear();
  out.constant = true;
  out.value = program_->idle_value();
  out.depth = 0;
  if (program_->nodes.empty()) return;

  // Marks what is above the leaves present, and lists the marked children of each node.
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
  const auto root = static_cast<std::uint32_t>(program_->nodes.size() - 1);
  if (marked_.empty() || seen_[root].stamp != stamp_) return;
  std::sort(marked_.begin(), marked_.end());

  for (const std::uint32_t id : marked_) {
    Seen& seen = seen_[id];
    seen.inverted = false;
    std::uint32_t absent_true = program_->nodes[id].idle_true;
    gathered_.clear();
    bool is_true = false;
    for (std::uint32_t c = seen.first_child; c != Program::kNone; c = children_[c].next) {
      const Child& child = children_[c];
      const bool idle = !child.leaf && program_->idle(child.id);
      absent_true -= idle != child.inverted ? 1 : 0;
      if (child.leaf) {
        const std::uint32_t nearest = child.inverted ? 0 : leaves[child.id].nearest;
        gathered_.push_back({Program::Edge(child.id, true, child.inverted), nearest});
        continue;
      }
      const Seen& below = seen_[child.id];
      const bool inverted = child.inverted != below.inverted;
      switch (below.kind) {
        case Seen::Kind::kTrue:
          is_true = is_true || !inverted;
          break;
        case Seen::Kind::kFalse:
          is_true = is_true || inverted;
          break;
        case Seen::Kind::kLeaf: {
          const std::uint32_t nearest = inverted ? 0 : leaves[below.leaf].nearest;
          gathered_.push_back({Program::Edge(below.leaf, true, inverted), nearest});
          break;
        }
        case Seen::Kind::kNode: {
          const TileProgram::Node& node = out.nodes[below.out];
          if (inverted) {
            const std::uint32_t nearest = out_idle_[below.out] != 0 ? node.nearest : 0;
            gathered_.push_back({Program::Edge(below.out, false, true), nearest});
          } else {  // a union in a union
            for (std::uint32_t e = node.first; e < node.first + node.count; ++e) {
              gathered_.push_back({out.edges[e], out.nearest[e]});
            }
          }
        }
      }
    }
    if (is_true || absent_true > 0) {
      seen.kind = Seen::Kind::kTrue;
    } else if (gathered_.empty()) {
      seen.kind = Seen::Kind::kFalse;
    } else if (gathered_.size() == 1) {
      const Program::Edge edge = gathered_.front().edge;
      seen.inverted = edge.inverted();
      seen.kind = edge.leaf() ? Seen::Kind::kLeaf : Seen::Kind::kNode;
      (edge.leaf() ? seen.leaf : seen.out) = edge.child();
    } else {
      std::sort(gathered_.begin(), gathered_.end(), [](const Sorted& a, const Sorted& b) {
        return a.nearest != b.nearest ? a.nearest < b.nearest : a.edge.bits < b.edge.bits;
      });
      seen.kind = Seen::Kind::kNode;
      seen.out = static_cast<std::uint32_t>(out.nodes.size());
      TileProgram::Node node{static_cast<std::uint32_t>(out.edges.size()),
                             static_cast<std::uint32_t>(gathered_.size()), 0xffffffffu};
      bool idle = false;
      int depth = 0;
      for (const Sorted& sorted : gathered_) {
        out.edges.push_back(sorted.edge);
        out.nearest.push_back(sorted.nearest);
        const std::uint32_t child = sorted.edge.child();
        node.nearest = std::min(
            node.nearest, sorted.edge.leaf() ? leaves[child].nearest : out.nodes[child].nearest);
        if (sorted.edge.leaf()) {
          idle = idle || sorted.edge.inverted();
        } else {
          idle = idle || (out_idle_[child] != 0) != sorted.edge.inverted();
          depth = std::max<int>(depth, out_depth_[child]);
        }
      }
      out.nodes.push_back(node);
      out_idle_.push_back(idle ? 1 : 0);
      out_depth_.push_back(static_cast<std::uint8_t>(std::min(255, depth + 1)));
    }
  }

  const Seen& top = seen_[root];
  const bool inverted = top.inverted;
  if (top.kind == Seen::Kind::kTrue || top.kind == Seen::Kind::kFalse) {
    out.value = (top.kind == Seen::Kind::kTrue) != inverted;
    return;
  }
  out.constant = false;
  out.root_inverted = inverted;
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
