#include "csg/tree.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

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
    for (std::size_t i = 0; i < operands.size(); ++i) {
      const Bounds& box = boxes[operands[i]];
      if (i == 0) {
        boxes[id] = box;
      } else if (at.operation == Operation::kUnion) {
        boxes[id].include(box);
      } else if (at.operation == Operation::kIntersection) {
        boxes[id].low = glm::max(boxes[id].low, box.low);
        boxes[id].high = glm::min(boxes[id].high, box.high);
      }
    }
    if (boxes[id].empty() || boxes[id].low.y > boxes[id].high.y ||
        boxes[id].low.z > boxes[id].high.z) {
      boxes[id] = {};
    }
  }
  return boxes;
}

}  // namespace

Bounds bounds(const Tree& tree, Tree::NodeId node, std::span<const Bounds> solids) {
  return node == Tree::kNone ? Bounds{} : node_bounds(tree, node + 1, solids).back();
}

Bounds picture_box(const Tree& tree, std::span<const Bounds> solids,
                   std::span<const Tree::NodeId> shown) {
  constexpr double kFarLarger = 1000.0;
  Bounds all, seen;
  for (const Bounds& solid : solids) all.include(solid);
  const std::vector<Bounds> boxes = node_bounds(tree, tree.nodes().size(), solids);
  for (const Tree::NodeId node : shown) {
    if (node != Tree::kNone) seen.include(boxes[node]);
  }
  const auto size = [](const Bounds& box) { return glm::length(box.high - box.low); };
  return !seen.empty() && size(all) > kFarLarger * size(seen) ? seen : all;
}

}  // namespace strata::csg
