#pragma once

#include "strata/core/depth_list.h"
#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/list_filter.h"
#include "strata/hashbuffer/list_source.h"
#include "strata/hashbuffer/tile_lists.h"
#include "strata/raster/lattice_mesh.h"

namespace strata {

/// The sorted depth lists of a snapped mesh seen along an axis: every crossing of every pixel's
/// ray, with its triangle. Same bits for any store, offsets, number of threads and order of
/// triangles (up to the triangles' numbers). world_from_image is left as the identity. `filter`, if
/// given, transforms the lists tile by tile.
/// @return kLimit when the lists outgrow execution.memory_limit or memory, kCancelled
Result<LayeredDepthImage> build_ldi(const LatticeMesh& mesh, const RasterTarget& target,
                                    const TileStoreOptions& options = {},
                                    const Execution& execution = {},
                                    const TileListFilter* filter = nullptr);

/// The same lists from `source`.
Result<LayeredDepthImage> build_ldi(ListSource& source, const LatticeMesh& mesh,
                                    const RasterTarget& target, const Execution& execution = {},
                                    const TileListFilter* filter = nullptr);

/// Applies `filter` to the lists of an image of rows. @return kLimit without the memory, kCancelled
Result<LayeredDepthImage> filter_lists(const LayeredDepthImage& rows, const TileListFilter& filter,
                                       const Execution& execution = {});

/// The image of the rays through the voxel columns of a grid along `axis`.
[[nodiscard]] RasterTarget raster_target(const VoxelGrid& grid, Axis axis);

/// The world_from_image of such lists (see LayeredDepthImage).
[[nodiscard]] glm::dmat4 world_from_image(const VoxelGrid& grid, Axis axis);

}  // namespace strata
