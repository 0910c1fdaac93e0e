#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "raster/tile_bins.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/soup_tools.h"
#include "strata/raster/lattice_mesh.h"
#include "strata/raster/raster_target.h"
#include "strata/raster/view.h"

namespace strata {

/// A mesh in world space, borrowed.
struct PlacedMesh {
  std::span<const glm::dvec3> positions;
  std::span<const glm::uvec3> triangles;  ///< counter-clockwise from outside
  Bounds box;                             ///< around `positions`
};

/// A solid as a view sees it: vertices snapped to the image lattice, cut at the near plane where
/// that is needed, triangles sorted into tiles where they are many.
struct ViewPart {
  LatticeVertices vertices;
  std::vector<glm::uvec3> cut_triangles;    ///< instead of the part's, when it was cut
  std::vector<std::uint32_t> cut_sources;   ///< the part's triangle of each of those
  LatticeMesh mesh;                         ///< its vertices are moved out of `vertices`
  PixelRect rect;                           ///< pixels it may cover
  std::uint32_t nearest = 0, farthest = 0;  ///< bounds of its depths
  bool cut = false;                         ///< the near plane may cut it
  bool binned = false;
  TileBins bins;

  /// The part's triangle behind triangle `t` of `mesh`.
  [[nodiscard]] std::uint32_t source(std::uint32_t t) const { return cut ? cut_sources[t] : t; }
};

/// Snaps a part into the image lattice of `view` (law 3). @return kGeometry when coordinates do not
/// fit.
Result<ViewPart> view_part(const PlacedMesh& part, const View& view,
                           const Execution& execution = {});

}  // namespace strata
