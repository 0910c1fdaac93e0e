#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "csg/geometry.h"
#include "csg/program.h"
#include "csg/surface/tile_surface.h"
#include "csg/surface/visible_surface.h"
#include "raster/view_part.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"
#include "strata/raster/view.h"

// One tree of solids in one view, prepared for TileFinder. Private to csg/.

namespace strata::csg {

/// Which solids may be met in which tile.
struct TileSolids {
  std::vector<std::uint32_t> offsets, solids;

  void build(std::span<const ViewPart> parts, int tiles_u, int tiles_v);
  [[nodiscard]] std::span<const std::uint32_t> at(std::size_t tile) const {
    return std::span(solids).subspan(offsets[tile], offsets[tile + 1] - offsets[tile]);
  }
};

/// The solids of a program as a view sees them, and the tiles in which they may be met. Finders
/// keep references to its members.
struct SurfaceTiles {
  View view;
  Coincidence coincidence;
  int tiles_u = 0, tiles_v = 0;
  std::vector<ViewPart> view_parts;  ///< of each solid
  TileSolids solids;

  /// @param world_error  as Coincidence has it @return kGeometry, kCancelled
  Result<void> prepare(const Program& program, const Geometry& geometry, double world_error,
                       const View& of, const Execution& execution);
};

/// The view of pictures of a tree: make_view() of the box around `shown`. If solids surround the
/// eye, its depths begin at the nearest face in the picture. @param shown  nodes, the root first
/// @return as make_view()
Result<View> view_of_tree(const Tree& tree, const Geometry& geometry,
                          std::span<const Tree::NodeId> shown, const Camera& camera,
                          const glm::ivec2& size, const Execution& execution);

}  // namespace strata::csg
