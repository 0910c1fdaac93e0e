#pragma once

#include <cstdint>

#include "strata/picture/pixels.h"

namespace strata {

/// A colour for label n: the first dozen are far apart, all are neither dark nor pale.
[[nodiscard]] Rgba palette_colour(std::uint32_t label);

}  // namespace strata
