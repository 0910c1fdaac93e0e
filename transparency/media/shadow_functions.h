#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "strata/core/execution.h"
#include "strata/transparency/media/media.h"
#include "transparency/media/shadow_tile.h"
#include "transparency/stream/visibility.h"

namespace strata::transparency {

/// What of the light comes through along each ray of a shadow map, in a fixed number of words a
/// ray; grey.
class ShadowFunctions {
 public:
  virtual ~ShadowFunctions() = default;
  /// @param distance  along the ray
  [[nodiscard]] virtual float through(int tile, std::uint32_t pixel, float distance) const = 0;
};

/// Makes the functions of all rays and empties their lists. @pre the light's visibility is not
/// kLists @param range  of distances along the rays
[[nodiscard]] std::unique_ptr<ShadowFunctions> make_shadow_functions(const MediaLight& light,
                                                                     std::vector<ShadowTile>& tiles,
                                                                     const DepthRange& range,
                                                                     const Execution& execution);

}  // namespace strata::transparency
