#pragma once

#include <cstdint>
#include <glm/vec4.hpp>

namespace strata {

/// A colour as a label of VoxelIntervals: red + 2^8 green + 2^16 blue + 2^24 alpha.
[[nodiscard]] constexpr std::uint32_t packed_colour(const glm::u8vec4& colour) {
  return std::uint32_t{colour.x} | std::uint32_t{colour.y} << 8 | std::uint32_t{colour.z} << 16 |
         std::uint32_t{colour.w} << 24;
}
/// The inverse.
[[nodiscard]] constexpr glm::u8vec4 unpacked_colour(std::uint32_t label) {
  return {static_cast<std::uint8_t>(label), static_cast<std::uint8_t>(label >> 8),
          static_cast<std::uint8_t>(label >> 16), static_cast<std::uint8_t>(label >> 24)};
}

}  // namespace strata
