#pragma once

#include "strata/transparency/stream/technique.h"

// Techniques that find a layer at a time. A new one is a file and a line here and in
// all_techniques.cpp.

namespace strata::transparency {

extern const Technique kFBuffer;
extern const Technique kRBuffer;
extern const Technique kVirtualPixelMaps;
extern const Technique kDepthPeeling;
extern const Technique kDualPeeling;
extern const Technique kReversePeeling;

/// No pixel has so many layers.
inline constexpr unsigned kMostPasses = 1'000'000'000;

}  // namespace strata::transparency
