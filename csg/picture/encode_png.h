#pragma once

#include <cstdint>
#include <vector>

#include "strata/csg/picture/picture.h"

namespace strata::csg {

/// A picture as the bytes of a PNG file. Throws std::bad_alloc. Private to csg/ and the tools.
[[nodiscard]] std::vector<std::uint8_t> encode_png(const Picture& picture);

}  // namespace strata::csg
