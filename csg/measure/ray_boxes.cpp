#include "csg/measure/ray_boxes.h"

#include <numeric>

namespace strata::csg {

RayBoxes::RayBoxes(std::span<const Bounds> boxes) {
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    if (!boxes[i].empty()) items_.push_back(i);
  }
  if (items_.empty()) return;
  const auto count = static_cast<std::uint32_t>(items_.size());
  nodes_.reserve(count);
  nodes_.push_back({{}, 0, count});
  std::vector<std::uint32_t> waiting{0};
  while (!waiting.empty()) {
    const std::uint32_t at = waiting.back();
    waiting.pop_back();
    const Node node = nodes_[at];
    Bounds all, centres;
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Bounds& box = boxes[items_[i]];
      all.include(box);
      centres.include(box.low * 0.5 + box.high * 0.5);
    }
    nodes_[at].box = all;
    if (node.count <= kFew) continue;
    const glm::dvec3 size = centres.high - centres.low;
    int axis = size.y > size.x ? 1 : 0;
    if (size.z > size[axis]) axis = 2;
    const auto begin = items_.begin() + node.first;
    const std::uint32_t half = node.count / 2;
    std::nth_element(begin, begin + half, begin + node.count,
                     [&](std::uint32_t a, std::uint32_t b) {
                       const double p = boxes[a].low[axis] + boxes[a].high[axis];
                       const double q = boxes[b].low[axis] + boxes[b].high[axis];
                       return p != q ? p < q : a < b;
                     });
    const auto children = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back({{}, node.first, half});
    nodes_.push_back({{}, node.first + half, node.count - half});
    nodes_[at].first = children;
    nodes_[at].count = 0;
    waiting.push_back(children);
    waiting.push_back(children + 1);
  }
}

}  // namespace strata::csg
