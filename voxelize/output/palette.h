#pragma once

// Few colours for many: exact where there are few, else by cutting boxes of colours where their
// error is largest. Private to voxelize/.
//
// This work is based on:
// Paul Heckbert. Color image quantization for frame buffer display. 1982.
// Xiaolin Wu. Efficient statistical computations for optimal color quantization. 1991.
// Bjorn Ottosson. A perceptual color space for image processing (Oklab). 2020.
//
// We differ: a box is cut at its mean, across the axis of Oklab in which its colours differ most,
// and each colour gets the nearest of the palette, whichever box it was in.

#include <array>
#include <cstdint>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "strata/core/execution.h"
#include "strata/voxelize/intervals.h"

namespace strata {

/// Up to 255 colours, and which of them stands for a colour.
class Palette {
 public:
  [[nodiscard]] const std::vector<glm::u8vec4>& colours() const { return colours_; }
  /// The index of the colour that stands for a packed colour that was counted.
  [[nodiscard]] std::uint8_t index_of(std::uint32_t colour) const;

 private:
  friend class ColourCounts;
  std::vector<glm::u8vec4> colours_;
  std::vector<std::uint32_t> exact_;  // sorted packed colours, each its own; or none
  std::vector<std::uint8_t> cells_;   // by cell of the counts, where there are too many colours
};

/// How often each colour is there; colours as VoxelWriterOptions::rgba packs them.
class ColourCounts {
 public:
  /// Adds colours of runs of voxels.
  void add(std::span<const std::uint32_t> colours, std::span<const Interval> runs);
  /// Adds another's counts. The result does not depend on the order.
  void add(ColourCounts&& other);
  /// @param most 1 to 255
  [[nodiscard]] Palette palette(std::size_t most, const Execution& execution) const;

  /// The cell of a colour: 6 bits of red, green and blue.
  [[nodiscard]] static std::size_t cell_of(std::uint32_t colour) {
    return (colour >> 2 & 0x3f) | (colour >> 10 & 0x3f) << 6 | (colour >> 18 & 0x3f) << 12;
  }

 private:
  static constexpr std::size_t kMostExact = 255;
  static constexpr std::size_t kCells = std::size_t{1} << 18;
  struct alignas(32) Cell {                // in one line of the cache
    std::array<std::uint64_t, 3> light{};  // sums: 65535 is 1
    std::uint64_t count = 0;
  };
  void add_exact(std::uint32_t colour);

  std::uint32_t last_ = 0;            // the colour before; 0 is none
  std::vector<std::uint32_t> exact_;  // sorted; too many when there are more than kMostExact
  std::vector<Cell> cells_;
  std::vector<std::uint64_t> clear_;  // sums of 255 - alpha; none: all is opaque
};

}  // namespace strata
