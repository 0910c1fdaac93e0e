#pragma once

#include <vector>

#include "strata/core/execution.h"
#include "strata/picture/pixels.h"

namespace strata {

/// Values of the pixels of a picture; NaN where there is none.
struct ValueImage {
  int width = 0, height = 0;
  std::vector<float> values;
};

/// The distance between lines: 1, 2 or 5 times a power of ten, so that about ten lines are seen.
[[nodiscard]] double isoline_step(const ValueImage& image);

/// Draws signed distances: blue where they are below 0, orange where they are above, lines at the
/// multiples of `step`, a thick one at 0, and numbers on the lines.
void draw_isolines(const ValueImage& image, double step, Picture& picture,
                   const Execution& execution);

}  // namespace strata
