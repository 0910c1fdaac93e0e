#include "strata/csg/tree.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <queue>

#include "strata/mesh/diagnose.h"

// active_boxes() computes the S-bounds of S. Cameron, "Efficient intersection tests for objects
// defined constructively" (1989) as axis-parallel boxes, and with them boxes around the active
// zones of J. R. Rossignac and H. B. Voelcker, "Active zones in CSG for accelerating boundary
// evaluation, redundancy elimination, interference detection, and shading algorithms" (1989). We
// differ: one pass up and one pass down, not repeated until nothing shrinks; and a difference
// shrinks the box of its first operand where vast boxes are subtracted from vast boxes.

namespace strata::csg {

Tree::Tree(Solid solid) : root_(0) { add_solid(std::move(solid)); }

Tree::Tree(TriangleSoup mesh)
    : Tree(Solid{std::make_shared<const TriangleSoup>(std::move(mesh))}) {}

Tree::NodeId Tree::add_solid(Solid solid) {
  nodes_.push_back({Operation::kSolid, static_cast<std::uint32_t>(solids_.size()), 0});
  solids_.push_back(std::move(solid));
  return static_cast<NodeId>(nodes_.size() - 1);
}

Tree::NodeId Tree::add(Operation operation, std::span<const NodeId> operands) {
  nodes_.push_back({operation, static_cast<std::uint32_t>(operands_.size()),
                    static_cast<std::uint32_t>(operands.size())});
  operands_.insert(operands_.end(), operands.begin(), operands.end());
  return static_cast<NodeId>(nodes_.size() - 1);
}

Tree::NodeId Tree::add(Operation operation, std::initializer_list<NodeId> operands) {
  return add(operation, std::span(operands.begin(), operands.size()));
}

std::vector<Tree::NodeId> Tree::append(const Tree& from, std::span<const NodeId> nodes,
                                       const glm::dmat4& target_from_source) {
  // The nodes to copy, largest id first, so that each is met after all nodes that take it.
  std::priority_queue<NodeId> queue(nodes.begin(), nodes.end());
  std::vector<NodeId> sources;
  while (!queue.empty()) {
    const NodeId id = queue.top();
    queue.pop();
    if (!sources.empty() && sources.back() == id) continue;
    sources.push_back(id);
    if (from.nodes_[id].operation == Operation::kSolid) continue;
    for (const NodeId operand : from.operands(id)) queue.push(operand);
  }
  std::reverse(sources.begin(), sources.end());
  std::vector<NodeId> copies;
  const auto copy_of = [&](NodeId id) {
    const auto at = std::lower_bound(sources.begin(), sources.end(), id);
    return copies[static_cast<std::size_t>(at - sources.begin())];
  };
  const bool moves = target_from_source != glm::dmat4(1.0);
  std::vector<NodeId> operands;
  for (const NodeId id : sources) {
    const Node node = from.nodes_[id];  // by value: `from` may be this tree, which grows
    if (node.operation == Operation::kSolid) {
      Solid solid = from.solids_[node.first];
      if (moves) solid.world_from_mesh = target_from_source * solid.world_from_mesh;
      copies.push_back(add_solid(std::move(solid)));
      continue;
    }
    operands.clear();
    for (const NodeId operand : from.operands(id)) operands.push_back(copy_of(operand));
    copies.push_back(add(node.operation, operands));
  }
  std::vector<NodeId> result;
  for (const NodeId node : nodes) result.push_back(copy_of(node));
  return result;
}

Tree::NodeId Tree::append(const Tree& from, NodeId node, const glm::dmat4& target_from_source) {
  return append(from, std::span(&node, 1), target_from_source)[0];
}

Tree& Tree::combine(Operation operation, const Tree& other) {
  const auto or_empty = [this](NodeId node) {
    return node == kNone ? add(Operation::kUnion, {}) : node;
  };
  const NodeId first = or_empty(root_);
  const NodeId second = or_empty(other.root_ == kNone ? kNone : append(other, other.root_));
  root_ = add(operation, {first, second});
  return *this;
}

Tree transform(const glm::dmat4& target_from_source, Tree tree) {
  for (Solid& solid : tree.solids()) {
    solid.world_from_mesh = target_from_source * solid.world_from_mesh;
  }
  return tree;
}

Result<void> check_tree(const Tree& tree, Tree::NodeId root) {
  if (root == Tree::kNone) return {};
  const std::size_t count = tree.nodes().size();
  if (root >= count) {
    return fail(ErrorCode::kUsage, "node {} is unknown; the tree has {} nodes", root, count);
  }
  std::vector<Tree::NodeId> parents(count, Tree::kNone);
  parents[root] = root;
  std::vector<Tree::NodeId> stack{root};
  while (!stack.empty()) {
    const Tree::NodeId id = stack.back();
    stack.pop_back();
    if (tree.nodes()[id].operation == Operation::kSolid) continue;
    for (const Tree::NodeId operand : tree.operands(id)) {
      if (operand >= id) {
        return fail(ErrorCode::kUsage,
                    "node {} uses node {}; operands must be added before the node that uses them",
                    id, operand);
      }
      if (parents[operand] != Tree::kNone) {
        return fail(ErrorCode::kUsage,
                    "node {} is an operand twice, of node {} and of node {}; append() copies it",
                    operand, parents[operand], id);
      }
      parents[operand] = id;
      stack.push_back(operand);
    }
  }
  return {};
}

Bounds bounds(const Solid& solid) {
  Bounds box;
  if (!solid.mesh) return box;
  const std::vector<glm::dvec3>& positions = solid.mesh->positions;
  for (const glm::uvec3& triangle : solid.mesh->triangles) {
    for (int i = 0; i < 3; ++i) {
      box.include(glm::dvec3(solid.world_from_mesh * glm::dvec4(positions[triangle[i]], 1.0)));
    }
  }
  return box;
}

Bounds bounds(const Tree& tree, Tree::NodeId node) {
  std::vector<Bounds> solids;
  for (const Solid& solid : tree.solids()) solids.push_back(bounds(solid));
  return bounds(tree, node, solids);
}

Bounds bounds(const Tree& tree) { return bounds(tree, tree.root()); }

namespace {

bool is_empty(const Bounds& box) {
  return box.empty() || box.low.y > box.high.y || box.low.z > box.high.z;
}

/// Whether a node is a closed mesh of a box whose sides are parallel to the axes: all of `box`.
bool fills_box(const Tree& tree, Tree::NodeId node, const Bounds& box) {
  if (tree.nodes()[node].operation != Operation::kSolid) return false;
  const Solid& solid = tree.solids()[tree.nodes()[node].first];
  if (!solid.mesh || solid.mesh->positions.size() != 8 || solid.mesh->triangles.size() != 12) {
    return false;
  }
  unsigned corners = 0;
  for (const glm::dvec3& position : solid.mesh->positions) {
    const glm::dvec3 p(solid.world_from_mesh * glm::dvec4(position, 1.0));
    unsigned corner = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (p[axis] != box.low[axis] && p[axis] != box.high[axis]) return false;
      corner |= p[axis] == box.high[axis] ? 1u << axis : 0u;
    }
    corners |= 1u << corner;
  }
  return corners == 0xffu && is_closed(*solid.mesh);
}

/// Takes `cutter` away from `box`, where what is left is a box.
void take_away(Bounds& box, const Bounds& cutter) {
  int axis = -1;  // along which the cutter does not reach from end to end
  for (int i = 0; i < 3; ++i) {
    if (cutter.low[i] <= box.low[i] && box.high[i] <= cutter.high[i]) continue;
    if (axis >= 0) return;
    axis = i;
  }
  if (axis < 0) {
    box = {};
  } else if (cutter.low[axis] <= box.low[axis]) {
    box.low[axis] = std::max(box.low[axis], cutter.high[axis]);
  } else if (cutter.high[axis] >= box.high[axis]) {
    box.high[axis] = std::min(box.high[axis], cutter.low[axis]);
  }
}

/// What the cutters for which `is_box` leave of `box`.
template <class IsBox>
Bounds left_of(const Bounds& box, std::span<const Tree::NodeId> cutters,
               std::span<const Bounds> boxes, const IsBox& is_box) {
  Bounds left = box;
  for (int round = 0; round < 6; ++round) {  // each cut may let another one reach from end to end
    const Bounds before = left;
    for (const Tree::NodeId cutter : cutters) {
      Bounds cut = left;
      take_away(cut, boxes[cutter]);
      if (!(cut == left) && is_box(cutter)) left = cut;
      if (is_empty(left)) return {};
    }
    if (left == before) break;
  }
  return left;
}

Bounds difference_bounds(const Tree& tree, std::span<const Tree::NodeId> operands,
                         std::span<const Bounds> boxes) {
  const Bounds& whole = boxes[operands[0]];
  const auto is_vast = [&](const Bounds& left) {
    return is_empty(left) || whole.longest_side() > kVast * left.longest_side();
  };
  const auto cutters = operands.subspan(1);
  if (!is_vast(left_of(whole, cutters, boxes, [](Tree::NodeId) { return true; }))) return whole;
  const Bounds left = left_of(whole, cutters, boxes, [&](Tree::NodeId cutter) {
    return fills_box(tree, cutter, boxes[cutter]);
  });
  return is_vast(left) && !is_empty(left) ? left : whole;
}

/// The boxes of the first `count` nodes.
std::vector<Bounds> node_bounds(const Tree& tree, std::size_t count,
                                std::span<const Bounds> solids) {
  std::vector<Bounds> boxes(count);  // operands stand before the nodes that take them
  for (Tree::NodeId id = 0; id < count; ++id) {
    const Tree::Node& at = tree.nodes()[id];
    if (at.operation == Operation::kSolid) {
      boxes[id] = solids[at.first];
      continue;
    }
    const auto operands = tree.operands(id);
    if (operands.empty()) continue;
    Bounds& box = boxes[id];
    box = boxes[operands[0]];
    for (const Tree::NodeId operand : operands.subspan(1)) {
      if (at.operation == Operation::kUnion) {
        box.include(boxes[operand]);
      } else if (at.operation == Operation::kIntersection) {
        box.low = glm::max(box.low, boxes[operand].low);
        box.high = glm::min(box.high, boxes[operand].high);
      }
    }
    if (at.operation == Operation::kDifference && !is_empty(box)) {
      box = difference_bounds(tree, operands, boxes);
    }
    if (is_empty(box)) box = {};
  }
  return boxes;
}

}  // namespace

