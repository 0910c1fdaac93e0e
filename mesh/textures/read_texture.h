#pragma once

#include <string>
#include <string_view>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/mesh_attributes.h"

namespace strata {

/// Decodes a picture that a mesh shows: PNG of any kind (samples of 16 bits are rounded to 8), or
/// JPEG (grey, YCbCr, RGB; CMYK and YCCK as without a colour profile). The content decides which.
/// Colours are taken as sRGB, except where a PNG has another gamma, which is converted.
/// @param name  of the picture in messages, and of the texture
/// @return kInput: neither PNG nor JPEG, damaged, cut short; kLimit: a side of more than 32768, or
/// more than the memory limit; kUsage: a JPEG in a build without libjpeg; kCancelled
Result<Texture> read_texture(const std::string& name, std::string_view bytes,
                             const Execution& execution = {});

}  // namespace strata
