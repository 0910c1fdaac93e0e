#pragma once

#include "strata/gl/context.h"

namespace strata::bench {

/// Prints tables of the techniques of transparency on the GPU. @param budget  seconds a row
void transparency_tables(const gl::Context& context, double budget, bool small_only);

}  // namespace strata::bench
