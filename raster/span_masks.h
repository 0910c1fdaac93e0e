#pragma once

#include <cstdint>

namespace strata {

/// For each number up to 8 a vector with all bits of so many first lanes set: to load it takes less
/// than to compare.
struct SpanMasks {
  alignas(64) std::uint32_t lanes[9][8] = {};
  constexpr SpanMasks() {
    for (std::uint32_t count = 0; count <= 8; ++count) {
      for (std::uint32_t lane = 0; lane < count; ++lane) lanes[count][lane] = ~0u;
    }
  }
};
inline constexpr SpanMasks kSpanMasks;

}  // namespace strata
