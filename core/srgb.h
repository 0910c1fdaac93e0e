#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

// Colours of 8 bits as sRGB has them (IEC 61966-2-1), and their light, 0 to 1. Means and products
// of colours are those of their light.

namespace strata {

/// The light of a value, both 0 to 1.
[[nodiscard]] inline double linear_of_srgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

/// The value of light, both 0 to 1.
[[nodiscard]] inline double srgb_of_linear(double light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1.0 / 2.4) - 0.055;
}

/// The light of each value.
[[nodiscard]] inline const std::array<float, 256>& linear_light() {
  static const std::array<float, 256> kLight = [] {
    std::array<float, 256> light{};
    for (std::size_t i = 0; i < 256; ++i) {
      light[i] = static_cast<float>(linear_of_srgb(static_cast<double>(i) / 255.0));
    }
    return light;
  }();
  return kLight;
}

/// Light to the nearest value. Built once.
class SrgbOfLight {
 public:
  SrgbOfLight() {
    for (std::size_t i = 0; i < 255; ++i) {  // from the middle between two values on
      begins_[i] = static_cast<float>(linear_of_srgb((static_cast<double>(i) + 0.5) / 255.0));
    }
    std::size_t value = 0;
    for (std::size_t i = 0; i <= kSteps; ++i) {
      while (static_cast<float>(i) / kSteps >= begins_[value]) ++value;
      values_[i] = static_cast<std::uint8_t>(value);
    }
  }
  [[nodiscard]] std::uint8_t operator()(float light) const {
    if (!(light > 0.0f)) return 0;
    if (light >= 1.0f) return 255;
    const std::size_t value = values_[static_cast<std::size_t>(light * kSteps)];
    return static_cast<std::uint8_t>(value + (light >= begins_[value] ? 1 : 0));
  }

 private:
  // Values begin farther apart than a step: at most one begins within it.
  static constexpr std::size_t kSteps = 4096;
  std::array<float, 256> begins_ = [] {
    std::array<float, 256> begins{};
    begins.back() = std::numeric_limits<float>::infinity();
    return begins;
  }();
  std::array<std::uint8_t, kSteps + 1> values_{};  // at the beginning of each step
};

/// The nearest value of light.
[[nodiscard]] inline const SrgbOfLight& srgb_of_light() {
  static const SrgbOfLight kSrgb;
  return kSrgb;
}

}  // namespace strata
