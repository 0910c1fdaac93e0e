// Depth lists (strata ldi -o x.exr, x.npz) as voxels: a voxel is solid where the winding number at
// its centre is above 0, as `strata voxelize` decides for closed meshes. A voxel has 256 depth
// steps.

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "strata/core/depth_list.h"
#include "strata/hashbuffer/formats/ldi_io.h"
#include "voxelize/readers/readers.h"
#include "voxelize/volume/tile_runs.h"

namespace strata {
namespace {

constexpr int kSteps = 256;  // of depth, a voxel

/// How an image lies in the world.
struct ListFrame {
  VoxelGrid grid;
  Axis axis = Axis::kZ;
  bool backwards = false;  ///< depth grows towards smaller coordinates
};

/// Nothing unless rays run along an axis and pixels along the two others.
std::optional<ListFrame> frame_of(const LayeredDepthImage& image) {
  const glm::dmat4& m = image.world_from_image;
  ListFrame frame;
  const auto only = [&](int column, int row) {
    for (int other = 0; other < 3; ++other) {
      if (other != row && m[column][other] != 0.0) return false;
    }
    return m[column][row] != 0.0 && m[column][3] == 0.0;
  };
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    const AxisFrame names(axis);
    if (!only(2, names.w) || !only(0, names.u) || !only(1, names.v)) continue;
    if (m[0][names.u] < 0.0 || m[1][names.v] < 0.0 || m[3][3] != 1.0) return std::nullopt;
    frame.axis = axis;
    frame.backwards = m[2][names.w] < 0.0;
    const int depth = static_cast<int>((image.depth_limit + kSteps - 1) / kSteps);
    frame.grid.dims[names.u] = image.width;
    frame.grid.dims[names.v] = image.height;
    frame.grid.dims[names.w] = depth;
    frame.grid.voxel_size[names.u] = m[0][names.u];
    frame.grid.voxel_size[names.v] = m[1][names.v];
    frame.grid.voxel_size[names.w] = std::abs(m[2][names.w]) * kSteps;
    frame.grid.origin = glm::dvec3(m[3]);
    if (frame.backwards) frame.grid.origin[names.w] -= depth * frame.grid.voxel_size[names.w];
    return frame;
  }
  return std::nullopt;
}

// The first voxel whose centre lies behind the depth.
int voxel_behind(std::uint32_t depth) {
  return depth < kSteps / 2 ? 0 : static_cast<int>((depth - kSteps / 2) / kSteps) + 1;
}

void add_list(std::span<const DepthItem> list, int depth, bool backwards, unsigned local,
              TileRuns& runs) {
  std::int64_t winding = 0;
  int begin = 0;
  for (const DepthItem item : list) {
    const bool was_inside = winding > 0;
    winding += item.exit() ? -1 : 1;
    if ((winding > 0) == was_inside) continue;
    const int at = std::min(voxel_behind(item.depth()), depth);
    if (!was_inside) {
      begin = at;
    } else if (at > begin) {
      if (backwards) {
        runs.add(local, depth - at, depth - 1 - begin, 1);
      } else {
        runs.add(local, begin, at - 1, 1);
      }
    }
  }
}

}  // namespace

Result<VoxelVolume> read_list_voxels(ReadContext& context, bool exr) {
  Execution execution = context.execution;
  execution.memory_limit = context.budget.limit();
  const Result<LayeredDepthImage> image =
      exr ? read_ldi_exr(context.path, execution) : read_ldi_npz(context.path, execution);
  if (!image) return tl::unexpected(image.error());
  const std::optional<ListFrame> frame = frame_of(*image);
  if (!frame) {
    return fail(ErrorCode::kInput,
                "{}: its rays do not run along an axis; lists of `strata ldi` are read as voxels",
                context.path);
  }
  const glm::ivec3 dims = frame->grid.dims;
  if (auto fits = check_dims(context, dims.x, dims.y, dims.z); !fits) {
    return tl::unexpected(fits.error());
  }
  if (auto place = check_place(context, frame->grid); !place) return tl::unexpected(place.error());
  VoxelVolume volume;
  volume.set = VoxelIntervals(frame->grid, frame->axis);
  volume.kind = VoxelKind::kLists;
  volume.format = "ldi";
  volume.type = "lists";
  TileRuns runs;
  const int depth = dims[static_cast<int>(frame->axis)];
  for (int tv = 0; tv < volume.set.tiles_v(); ++tv) {
    if (context.stopped()) return context.cancelled();
    for (int tu = 0; tu < volume.set.tiles_u(); ++tu) {
      for (int v = tv * kTileSide; v < std::min((tv + 1) * kTileSide, image->height); ++v) {
        for (int u = tu * kTileSide; u < std::min((tu + 1) * kTileSide, image->width); ++u) {
          const auto local = static_cast<unsigned>(v % kTileSide * kTileSide + u % kTileSide);
          add_list(image->list(u, v), depth, frame->backwards, local, runs);
        }
      }
      runs.store(volume.set, tu, tv, false);
    }
  }
  return volume;
}

}  // namespace strata
