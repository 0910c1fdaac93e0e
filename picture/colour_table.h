#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "strata/picture/pixels.h"

// A picture in few colours. Private to picture/.

namespace strata {

/// Up to 256 colours for a picture, and the picture in them.
struct IndexedPicture {
  std::vector<Rgba> colours;
  std::vector<std::uint8_t> indices;  ///< of the colours, row by row
  int transparent = -1;               ///< index of pixels whose alpha is below a half; -1: none
};

/// Chooses the colours by median cut and spreads the error of each pixel over its neighbours.
/// The same picture gives the same bytes.
/// @param transparent  alpha counts
[[nodiscard]] IndexedPicture index_picture(std::span<const Rgba> pixels, int width,
                                           bool transparent);

}  // namespace strata
