#include "strata/hashbuffer/build_ldi.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

#include "hashbuffer/tile_builder.h"

namespace strata {
namespace {

/// The lists of one tile, packed: a length for each pixel, and the items in pixel order.
struct PackedTile {
  std::vector<std::uint32_t> lengths;
  std::vector<DepthItem> items;
};

PackedTile pack(const TileLists<DepthItem>& lists) {
  PackedTile tile;
  tile.lengths.resize(kTilePixels);
  tile.items.reserve(lists.fragments);
  for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
    const std::size_t before = tile.items.size();
    for_each_item(lists, pixel, [&](DepthItem item) { tile.items.push_back(item); });
    tile.lengths[pixel] = static_cast<std::uint32_t>(tile.items.size() - before);
  }
  return tile;
}

/// Appends `rows` rows, of which `tiles` are the tiles row by row, to an image.
void append(std::span<const PackedTile> tiles, int rows, LayeredDepthImage& image) {
  const auto tiles_u = static_cast<std::size_t>((image.width + kTileSide - 1) / kTileSide);
  std::uint64_t fragments = 0;
  for (const PackedTile& tile : tiles) fragments += tile.items.size();
  image.items.reserve(image.items.size() + fragments);
  std::vector<std::size_t> cursor(tiles.size(), 0);
  for (int v = 0; v < rows; ++v) {
    for (int u = 0; u < image.width; u += kTileSide) {
      const std::size_t index = static_cast<std::size_t>(v / kTileSide) * tiles_u +
                                static_cast<std::size_t>(u / kTileSide);
      const PackedTile& tile = tiles[index];
      const auto row = static_cast<std::size_t>(v % kTileSide) * kTileSide;
      std::size_t length = 0;
      for (std::size_t i = 0; i < static_cast<std::size_t>(std::min(kTileSide, image.width - u));
           ++i) {
        length += tile.lengths.empty() ? 0 : tile.lengths[row + i];
        image.offsets.push_back(image.items.size() + length);
      }
      const auto first = tile.items.begin() + static_cast<std::ptrdiff_t>(cursor[index]);
      image.items.insert(image.items.end(), first, first + static_cast<std::ptrdiff_t>(length));
      cursor[index] += length;
    }
  }
}

/// An image without rows, and room for all of them.
LayeredDepthImage empty_image(const RasterTarget& target) {
  LayeredDepthImage image;
  image.width = target.width;
  image.height = target.height;
  image.depth_limit = target.depth_limit;
  image.offsets.reserve(
      static_cast<std::size_t>(target.width) * static_cast<std::size_t>(target.height) + 1);
  image.offsets.push_back(0);
  return image;
}

Error too_much(const RasterTarget& target, std::uint64_t limit, std::uint64_t held) {
  return {ErrorCode::kLimit,
          fmt::format("the depth lists of {} x {} pixels need more than the memory limit of {} "
                      "bytes; they had reached {} bytes",
                      target.width, target.height, limit, held)};
}

}  // namespace

Result<LayeredDepthImage> build_ldi(const LatticeMesh& mesh, const RasterTarget& target,
                                    const TileStoreOptions& options, const Execution& execution,
                                    const TileListFilter* filter) {
  const auto bins = bin_triangles(mesh, target, execution);
  if (!bins) return tl::unexpected(bins.error());
  const auto tiles_u = static_cast<std::size_t>(bins->tiles_u);
  std::vector<PackedTile> tiles(tiles_u * static_cast<std::size_t>(bins->tiles_v));
  std::vector<ItemTileBuilder> builders;
  std::vector<std::unique_ptr<TileListFilter::Worker>> filters;
  for (int i = 0; i < execution.thread_count(); ++i) {
    builders.emplace_back(options);
    if (filter != nullptr) filters.push_back(filter->worker());
  }

  std::mutex failure_mutex;
  Result<void> status;
  std::atomic<std::uint64_t> bytes{0};
  std::atomic<std::size_t> finished{0};
  const auto refuse = [&](Error error) {
    const std::lock_guard lock(failure_mutex);
    if (status) status = tl::unexpected(std::move(error));
  };
  try {
    parallel_for(execution, tiles.size(), [&](std::size_t index, int worker) {
      const auto tu = static_cast<int>(index % tiles_u), tv = static_cast<int>(index / tiles_u);
      const auto triangles = bins->tile(tu, tv);
      ++finished;
      if (triangles.empty()) return;
      auto lists =
          builders[static_cast<std::size_t>(worker)].build(mesh, target, triangles, tu, tv);
      if (!lists) return refuse(lists.error());
      if (filter != nullptr) *lists = filters[static_cast<std::size_t>(worker)]->apply(*lists);
      // Packed once by tile and once as an image.
      const std::uint64_t held = bytes += 2 * lists->fragments * sizeof(DepthItem);
      if (execution.memory_limit > 0 && held > execution.memory_limit) {
        return refuse(too_much(target, execution.memory_limit, held));
      }
      tiles[index] = pack(*lists);
      if (execution.progress && worker == 0) {
        execution.progress(static_cast<double>(finished) / static_cast<double>(tiles.size()));
      }
    });
    if (!status) return tl::unexpected(status.error());
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");

    LayeredDepthImage image = empty_image(target);
    append(tiles, target.height, image);
    return image;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "out of memory for the depth lists of {} x {} pixels",
                target.width, target.height);
  }
}

