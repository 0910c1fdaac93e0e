#pragma once

#include "strata/transparency/stream/technique.h"

// Techniques that keep whole lists. A new one is a file and a line here and in all_techniques.cpp.

namespace strata::transparency {

extern const Technique kCountScan;

}  // namespace strata::transparency
