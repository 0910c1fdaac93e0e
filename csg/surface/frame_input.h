#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "csg/geometry.h"
#include "csg/program.h"
#include "csg/surface/visible_surface.h"

// What a SurfaceSource is given. Private to csg/.

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

}  // namespace strata::csg
