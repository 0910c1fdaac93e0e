#pragma once

#include <cstdint>
#include <vector>

#include "strata/picture/pixels.h"

namespace strata {

/// A picture as the bytes of a PNG file, which do not depend on the threads. Throws std::bad_alloc.
/// Private to Strata. @param threads  as Execution::threads
[[nodiscard]] std::vector<std::uint8_t> encode_png(const Picture& picture, int threads = 0);

}  // namespace strata
