#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "csg/geometry.h"
#include "csg/program.h"
#include "csg/surface/visible_surface.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/surface/surface_image.h"

// The seam between a preview and what finds its surfaces elsewhere. Private to csg/.

namespace strata::csg {

/// A tree in a view, prepared for its surfaces to be found.
struct FrameInput {
  const Program& program;
  const std::vector<Geometry::Part>& parts;
  const std::vector<ViewPart>& view_parts;
  const View& view;
  const Coincidence& coincidence;
  int tiles_u, tiles_v;
  /// Solids that may be met in tile t: tile_solids[tile_offsets[t] .. tile_offsets[t + 1]),
  /// increasing.
  std::span<const std::uint32_t> tile_offsets, tile_solids;

  [[nodiscard]] std::span<const std::uint32_t> solids(std::uint32_t tile) const {
    return tile_solids.subspan(tile_offsets[tile], tile_offsets[tile + 1] - tile_offsets[tile]);
  }
};

/// Finds visible surfaces elsewhere than in the tiles of this process's threads: on a GPU. The same
/// surfaces, bit for bit.
class SurfaceSource {
 public:
  virtual ~SurfaceSource() = default;

  /// Fills `image`, which has the view's size, but for the tiles that it appends to `left`: those
  /// are found as if it were not there. Adds to `report`. Called by one thread at a time.
  /// @return kLimit, kInternal, kCancelled
  virtual Result<void> find(const FrameInput& frame, SurfaceImage& image, DrawReport& report,
                            std::vector<std::uint32_t>& left, const Execution& execution) = 0;
};

}  // namespace strata::csg
