#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <string>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"

namespace strata {

/// Red, green, blue, alpha; colours are not multiplied by alpha.
using Rgba = glm::vec<4, std::uint8_t>;

/// An image of 8 bits a channel, rows from the top.
struct Picture {
  int width = 0;             ///< pixels
  int height = 0;            ///< pixels
  std::vector<Rgba> pixels;  ///< width * height, row by row
};

/// Writes a PNG file, or to standard output for "-". It is not stopped half way, and reports no
/// progress. @return kOutput naming the file, kLimit (wider than 2^28 pixels, out of memory)
/// @param execution  its number of threads counts
Result<void> write_png(const Picture& picture, const std::string& path,
                       const Execution& execution = {});

}  // namespace strata
