#include "voxelize/picture/small_text.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace strata {
namespace {

struct Glyph {
  char character;
  std::array<std::uint8_t, 7> rows;  ///< from the top; bit 4 is the left column
};
constexpr Glyph kGlyphs[] = {
    {'0', {0b01110, 0b10001, 0b10001, 0b10001, 0b10001, 0b10001, 0b01110}},
    {'1', {0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110}},
    {'2', {0b01110, 0b10001, 0b00001, 0b00110, 0b01000, 0b10000, 0b11111}},
    {'3', {0b01110, 0b10001, 0b00001, 0b00110, 0b00001, 0b10001, 0b01110}},
    {'4', {0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010}},
    {'5', {0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110}},
    {'6', {0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110}},
    {'7', {0b11111, 0b00001, 0b00010, 0b00100, 0b00100, 0b01000, 0b01000}},
    {'8', {0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110}},
    {'9', {0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100}},
    {'-', {0b00000, 0b00000, 0b00000, 0b01110, 0b00000, 0b00000, 0b00000}},
    {'+', {0b00000, 0b00100, 0b00100, 0b11111, 0b00100, 0b00100, 0b00000}},
    {'e', {0b00000, 0b00000, 0b01110, 0b10001, 0b11111, 0b10000, 0b01110}},
    {'.', {0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b01100, 0b01100}}};
constexpr int kWidth = 5, kHeight = 7, kStep = 6;

}  // namespace

glm::ivec2 small_text_size(std::string_view number, int scale) {
  return {(static_cast<int>(number.size()) * kStep - (kStep - kWidth)) * scale, kHeight * scale};
}

void draw_small_text(Picture& picture, const glm::ivec2& corner, std::string_view number, int scale,
                     const Rgba& colour) {
  int left = corner.x;
  for (const char character : number) {
    const auto* glyph = std::find_if(std::begin(kGlyphs), std::end(kGlyphs),
                                     [&](const Glyph& one) { return one.character == character; });
    for (int y = 0; glyph != std::end(kGlyphs) && y < kHeight * scale; ++y) {
      for (int x = 0; x < kWidth * scale; ++x) {
        const int row = glyph->rows[static_cast<std::size_t>(y / scale)];
        if ((row >> (kWidth - 1 - x / scale) & 1) == 0) continue;
        const int u = left + x, v = corner.y + y;
        if (u < 0 || v < 0 || u >= picture.width || v >= picture.height) continue;
        picture.pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(picture.width) +
                       static_cast<std::size_t>(u)] = colour;
      }
    }
    left += kStep * scale;
  }
}

}  // namespace strata
