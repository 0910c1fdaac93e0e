#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace strata::detail {

/// Disjoint sets of items. The least item of a set represents it.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
  }
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];  // halves the path
    return i;
  }
  /// A quick check of whether three items are in one set. It may return false although they are.
  [[nodiscard]] bool known_same(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return parent_[a] == parent_[b] && parent_[b] == parent_[c];
  }
  /// @return whether they were in different sets
  bool join(std::uint32_t a, std::uint32_t b) {
    a = find(a), b = find(b);
    if (a < b) parent_[b] = a;
    if (b < a) parent_[a] = b;
    return a != b;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace strata::detail