Result<LayeredDepthImage> filter_lists(const LayeredDepthImage& rows, const TileListFilter& filter,
                                       const Execution& execution) {
  try {
    std::vector<std::unique_ptr<TileListFilter::Worker>> filters;
    std::vector<TileCutter> cutters(static_cast<std::size_t>(execution.thread_count()));
    for (std::size_t i = 0; i < cutters.size(); ++i) filters.push_back(filter.worker());
    const auto tiles_u = static_cast<std::size_t>((rows.width + kTileSide - 1) / kTileSide);
    const auto tiles_v = static_cast<std::size_t>((rows.height + kTileSide - 1) / kTileSide);
    std::vector<PackedTile> tiles(tiles_u * tiles_v);
    parallel_for(execution, tiles.size(), [&](std::size_t index, int worker) {
      const auto lists = cutters[static_cast<std::size_t>(worker)].cut(
          rows, 0, static_cast<int>(index % tiles_u), static_cast<int>(index / tiles_u));
      if (lists.fragments == 0) return;
      tiles[index] = pack(filters[static_cast<std::size_t>(worker)]->apply(lists));
    });
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    LayeredDepthImage image = empty_image({Axis::kZ, rows.width, rows.height, rows.depth_limit});
    append(tiles, rows.height, image);
    return image;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "out of memory for the depth lists of {} x {} pixels",
                rows.width, rows.height);
  }
}

Result<LayeredDepthImage> build_ldi(ListSource& source, const LatticeMesh& mesh,
                                    const RasterTarget& target, const Execution& execution,
                                    const TileListFilter* filter) {
  if (auto set = source.set_mesh(mesh); !set) return tl::unexpected(set.error());
  const bool left = filter != nullptr && !source.use_filter(*filter);
  try {
    LayeredDepthImage image = empty_image(target);
    const int step = source.rows_at_once(target);
    for (int v = 0; v < target.height; v += step) {
      const int end = std::min(target.height, v + step);
      auto rows = source.lists(target, v, end);
      if (!rows) return tl::unexpected(rows.error());
      if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
      const std::uint64_t held = (image.items.size() + 2 * rows->items.size()) * sizeof(DepthItem);
      if (execution.memory_limit > 0 && held > execution.memory_limit) {
        return tl::unexpected(too_much(target, execution.memory_limit, held));
      }
      if (left) rows = filter_lists(*rows, *filter, execution);
      if (!rows) return tl::unexpected(rows.error());
      for (std::size_t i = 1; i < rows->offsets.size(); ++i) {
        image.offsets.push_back(image.items.size() + rows->offsets[i]);
      }
      image.items.insert(image.items.end(), rows->items.begin(), rows->items.end());
      if (execution.progress) execution.progress(static_cast<double>(end) / target.height);
    }
    return image;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "out of memory for the depth lists of {} x {} pixels",
                target.width, target.height);
  }
}

RasterTarget raster_target(const VoxelGrid& grid, Axis axis) {
  const AxisFrame frame(axis);
  return {axis, grid.dims[frame.u], grid.dims[frame.v],
          static_cast<std::uint32_t>(grid.dims[frame.w]) * kLatticeSteps};
}

glm::dmat4 world_from_image(const VoxelGrid& grid, Axis axis) {
  const AxisFrame frame(axis);
  glm::dmat4 m(0.0);  // m[column][row]
  m[0][frame.u] = grid.voxel_size[frame.u];
  m[1][frame.v] = grid.voxel_size[frame.v];
  m[2][frame.w] = grid.voxel_size[frame.w] / kLatticeSteps;
  m[3] = glm::dvec4(grid.origin, 1.0);
  return m;
}

}  // namespace strata
