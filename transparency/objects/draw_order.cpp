#include "transparency/objects/draw_order.h"

#include <algorithm>

namespace strata::transparency {
namespace {

class Search {
 public:
  Search(std::uint32_t nodes, std::span<const DrawEdge> edges)
      : begins_(nodes + 1, 0), number_(nodes, 0), low_(nodes, 0), next_(nodes), open_(nodes, 0) {
    for (const DrawEdge& edge : edges) ++begins_[edge.before + 1];
    for (std::uint32_t i = 0; i < nodes; ++i) begins_[i + 1] += begins_[i];
    afters_.resize(edges.size());
    std::vector<std::uint32_t> places(begins_.begin(), begins_.end() - 1);
    for (const DrawEdge& edge : edges) afters_[places[edge.before]++] = edge.after;
    std::copy(begins_.begin(), begins_.end() - 1, next_.begin());
  }

  /// Groups come when all that is drawn after them has come.
  DrawGroups run() {
    found_.offsets.push_back(0);
    for (auto node = static_cast<std::uint32_t>(number_.size()); node-- > 0;) {
      if (number_[node] == 0) visit(node);
    }
    DrawGroups ordered;
    ordered.offsets.push_back(0);
    for (std::size_t i = found_.size(); i-- > 0;) {
      const auto group = found_.group(i);
      ordered.nodes.insert(ordered.nodes.end(), group.begin(), group.end());
      std::sort(ordered.nodes.begin() + ordered.offsets.back(), ordered.nodes.end());
      ordered.offsets.push_back(static_cast<std::uint32_t>(ordered.nodes.size()));
    }
    return ordered;
  }

 private:
  void enter(std::uint32_t node) {
    number_[node] = low_[node] = ++last_;
    open_[node] = 1;
    path_.push_back(node);
    waiting_.push_back(node);
  }
  void visit(std::uint32_t root) {
    enter(root);
    while (!path_.empty()) {
      const std::uint32_t node = path_.back();
      if (next_[node] < begins_[node + 1]) {
        const std::uint32_t after = afters_[next_[node]++];
        if (number_[after] == 0) {
          enter(after);
        } else if (open_[after] != 0) {
          low_[node] = std::min(low_[node], number_[after]);
        }
        continue;
      }
      path_.pop_back();
      if (!path_.empty()) low_[path_.back()] = std::min(low_[path_.back()], low_[node]);
      if (low_[node] == number_[node]) leave(node);
    }
  }
  /// The group of `node`: what waits since it came.
  void leave(std::uint32_t node) {
    for (;;) {
      const std::uint32_t member = waiting_.back();
      waiting_.pop_back();
      open_[member] = 0;
      found_.nodes.push_back(member);
      if (member == node) break;
    }
    found_.offsets.push_back(static_cast<std::uint32_t>(found_.nodes.size()));
  }

  std::vector<std::uint32_t> begins_, afters_;  ///< the edges, by the node before
  std::vector<std::uint32_t> number_, low_, next_;
  std::vector<std::uint8_t> open_;
  std::vector<std::uint32_t> path_, waiting_;
  std::uint32_t last_ = 0;
  DrawGroups found_;
};

}  // namespace

DrawGroups ordered_groups(std::uint32_t nodes, std::span<const DrawEdge> edges) {
  return Search(nodes, edges).run();
}

}  // namespace strata::transparency
