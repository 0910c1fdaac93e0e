#pragma once

#include <compare>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <span>
#include <vector>

namespace strata {

/// One crossing of a ray with a surface, sorted as law 1 demands: by depth, then entering before
/// exiting, then by triangle. [depth:32 | exit:1 | triangle:31]
struct DepthItem {
  std::uint64_t bits = 0;  ///< as above; they compare like the crossings

  DepthItem() = default;
  /// From the bits.
  constexpr explicit DepthItem(std::uint64_t raw) : bits(raw) {}
  /// @pre triangle < 2^31
  constexpr DepthItem(std::uint32_t depth, bool exit, std::uint32_t triangle)
      : bits(std::uint64_t{depth} << 32 | std::uint64_t{exit} << 31 | triangle) {}

  /// The exact floor of the crossing's depth in lattice steps (24 bits at most).
  [[nodiscard]] constexpr std::uint32_t depth() const {
    return static_cast<std::uint32_t>(bits >> 32);
  }
  /// [exit:1 | triangle:31]
  [[nodiscard]] constexpr std::uint32_t payload() const { return static_cast<std::uint32_t>(bits); }
  /// True where the ray leaves the solid: the outward normal looks along the ray.
  [[nodiscard]] constexpr bool exit() const { return (bits >> 31 & 1) != 0; }
  /// Index of the crossed triangle, below 2^31.
  [[nodiscard]] constexpr std::uint32_t triangle() const { return payload() & 0x7fffffffu; }
  /// The order of law 1.
  friend constexpr auto operator<=>(DepthItem, DepthItem) = default;
};

/// Sorted depth lists of a whole image in compressed sparse rows: the list of pixel (u, v) is
/// items[offsets[v * width + u] .. offsets[v * width + u + 1]), increasing.
struct LayeredDepthImage {
  int width = 0;                  ///< pixels along u
  int height = 0;                 ///< pixels along v
  std::uint32_t depth_limit = 0;  ///< depths are in [0, depth_limit), at most 2^24
  /// World position (x, y, z, 1) from (u + 0.5, v + 0.5, depth in lattice steps, 1) of a pixel
  /// centre. Column-major, like GLM.
  glm::dmat4 world_from_image{1.0};
  std::vector<std::uint64_t> offsets;  ///< width * height + 1, starts with 0
  std::vector<DepthItem> items;        ///< the lists of all pixels, one after the other

  /// The list of pixel (u, v). @pre 0 <= u < width, 0 <= v < height
  [[nodiscard]] std::span<const DepthItem> list(int u, int v) const {
    const std::size_t pixel =
        static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
    return std::span(items).subspan(offsets[pixel], offsets[pixel + 1] - offsets[pixel]);
  }
  /// Equal in all members.
  friend bool operator==(const LayeredDepthImage&, const LayeredDepthImage&) = default;
};

}  // namespace strata
