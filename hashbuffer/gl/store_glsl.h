#pragma once

#include <cstdint>

#include "strata/raster/gl/producer.h"

// What the stores' shaders have in common. Private to hashbuffer/gl/.

namespace strata::gl {

/// store_block of store_common.glsl, std140.
struct StoreBlock {
  std::uint32_t first_pixel = 0, pixels = 0, room = 0, age_limit = 0, band = 0;
  std::uint32_t unused[3] = {};
};

/// store_common.glsl and `piece` behind it.
[[nodiscard]] StoreGlsl store_glsl(const GlslPiece& piece, GlslSettings settings = {});

}  // namespace strata::gl
