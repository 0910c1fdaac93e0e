#pragma once

#include <cstdint>
#include <vector>

#include "strata/picture/pixels.h"

namespace strata {

/// A picture as the bytes of a PNG file. Throws std::bad_alloc. Private to Strata.
[[nodiscard]] std::vector<std::uint8_t> encode_png(const Picture& picture);

}  // namespace strata
