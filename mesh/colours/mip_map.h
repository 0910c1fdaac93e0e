#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <vector>

#include "strata/core/execution.h"
#include "strata/mesh/mesh_attributes.h"

// Private to mesh/colours.
//
// This work is based on:
// Lance Williams. Pyramidal parametrics. 1983.
// Joel McCormack et al. Feline: fast elliptical lines for anisotropic texture mapping. 1999.

namespace strata {

/// Four numbers that are added and multiplied at once: red, green, blue, alpha.
__extension__ typedef float Float4 __attribute__((vector_size(16)));

/// A texture and its halves: texels of each level are means of those of the level before, in linear
/// light, weighted by alpha. A level has half as many texels as the last along each side, rounded
/// down; where a side is odd the box of a texel cuts through texels.
class MipMap {
 public:
  explicit MipMap(const Texture& texture) : texture_(&texture) {}
  /// Makes all levels. Rows are made by several threads.
  void make_levels(const Execution& execution);

  /// Light and alpha, light times alpha, at a place of the texture: (0, 0) is its upper left
  /// corner, (1, 1) its lower right one. @param level 0 or more; between two levels both count
  /// @pre |at.x| and |at.y| are below 2^31
  [[nodiscard]] Float4 sample(const glm::dvec2& at, float level) const;

  [[nodiscard]] int width() const { return texture_->width; }
  [[nodiscard]] int height() const { return texture_->height; }
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  using Texel = std::array<std::uint16_t, 4>;  // light times alpha, alpha: 65535 is 1
  struct Level {
    int width = 0, height = 0;
    std::vector<Texel> texels;
  };
  [[nodiscard]] Float4 texel(std::size_t level, std::size_t index) const;
  [[nodiscard]] Float4 bilinear(const glm::dvec2& at, std::size_t level) const;
  void make_row(std::size_t level, int y);

  const Texture* texture_;
  std::vector<Level> levels_;  // from 1 on
};

}  // namespace strata
