#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string_view>

#include "strata/core/execution.h"

namespace strata {

/// Blocks of Minecraft that a .schem is made of: stone, and concrete, wool and terracotta by the
/// mean colour of their faces. (Internal to voxelize/.)
class MinecraftBlocks {
 public:
  MinecraftBlocks();
  [[nodiscard]] static std::size_t count();                   ///< fewer than 127
  [[nodiscard]] static std::string_view name(std::size_t i);  ///< 0 is stone

  /// The block that looks most like a packed colour, to 6 bits of each channel. Any number of
  /// threads may ask.
  [[nodiscard]] std::size_t nearest(std::uint32_t colour) const;

 private:
  static constexpr std::size_t kCells = std::size_t{1} << 18;
  /// By the cell of a colour: the block + 1; 0: not known yet.
  std::unique_ptr<std::atomic<std::uint8_t>[]> blocks_;
};

}  // namespace strata
