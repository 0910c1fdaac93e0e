#pragma once

#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "hashbuffer/tile_builder.h"
#include "raster/triangle_setup.h"
#include "strata/core/depth_list.h"
#include "strata/raster/lattice_mesh.h"
#include "tests/support/voxel_set.h"

namespace strata::testkit {

/// The builder that makes lists of `Key`, DepthKey or DepthItem.
template <class Key>
using BuilderOf =
    std::conditional_t<std::is_same_v<Key, DepthKey>, KeyTileBuilder, ItemTileBuilder>;

/// The sorted lists of an image, row by row: offsets has width * height + 1 entries.
template <class Key>
struct Lists {
  std::vector<std::size_t> offsets{0};
  std::vector<Key> keys;
  std::uint64_t rebuilt_tiles = 0;

  [[nodiscard]] std::span<const Key> list(std::size_t pixel) const {
    return std::span(keys).subspan(offsets[pixel], offsets[pixel + 1] - offsets[pixel]);
  }
  /// The same lists; how they were built does not count.
  friend bool operator==(const Lists& a, const Lists& b) {
    return a.offsets == b.offsets && a.keys == b.keys;
  }
};

/// What rays along `axis` see of a grid.
[[nodiscard]] RasterTarget target_of(const VoxelGrid& grid, Axis axis);

/// By the reference rasterizer and std::sort. `Key` is DepthItem or DepthKey.
template <class Key>
[[nodiscard]] Lists<Key> reference_lists(const LatticeMesh& mesh, const RasterTarget& target);

/// Through bin_triangles() and the TileBuilder of `Key`, tile by tile.
template <class Key>
[[nodiscard]] Lists<Key> built_lists(const LatticeMesh& mesh, const RasterTarget& target,
                                     const TileStoreOptions& options = {});

/// The same through a builder that has seen other tiles.
template <class Builder>
[[nodiscard]] Lists<typename Builder::Key> built_lists(Builder& builder, const LatticeMesh& mesh,
                                                       const RasterTarget& target);

/// The winding number of each voxel centre from the crossings of rays along `axis`, by the
/// reference rasterizer. Depths are not sorted or merged: sums of signs.
using Winding = VoxelArray<std::int32_t>;
[[nodiscard]] Winding reference_winding(const LatticeMesh& mesh, const VoxelGrid& grid, Axis axis);

/// The same from lists along `axis`.
[[nodiscard]] Winding winding_of(const Lists<DepthItem>& lists, const VoxelGrid& grid, Axis axis);

/// Columns whose signs do not add up to 0.
[[nodiscard]] std::size_t unbalanced_lists(const Lists<DepthItem>& lists);
/// Columns with an odd number of crossings.
[[nodiscard]] std::size_t odd_lists(const Lists<DepthItem>& lists);
/// Columns where more was left than entered, somewhere on the way.
[[nodiscard]] std::size_t negative_lists(const Lists<DepthItem>& lists);

}  // namespace strata::testkit
