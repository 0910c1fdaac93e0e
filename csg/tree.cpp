#include "strata/csg/tree.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "strata/mesh/diagnose.h"

namespace strata::csg {

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

std::vector<Mattering> mattering(const Tree& tree, std::span<const Bounds> solids) {
  const std::vector<Bounds> boxes = node_bounds(tree, tree.nodes().size(), solids);
  std::vector<Mattering> nodes(boxes.size()), result(solids.size());
  std::vector<std::uint8_t> is_operand(boxes.size(), 0);
  for (auto id = static_cast<Tree::NodeId>(boxes.size()); id-- > 0;) {  // from the roots down
    Mattering& here = nodes[id];
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
      nodes[operand].taken_away =
          here.taken_away != (node.operation == Operation::kDifference && !first);
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
