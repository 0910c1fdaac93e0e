#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "strata/core/result.h"

namespace strata {

/// A PNG of a slice: grey of 1, 8 or 16 bits, or red, green, blue and alpha of 8 bits each, without
/// interlacing. (Internal to voxelize/.)
class SlicePng {
 public:
  /// @return kInput naming the file and the place
  static Result<SlicePng> open(std::string_view bytes, const std::string& path);
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] int bits() const { return bits_; }  ///< of a number
  [[nodiscard]] bool colours() const { return colours_; }
  /// Calls row(y, values) for all rows, from the top; colours are as ReadContext::colours has them.
  /// @return kInput
  Result<void> rows(
      const std::function<void(int y, std::span<const std::uint32_t> values)>& row) const;

 private:
  int width_ = 0, height_ = 0, bits_ = 0;
  bool colours_ = false;
  std::string path_;
  std::string packed_;  // all IDAT chunks
};

}  // namespace strata
