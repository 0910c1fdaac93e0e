#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace strata::transparency {

/// Node `before` must be drawn before node `after`.
struct DrawEdge {
  std::uint32_t before = 0, after = 0;
};

/// Nodes in groups: a group holds nodes of which each must be drawn before each other, by way of
/// the others of the group.
struct DrawGroups {
  std::vector<std::uint32_t> nodes;    ///< group after group, increasing in each
  std::vector<std::uint32_t> offsets;  ///< of the groups, and the end

  [[nodiscard]] std::size_t size() const { return offsets.size() - 1; }
  [[nodiscard]] std::span<const std::uint32_t> group(std::size_t i) const {
    return std::span(nodes).subspan(offsets[i], offsets[i + 1] - offsets[i]);
  }
};

/// The groups in an order that all edges between groups hold in; that of the numbers if they do in
/// that. (R. Tarjan, "Depth-first search and linear graph algorithms", 1972)
[[nodiscard]] DrawGroups ordered_groups(std::uint32_t nodes, std::span<const DrawEdge> edges);

}  // namespace strata::transparency
