#pragma once

#include <cstdint>

namespace strata {

/// For each set of 8 lanes, or of the first 4 of them, a vector with all bits of those set: to load
/// it takes less than to compare.
struct SpanMasks {
  alignas(64) std::uint32_t lanes[256][8] = {};
  constexpr SpanMasks() {
    for (std::uint32_t set = 0; set < 256; ++set) {
      for (std::uint32_t lane = 0; lane < 8; ++lane) lanes[set][lane] = 0u - (set >> lane & 1u);
    }
  }
};
inline constexpr SpanMasks kSpanMasks;

}  // namespace strata
