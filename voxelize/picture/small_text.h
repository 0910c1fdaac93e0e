#pragma once

#include <glm/vec2.hpp>
#include <string_view>

#include "strata/picture/pixels.h"

namespace strata {

/// Size of a number in pixels: digits of 5 x 7 dots, each `scale` pixels a side.
[[nodiscard]] glm::ivec2 small_text_size(std::string_view number, int scale);

/// Writes a number: digits, '.', '-', '+' and 'e'. What lies outside of the picture is left out.
void draw_small_text(Picture& picture, const glm::ivec2& corner, std::string_view number, int scale,
                     const Rgba& colour);

}  // namespace strata
