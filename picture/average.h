#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "strata/picture/pixels.h"

// From samples to pixels. Private to Strata.

namespace strata {

/// The mean of across x down samples for each pixel of a row, over `background` (alpha 0: none; the
/// result has straight alpha). Samples are premultiplied; their rows are `stride` apart.
/// @pre across * down is a power of two, at most 2^16
/// @return how many pixels show something
std::uint64_t average_row(const Rgba* samples, std::size_t stride, int across, int down,
                          Rgba background, std::span<Rgba> pixels);

}  // namespace strata
