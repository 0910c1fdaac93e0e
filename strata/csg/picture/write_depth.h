#pragma once

#include <string>

#include "strata/core/result.h"
#include "strata/csg/picture/picture.h"

namespace strata::csg {

/// Writes the distances of visible surfaces along the view axis, in world units, as an OpenEXR file
/// with one channel, Z, of 32-bit floats; infinity where no solid is visible.
/// @return kUsage in builds without OpenEXR and for "-"; kOutput naming the file
Result<void> write_depth_exr(const SurfaceImage& image, const View& view, const std::string& path);

}  // namespace strata::csg
