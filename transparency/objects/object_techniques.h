#pragma once

#include "strata/transparency/stream/technique.h"

// Techniques that sort what is drawn. A new one is a file and a line here and in
// all_techniques.cpp.

namespace strata::transparency {

extern const Technique kObjectSort;
extern const Technique kPrimitiveSort;
extern const Technique kVisibilityQueries;

}  // namespace strata::transparency