Bounds bounds(const Tree& tree, Tree::NodeId node, std::span<const Bounds> solids) {
  return node == Tree::kNone ? Bounds{} : node_bounds(tree, node + 1, solids).back();
}

std::vector<ActiveBox> active_boxes(const Tree& tree, std::span<const Bounds> solids) {
  const std::vector<Bounds> boxes = node_bounds(tree, tree.nodes().size(), solids);
  std::vector<ActiveBox> nodes(boxes.size()), result(solids.size());
  std::vector<std::uint8_t> is_operand(boxes.size(), 0);
  for (auto id = static_cast<Tree::NodeId>(boxes.size()); id-- > 0;) {  // from the roots down
    ActiveBox& here = nodes[id];
    if (is_operand[id] == 0) here.box = boxes[id];
    const Tree::Node& node = tree.nodes()[id];
    if (node.operation == Operation::kSolid) {
      result[node.first] = here;
      continue;
    }
    Bounds inner = boxes[id];
    inner.low = glm::max(inner.low, here.box.low);
    inner.high = glm::min(inner.high, here.box.high);
    if (is_empty(inner)) continue;
    bool first = true;
    for (const Tree::NodeId operand : tree.operands(id)) {
      nodes[operand].box.include(inner);
      nodes[operand].subtracted =
          here.subtracted != (node.operation == Operation::kDifference && !first);
      is_operand[operand] = 1;
      first = false;
    }
  }
  return result;
}

Bounds picture_box(const Tree& tree, std::span<const Bounds> solids,
                   std::span<const Tree::NodeId> shown) {
  Bounds all, seen;
  for (const Bounds& solid : solids) all.include(solid);
  const std::vector<Bounds> boxes = node_bounds(tree, tree.nodes().size(), solids);
  for (const Tree::NodeId node : shown) {
    if (node != Tree::kNone) seen.include(boxes[node]);
  }
  const auto size = [](const Bounds& box) { return glm::length(box.high - box.low); };
  return !seen.empty() && size(all) > kVast * size(seen) ? seen : all;
}

}  // namespace strata::csg
