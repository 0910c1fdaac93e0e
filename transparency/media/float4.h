#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <glm/vec3.hpp>

// Four numbers at once: red, green, blue and one that is not used. The same bits on all machines.

namespace strata::transparency {

using Float4 = float __attribute__((vector_size(16)));
using Double2 = double __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));

inline Float4 splat(float x) { return Float4{x, x, x, x}; }
inline Float4 from(const glm::vec3& v) { return Float4{v.x, v.y, v.z, 0.0f}; }
inline Float4 joined(const std::array<Double2, 2>& v) {
  using Float2 = float __attribute__((vector_size(8)));
  return __builtin_shufflevector(__builtin_convertvector(v[0], Float2),
                                 __builtin_convertvector(v[1], Float2), 0, 1, 2, 3);
}
inline glm::vec3 to_vec3(Float4 v) { return {v[0], v[1], v[2]}; }

/// e^-x for x >= 0: 1 for 0, at most 2^-22 wrong in proportion; less than 2^-120 is given as
/// 2^-120. S. Moshier's polynomial (Cephes, expf).
inline Float4 exp_minus(Float4 x) {
  constexpr float kMost = 83.0f;  // e^-83 < 2^-119
  x = x < splat(kMost) ? x : splat(kMost);
  // The nearest integer to x / ln 2, by adding 1.5 * 2^23, where floats are integers.
  const Float4 shift = splat(12582912.0f);
  const Float4 shifted = x * splat(-1.44269504088896341f) + shift;
  const Float4 whole = shifted - shift;
  const Float4 r = (-x - whole * splat(0.693359375f)) - whole * splat(-2.12194440e-4f);
  Float4 sum = splat(1.9875691500e-4f);
  sum = sum * r + splat(1.3981999507e-3f);
  sum = sum * r + splat(8.3334519073e-3f);
  sum = sum * r + splat(4.1665795894e-2f);
  sum = sum * r + splat(1.6666665459e-1f);
  sum = sum * r + splat(5.0000001201e-1f);
  sum = sum * (r * r) + r + splat(1.0f);
  const Int4 power = std::bit_cast<Int4>(shifted) - std::bit_cast<Int4>(shift);
  const Int4 bits = (power + 127) << 23;
  return sum * std::bit_cast<Float4>(bits);
}

}  // namespace strata::transparency
