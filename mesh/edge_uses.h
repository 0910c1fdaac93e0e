#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/vec3.hpp>
#include <numeric>
#include <span>
#include <tuple>
#include <vector>

#include "core/reserve_large.h"

namespace strata::detail {

/// A use of an edge by a triangle, stored with the edge's lower vertex.
struct EdgeUse {
  std::uint32_t high = 0;
  std::uint32_t triangle = 0;  ///< [triangle:31 | high -> low:1]

  [[nodiscard]] std::uint32_t of() const { return triangle >> 1; }
  [[nodiscard]] bool down() const { return (triangle & 1u) != 0; }
  friend bool operator<(const EdgeUse& a, const EdgeUse& b) {
    return std::tie(a.high, a.triangle) < std::tie(b.high, b.triangle);
  }
};

/// The uses of all edges between welded vertices, grouped by lower vertex.
class EdgeUses {
 public:
  /// @param keep  keep(t): whether triangle t counts @pre fewer than 2^31 triangles
  template <class Keep>
  EdgeUses(std::span<const glm::uvec3> triangles, std::span<const std::uint32_t> welded,
           Keep&& keep)
      : begin_(welded.size() + 2, 0) {
    const auto for_uses = [&](auto&& visit) {
      for (std::size_t t = 0; t < triangles.size(); ++t) {
        if (!keep(t)) continue;
        for (int k = 0; k < 3; ++k) {
          const std::uint32_t a = welded[triangles[t][k]];
          const std::uint32_t b = welded[triangles[t][(k + 1) % 3]];
          if (a != b) visit(std::min(a, b), std::max(a, b), static_cast<std::uint32_t>(t), a > b);
        }
      }
    };
    // Counting sort. After it, begin_[v] and begin_[v + 1] enclose the uses of v.
    for_uses([&](std::uint32_t low, std::uint32_t, std::uint32_t, bool) { ++begin_[low + 2]; });
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    reserve_large(uses_, begin_.back());
    uses_.resize(begin_.back());
    for_uses([&](std::uint32_t low, std::uint32_t high, std::uint32_t t, bool down) {
      uses_[begin_[low + 1]++] = {high, t << 1 | static_cast<std::uint32_t>(down)};
    });
  }

  [[nodiscard]] std::span<EdgeUse> at(std::size_t low) {
    return std::span(uses_).subspan(begin_[low], begin_[low + 1] - begin_[low]);
  }

  /// Calls visit(uses) for every edge of a lower vertex. The uses are sorted by triangle.
  template <class Visit>
  void for_edges(std::size_t low, Visit&& visit) {
    const std::span<EdgeUse> uses = at(low);
    std::sort(uses.begin(), uses.end());
    for (std::size_t i = 0, end = 0; i < uses.size(); i = end) {
      while (end < uses.size() && uses[end].high == uses[i].high) ++end;
      visit(std::span<const EdgeUse>(uses.subspan(i, end - i)));
    }
  }

 private:
  std::vector<std::size_t> begin_;
  std::vector<EdgeUse> uses_;
};

}  // namespace strata::detail
