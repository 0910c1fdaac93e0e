#pragma once

#include <algorithm>
#include <cstdint>

namespace strata::detail {

/// What colour values of a file are multiplied by to be 0 to 255, by the largest of them: most
/// files have 0 to 1, some 0 to 255.
[[nodiscard]] inline float colour_scale(float most) {
  constexpr float kRounded = 1.01f;  // 1, as sums and products of floats make it
  return most <= kRounded ? 255.0f : 1.0f;
}

/// The nearest byte. @param value  0 to 255; others are clamped, NaN is 0
[[nodiscard]] inline std::uint8_t colour_byte(float value) {
  return value > 0.0f ? static_cast<std::uint8_t>(std::min(value, 255.0f) + 0.5f) : std::uint8_t{0};
}

}  // namespace strata::detail
