#pragma once

#include <string>

#include "strata/core/result.h"
#include "strata/transparency/stream/frame.h"

namespace strata::transparency {

/// Writes a picture as an OpenEXR file with the channels R, G, B and A of 32-bit floats, linear and
/// premultiplied. @return kUsage in builds without OpenEXR and for "-"; kLimit; kOutput naming the
/// file
Result<void> write_exr(const Image& image, const std::string& path);

}  // namespace strata::transparency
