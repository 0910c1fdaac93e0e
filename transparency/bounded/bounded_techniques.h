#pragma once

#include "strata/transparency/stream/technique.h"

// Techniques with bounded memory. A new one is a file and a line here and in all_techniques.cpp.
//
// Their papers need critical sections on a GPU, in the order of the primitives (B. "pixel
// synchronization"), since a pixel's rows are read, changed and written. Here a tile is one
// thread's, and its stream has the order of the primitives: nothing is needed.

namespace strata::transparency {

extern const Technique kRelaxed;
extern const Technique kMlab;
extern const Technique kMlabPacked;
extern const Technique kHybrid;
extern const Technique kHybridPacked;
extern const Technique kAdaptive;
extern const Technique kAdaptiveLists;
extern const Technique kOpacityMap;
extern const Technique kOccupancyMap;
extern const Technique kFourierMap;

}  // namespace strata::transparency
