#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <span>

#include "picture/studio_lights.h"
#include "strata/picture/pixels.h"

// Private to csg/.

namespace strata::csg {

/// A face of a curved surface in a picture.
struct CurvedFace {
  /// Share of a corner at (u, v, 1), not scaled; its normal in eye space.
  std::array<glm::dvec3, 3> shares, normals;
};

/// As many pixels have their colours found at once.
constexpr std::size_t kCurvedPixels = 64;

/// The colours of a curved face under studio lights at the middles of pixels from (u, v) on.
/// @param base  before light
/// @param open  of each pixel: as shaded() has it
/// @return false: a pixel near them has no normal. All other colours are those of shaded(), bit by
/// bit
[[nodiscard]] bool curved_colours(const CurvedFace& face, const glm::vec3& base,
                                  const StudioLights& lights, int u, int v,
                                  const std::array<float, kCurvedPixels>& open,
                                  std::span<Rgba> pixels);

}  // namespace strata::csg
