#pragma once

#include "strata/core/execution.h"
#include "strata/transparency/stream/frame.h"

namespace strata::transparency {

/// Settings of the filter.
struct FxaaOptions {
  /// An edge is blended if its contrast is this part of the brightest pixel about it; above 0.
  float contrast = 0.125f;
  float least_contrast = 0.03125f;  ///< and at least this; above 0
  float smoothing = 0.75f;          ///< of single pixels that stand out; 0: none, 1: all
  int search = 32;                  ///< pixels along an edge in which its ends are looked for; >= 1
};

/// Fast approximate anti-aliasing: blends pixels along edges with their neighbours across the edge,
/// as far as the ends of the edge say. It sees the picture alone. A pixel becomes a mean of itself
/// and one of its four neighbours, so nothing rings. Same bits for any number of threads.
[[nodiscard]] Image fxaa(const Image& image, const FxaaOptions& options = {},
                         const Execution& execution = {});

}  // namespace strata::transparency
