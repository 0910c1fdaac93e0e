#include "strata/picture/backdrop.h"

#include <algorithm>

namespace strata {
namespace {

/// The mean of two bytes, `part` of `whole` on the way from one to the other, rounded.
std::uint8_t between(int from, int to, int part, int whole) {
  return static_cast<std::uint8_t>((from * (whole - part) + to * part + whole / 2) / whole);
}

}  // namespace

Rgba Backdrop::at(int row, int height) const {
  if (top == bottom) return top;
  const int last = std::max(1, height - 1), at = std::clamp(row, 0, last);
  Rgba colour;
  for (int c = 0; c < 4; ++c) colour[c] = between(top[c], bottom[c], at, last);
  return colour;
}

Backdrop gradient_backdrop(const glm::u8vec3& colour) {
  Backdrop result = plain_backdrop(colour);
  for (int c = 0; c < 3; ++c) {
    result.top[c] = between(colour[c], 255, 35, 100);
    result.bottom[c] = between(colour[c], 0, 18, 100);
  }
  return result;
}

void lay_over(Picture& picture, const Backdrop& backdrop) {
  if (backdrop.transparent()) return;
  const auto width = static_cast<std::size_t>(picture.width);
  for (int row = 0; row < picture.height; ++row) {
    const Rgba behind = backdrop.at(row, picture.height);
    Rgba* const pixels = picture.pixels.data() + static_cast<std::size_t>(row) * width;
    for (Rgba* pixel = pixels; pixel != pixels + width; ++pixel) {
      if (pixel->a == 255) continue;
      const int alpha = pixel->a;
      for (int c = 0; c < 3; ++c) (*pixel)[c] = between(behind[c], (*pixel)[c], alpha, 255);
      pixel->a = 255;
    }
  }
}

}  // namespace strata
