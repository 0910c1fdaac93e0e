#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace strata {

/// The value of an IEEE 754 half, [sign:1 | exponent:5 | fraction:10]. (Internal to
/// voxelize/readers.)
inline float float_of_half(std::uint16_t half) {
  const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000) << 16;
  const std::uint32_t exponent = half >> 10 & 31, fraction = half & 0x3ff;
  if (exponent == 0) {  // 2^-24 steps
    const float value = static_cast<float>(fraction) * 0x1p-24f;
    return sign != 0 ? -value : value;
  }
  const std::uint32_t wide = exponent == 31 ? 255 : exponent + 112;
  return std::bit_cast<float>(sign | wide << 23 | fraction << 13);
}

}  // namespace strata
