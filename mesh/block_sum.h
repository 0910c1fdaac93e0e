#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "strata/core/execution.h"

namespace strata::detail {

/// Folds the items [0, count) in blocks of fixed size and joins the results in order, so that
/// rounding does not depend on the number of threads. Stop requests are ignored, since a partial
/// sum would be wrong.
/// @param add   add(part, index) @param join  join(total, part)
template <class Part, class Add, class Join>
Part fold_blocks(const Execution& execution, std::size_t count, Add&& add, Join&& join) {
  constexpr std::size_t kBlock = std::size_t{1} << 14;
  Execution all = execution;
  all.stop = {};
  std::vector<Part> parts((count + kBlock - 1) / kBlock);
  parallel_for(all, parts.size(), [&](std::size_t block, int) {
    Part part{};
    const std::size_t end = std::min(count, (block + 1) * kBlock);
    for (std::size_t i = block * kBlock; i < end; ++i) add(part, i);
    parts[block] = part;
  });
  Part total{};
  for (const Part& part : parts) join(total, part);
  return total;
}

}  // namespace strata::detail
