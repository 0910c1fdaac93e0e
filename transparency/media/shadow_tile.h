#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "strata/raster/raster_target.h"

namespace strata::transparency {

/// The state of a light's ray at a distance.
struct ShadowEntry {
  float at = 0.0f;           ///< distance from the light, or from where its rays begin
  glm::vec3 depth{0.0f};     ///< optical depth of the media up to there; linear between entries
  glm::vec3 surfaces{1.0f};  ///< transmittance of the surfaces up to there, with those there
};

/// The rays of a tile of a shadow map.
struct ShadowTile {
  std::vector<std::uint32_t> ends;  ///< of each pixel in `entries`; empty: no ray meets anything
  std::vector<ShadowEntry> entries;

  [[nodiscard]] std::span<const ShadowEntry> ray(std::uint32_t pixel) const {
    if (ends.empty()) return {};
    const std::uint32_t begin = pixel == 0 ? 0 : ends[pixel - 1];
    return std::span(entries).subspan(begin, ends[pixel] - begin);
  }
};

}  // namespace strata::transparency
