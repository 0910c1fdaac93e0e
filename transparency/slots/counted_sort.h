#pragma once

#include <algorithm>
#include <cstdint>

#include "strata/core/depth_list.h"

namespace strata::transparency {

/// Sorts the fragments of a pixel. @return how many pairs were compared
inline std::uint64_t counted_sort(DepthItem* begin, DepthItem* end) {
  std::uint64_t comparisons = 0;
  const auto less = [&comparisons](DepthItem a, DepthItem b) {
    ++comparisons;
    return a < b;
  };
  constexpr std::ptrdiff_t kInsertionSortLimit = 32;
  if (end - begin > kInsertionSortLimit) {
    std::sort(begin, end, less);
    return comparisons;
  }
  for (DepthItem* next = begin; next != end; ++next) {
    const DepthItem item = *next;
    DepthItem* place = next;
    for (; place != begin && less(item, place[-1]); --place) *place = place[-1];
    *place = item;
  }
  return comparisons;
}

}  // namespace strata::transparency
