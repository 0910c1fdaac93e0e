#pragma once

#include <cstdint>
#include <numeric>
#include <vector>

namespace strata::detail {

/// Items sorted by a key, in their own order where keys are equal.
struct Buckets {
  std::vector<std::uint32_t> first;  ///< of each key, and the end
  std::vector<std::uint32_t> items;
};

/// A counting sort. @param key  key(item) < keys
template <class Key>
Buckets bucket(std::size_t items, std::size_t keys, const Key& key) {
  Buckets result;
  result.first.assign(keys + 1, 0);
  for (std::size_t i = 0; i < items; ++i) ++result.first[key(i) + 1];
  std::partial_sum(result.first.begin(), result.first.end(), result.first.begin());
  result.items.resize(items);
  std::vector<std::uint32_t> next(result.first.begin(), result.first.end() - 1);
  for (std::size_t i = 0; i < items; ++i) {
    result.items[next[key(i)]++] = static_cast<std::uint32_t>(i);
  }
  return result;
}

}  // namespace strata::detail
