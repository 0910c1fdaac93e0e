#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/picture/pixels.h"

namespace strata {

/// A picture as the bytes of a PNG file, which do not depend on the threads. Throws std::bad_alloc.
/// Private to Strata.
[[nodiscard]] std::vector<std::uint8_t> encode_png(const Picture& picture,
                                                   const Execution& execution = {});
/// As write_png() of strata/picture/pixels.h, by these threads; a stop request is not heard.
Result<void> write_png(const Picture& picture, const std::string& path, const Execution& execution);

}  // namespace strata
