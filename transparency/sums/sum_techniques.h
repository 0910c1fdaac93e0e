#pragma once

#include "strata/transparency/stream/technique.h"

// Techniques of sums and of random samples. A new one is a file and a line here and in
// all_techniques.cpp.

namespace strata::transparency {

extern const Technique kWeightedSum;
extern const Technique kWeightedAverage;
extern const Technique kWeightedBlended;
extern const Technique kMoments;
extern const Technique kStochastic;
extern const Technique kScreenDoor;
extern const Technique kSilhouetteOpaque;

}  // namespace strata::transparency
