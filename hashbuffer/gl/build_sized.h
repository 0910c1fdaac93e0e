#pragma once

#include "raster/gl/compute.h"
#include "strata/hashbuffer/gl/store.h"

// Private to the GL parts.

namespace strata::gl {

/// build(store, rasterizer), after a pass that counts where the store gains by the hint; the
/// report's fragments are told then too.
[[nodiscard]] Result<BuildReport> build_sized(Store& store, ComputeRasterizer& rasterizer,
                                              const Execution& execution = {});

}  // namespace strata::gl
