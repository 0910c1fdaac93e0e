#pragma once

#include <string>

#include "strata/core/depth_list.h"
#include "strata/core/result.h"

namespace strata {

/// Writes a picture of depth lists as an 8-bit greyscale PNG, as an X-ray film would show the
/// solid: 255 (1 - exp(-2 t / t_max)) / (1 - exp(-2)), where t is the length of the ray inside
/// (winding number > 0) and t_max the longest in the image. Pixel (u, v) is column u; v grows
/// upwards.
/// @return kUsage when the image has no pixels, kOutput naming the path, kLimit
Result<void> write_xray_png(const std::string& path, const LayeredDepthImage& image);

}  // namespace strata
