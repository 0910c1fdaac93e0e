#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "strata/core/result.h"

namespace strata {

/// A grey PNG of 1, 8 or 16 bits without interlacing. (Internal to voxelize/.)
class GreyPng {
 public:
  /// @return kInput naming the file and the place
  static Result<GreyPng> open(std::string_view bytes, const std::string& path);
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] int bits() const { return bits_; }
  /// Calls row(y, values) for all rows, from the top. @return kInput
  Result<void> rows(
      const std::function<void(int y, std::span<const std::uint16_t> values)>& row) const;

 private:
  int width_ = 0, height_ = 0, bits_ = 0;
  std::string path_;
  std::string packed_;  // all IDAT chunks
};

}  // namespace strata
