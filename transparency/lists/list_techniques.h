#pragma once

#include "strata/transparency/stream/technique.h"

// Techniques that keep whole lists. A new one is a file and a line here and in all_techniques.cpp.

namespace strata::transparency {

extern const Technique kHash64, kHash64Cas, kHash64Grown, kHash64Fixed, kHash32;
extern const Technique kHash64Culled, kHash64Nearest;
extern const Technique kCountScan, kTransmittanceForm, kDeepFrameBuffer, kSBuffer;
extern const Technique kCoverageMasks;
extern const Technique kFixedArray, kFixedArrayBounded;
extern const Technique kLinkedLists, kLinkedListsGrow, kMlabABuffer;
extern const Technique kPagedLists, kPagedListsGrow;

}  // namespace strata::transparency
