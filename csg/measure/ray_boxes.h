#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "strata/mesh/soup_tools.h"

namespace strata::csg {

/// A stretch of a line: from + t * direction for t in [low, high].
struct RaySpan {
  glm::dvec3 from{0.0}, direction{0.0};
  double low = 0.0, high = 0.0;
};

/// A tree of boxes over items that have a box each; it finds those that a line or another box may
/// meet. Boxes are halved at the median of their centres: 32 levels at most.
class RayBoxes {
 public:
  RayBoxes() = default;
  /// @param boxes  of the items; an empty box is never found
  explicit RayBoxes(std::span<const Bounds> boxes);

  /// Calls body(item) for items whose box meets the stretch of the line, and maybe for some others.
  template <class Body>
  void on_ray(const RaySpan& ray, const Body& body) const {
    const glm::dvec3 inverse = 1.0 / ray.direction;
    visit(
        [&](const Bounds& box) {
          double low = ray.low, high = ray.high;
          for (int k = 0; k < 3; ++k) {
            const double to_low = box.low[k] - ray.from[k], to_high = box.high[k] - ray.from[k];
            if (ray.direction[k] == 0.0) {
              if (to_low > 0.0 || to_high < 0.0) return false;
              continue;
            }
            const double a = to_low * inverse[k], b = to_high * inverse[k];
            low = std::max(low, std::min(a, b));
            high = std::min(high, std::max(a, b));
          }
          // The rounding of the products must not lose a box.
          const double slack = 1e-12 * (std::abs(low) + std::abs(high));
          return low <= high + slack;
        },
        body);
  }
  /// Calls body(item) for items whose box meets `box`.
  template <class Body>
  void in_box(const Bounds& box, const Body& body) const {
    visit(
        [&](const Bounds& other) {
          for (int k = 0; k < 3; ++k) {
            if (other.low[k] > box.high[k] || other.high[k] < box.low[k]) return false;
          }
          return true;
        },
        body);
  }

 private:
  static constexpr std::uint32_t kFew = 4;
  struct Node {
    Bounds box;
    std::uint32_t first = 0, count = 0;  ///< items; count 0: two children, at `first` and behind
  };

  template <class Meets, class Body>
  void visit(const Meets& meets, const Body& body) const {
    if (nodes_.empty()) return;
    std::uint32_t waiting[64];
    int count = 0;
    waiting[count++] = 0;
    while (count > 0) {
      const Node& node = nodes_[waiting[--count]];
      if (!meets(node.box)) continue;
      if (node.count == 0) {
        waiting[count++] = node.first;
        waiting[count++] = node.first + 1;
        continue;
      }
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) body(items_[i]);
    }
  }

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> items_;
};

}  // namespace strata::csg
