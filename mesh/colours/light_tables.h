#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <glm/vec4.hpp>

#include "core/srgb.h"

// Private to mesh/colours.

namespace strata {

/// Four numbers that are added and multiplied at once: red, green, blue, alpha.
__extension__ typedef float Float4 __attribute__((vector_size(16)));
__extension__ typedef std::int32_t Int4 __attribute__((vector_size(16)));
__extension__ typedef std::uint16_t Short4 __attribute__((vector_size(8)));

/// Light times alpha, and alpha: 65535 is 1.
using LightTexel = std::array<std::uint16_t, 4>;
inline constexpr float kLightOne = 65535.0f;

inline Float4 light_of(const LightTexel& texel) {
  Short4 numbers;
  std::memcpy(&numbers, texel.data(), sizeof numbers);
  return __builtin_convertvector(__builtin_convertvector(numbers, Int4), Float4);
}

/// The texels of a picture, sRGB with straight alpha, as light times alpha: 65535 is 1.
class LightTables {
 public:
  /// @param opaque  alpha is 255 everywhere
  static const LightTables& get(bool opaque) {
    static const LightTables kStraight(false), kOpaque(true);
    return opaque ? kOpaque : kStraight;
  }
  template <bool kOpaque>
  [[nodiscard]] Float4 light_of(const glm::u8vec4& texel) const {
    const auto bits = [&](std::size_t channel, std::uint8_t value) {
      Int4 loaded;
      std::memcpy(&loaded, channels_[channel][value].data(), sizeof loaded);
      return loaded;
    };
    const Int4 all = bits(0, texel.x) | bits(1, texel.y) | bits(2, texel.z);
    Float4 light;
    std::memcpy(&light, &all, sizeof light);
    return kOpaque ? light : light * (static_cast<float>(texel.w) * kAlphaStep);
  }

 private:
  static constexpr float kAlphaStep = kLightOne / 255.0f;

  explicit LightTables(bool opaque) {
    const float factor = opaque ? 255.0f * kAlphaStep : 1.0f;
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < 256; ++i) channels_[c][i][c] = linear_light()[i] * factor;
    }
    for (auto& blue : channels_[2]) blue[3] = factor;
  }

  // The light of each value at its place among four, which `or` puts together. Blue brings alpha.
  alignas(16) std::array<std::array<std::array<float, 4>, 256>, 3> channels_{};
};

}  // namespace strata
