#pragma once

#include <glm/vec4.hpp>

// A pixel's four channels in one register. The numbers are those of the scalar operations.

namespace strata::transparency {

using Lanes = float __attribute__((vector_size(16)));

[[nodiscard]] inline Lanes load_lanes(const glm::vec4& pixel) {
  using Unaligned = float __attribute__((vector_size(16), aligned(4), may_alias));
  return reinterpret_cast<const Unaligned&>(pixel);
}
inline void store_lanes(Lanes lanes, glm::vec4& pixel) {
  using Unaligned = float __attribute__((vector_size(16), aligned(4), may_alias));
  reinterpret_cast<Unaligned&>(pixel) = lanes;
}
/// The last channel in all lanes.
[[nodiscard]] inline Lanes last_lane(Lanes lanes) {
  return __builtin_shufflevector(lanes, lanes, 3, 3, 3, 3);
}
/// The first three channels of one and the last of another.
[[nodiscard]] inline Lanes with_last(Lanes colour, Lanes last) {
  return __builtin_shufflevector(colour, __builtin_shufflevector(colour, last, 2, 2, 7, 7), 0, 1, 4,
                                 6);
}

}  // namespace strata::transparency
