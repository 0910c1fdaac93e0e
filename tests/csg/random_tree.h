#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/ext/matrix_transform.hpp>
#include <memory>
#include <random>
#include <vector>

#include "strata/csg/tree.h"
#include "strata/mesh/shapes.h"

namespace strata::csg {

/// Trees of random shape over random solids, from a seed.
class RandomTree {
 public:
  explicit RandomTree(std::uint64_t seed) : random_(seed) {}

  int pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  double real(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  /// A box, ball, tube, torus or cone somewhere in [-10, 10]^3; `on_grid`: boxes whose faces lie on
  /// whole numbers, so that many coincide.
  Solid solid(bool on_grid) {
    Solid result;
    TriangleSoup mesh;
    if (on_grid) {
      const glm::dvec3 low(pick(-5, 3), pick(-5, 3), pick(-5, 3));
      mesh = make_box(low, low + glm::dvec3(pick(1, 4), pick(1, 4), pick(1, 4)));
    } else {
      switch (pick(0, 4)) {
        case 0:
          mesh = make_box(glm::dvec3(-1), glm::dvec3(1));
          break;
        case 1:
          mesh = make_icosphere(1.2, pick(0, 2));
          break;
        case 2:
          mesh = make_cylinder(0.8, 2.5, pick(3, 16));
          break;
        case 3:
          mesh = make_torus(1.2, 0.5, 12, 8);
          break;
        default:
          mesh = make_cone(1.1, 2.0, pick(3, 12));
          break;
      }
      glm::dmat4 m(1.0);
      m = glm::translate(m, glm::dvec3(real(-6, 6), real(-6, 6), real(-6, 6)));
      m = glm::rotate(m, real(0, 6.3), glm::normalize(glm::dvec3(real(-1, 1), real(-1, 1), 1)));
      m = glm::scale(m, glm::dvec3(real(0.5, 4), real(0.5, 4), real(0.5, 4)));
      if (pick(0, 3) == 0) m = glm::scale(m, glm::dvec3(-1, 1, 1));
      result.world_from_mesh = m;
    }
    result.mesh = std::make_shared<TriangleSoup>(std::move(mesh));
    return result;
  }

  /// A tree of `solids` leaves, not yet its root.
  Tree::NodeId grow(Tree& tree, int solids, bool on_grid) {
    if (solids <= 1) return tree.add_solid(solid(on_grid));
    const int parts = std::min(solids, pick(2, 4));
    std::vector<Tree::NodeId> operands;
    for (int i = 0, left = solids; i < parts; ++i) {
      const int share = i + 1 == parts ? left : std::max(1, pick(1, left - (parts - 1 - i)));
      operands.push_back(grow(tree, share, on_grid));
      left -= share;
    }
    constexpr Operation kOperations[] = {Operation::kUnion, Operation::kUnion,
                                         Operation::kDifference, Operation::kDifference,
                                         Operation::kIntersection};
    return tree.add(kOperations[pick(0, 4)], operands);
  }

 private:
  std::mt19937_64 random_;
};

/// A tree's value by recursion, obviously right: inside(solid) tells for each solid.
inline bool evaluate(const Tree& tree, Tree::NodeId node,
                     const std::function<bool(std::uint32_t)>& inside) {
  if (node == Tree::kNone) return false;
  const Tree::Node& at = tree.nodes()[node];
  if (at.operation == Operation::kSolid) return inside(at.first);
  const auto operands = tree.operands(node);
  if (operands.empty()) return false;
  bool value = evaluate(tree, operands[0], inside);
  for (std::size_t i = 1; i < operands.size(); ++i) {
    const bool other = evaluate(tree, operands[i], inside);
    switch (at.operation) {
      case Operation::kUnion:
        value = value || other;
        break;
      case Operation::kIntersection:
        value = value && other;
        break;
      case Operation::kDifference:
        value = value && !other;
        break;
      case Operation::kSolid:
        break;
    }
  }
  return value;
}

}  // namespace strata::csg
