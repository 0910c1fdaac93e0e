#pragma once

#include <cstdint>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/surface/surface_image.h"

namespace strata::csg {

/// A tree in a view, prepared for its surfaces to be found; for the sources of this library.
struct FrameInput;

/// Finds visible surfaces elsewhere than in the tiles of this process's threads: on a GPU. The same
/// surfaces, bit for bit.
class SurfaceSource {
 public:
  virtual ~SurfaceSource() = default;

  /// Fills `image`, which has the view's size, except for the tiles that it appends to `left`: the
  /// CPU finds the surfaces of those. Adds to `report`. Called by one thread at a time.
  /// @return kLimit, kInternal, kCancelled
  virtual Result<void> find(const FrameInput& frame, SurfaceImage& image, DrawReport& report,
                            std::vector<std::uint32_t>& left, const Execution& execution) = 0;
};

}  // namespace strata::csg
