#pragma once

#include "strata/transparency/stream/technique.h"

// Techniques with slots. A new one is a file and a line here and in all_techniques.cpp.

namespace strata::transparency {

extern const Technique kStencilRouted;
extern const Technique kFreePipeSorted;
extern const Technique kFreePipeCounter;
extern const Technique kBucketSort;
extern const Technique kAdaptiveBucketSort;
extern const Technique kKBuffer;
extern const Technique kZ3;

}  // namespace strata::transparency
