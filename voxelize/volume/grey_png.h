#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/result.h"

namespace strata {

/// Calls row(y, values, width) for the rows of a grey PNG of 1, 8 or 16 bits without interlacing,
/// from the top. (Internal to voxelize/.)
class GreyPng {
 public:
  /// @return kInput naming the file and the place
  static Result<GreyPng> open(std::string_view bytes, const std::string& path);
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] int bits() const { return bits_; }
  /// The values of all rows, from the top. @return kInput
  Result<std::vector<std::uint16_t>> pixels() const;

 private:
  int width_ = 0, height_ = 0, bits_ = 0;
  std::string path_;
  std::string packed_;  // all IDAT chunks
};

}  // namespace strata
