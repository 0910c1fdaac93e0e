// binvox (Min, patrickmin.com/binvox/binvox.html): run lengths of bytes, y fastest, then z, then x,
// straight to intervals along y.

#include <algorithm>
#include <charconv>
#include <string>
#include <vector>

#include "voxelize/readers/readers.h"
#include "voxelize/volume/tile_runs.h"

namespace strata {
namespace {

/// What stands before `data`.
struct BinvoxHead {
  VoxelGrid grid;
  bool placed = false;
  std::size_t data = 0;
};

/// Numbers after a word. @return false if there are not as many
bool numbers(std::string_view text, std::size_t count, double* to) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t start = text.find_first_not_of(" \t\r");
    if (start == std::string_view::npos) return false;
    text.remove_prefix(start);
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), to[i]);
    if (error != std::errc()) return false;
    text.remove_prefix(static_cast<std::size_t>(rest - text.data()));
  }
  return true;
}

Result<BinvoxHead> parse_binvox_head(const ReadContext& context) {
  BinvoxHead head;
  double dims[3] = {}, translate[3] = {}, scale = 1.0;
  bool has_dims = false, has_translate = false, has_scale = false;
  int number = 0;
  for (std::size_t at = 0; at < context.bytes.size();) {
    const std::size_t end = context.bytes.find('\n', at);
    if (end == std::string_view::npos) break;
    const std::string_view line = context.bytes.substr(at, end - at);
    at = end + 1;
    ++number;
    if (number == 1 && !line.starts_with("#binvox")) {
      return fail(ErrorCode::kInput, "{}:1: no .binvox file: it does not begin with #binvox",
                  context.path);
    }
    bool right = true;
    if (line.starts_with("dim")) right = has_dims = numbers(line.substr(3), 3, dims);
    if (line.starts_with("translate"))
      right = has_translate = numbers(line.substr(9), 3, translate);
    if (line.starts_with("scale")) right = has_scale = numbers(line.substr(5), 1, &scale);
    if (!right) {
      return fail(ErrorCode::kInput, "{}:{}: '{}' must have {} numbers", context.path, number,
                  line.substr(0, 60), line.starts_with("scale") ? 1 : 3);
    }
    if (!line.starts_with("data")) continue;
    if (!has_dims) return fail(ErrorCode::kInput, "{}:{}: data before dim", context.path, number);
    head.data = at;
    // dim is depth (x), height (z), width (y).
    const double sides[3] = {dims[0], dims[2], dims[1]};
    for (int axis = 0; axis < 3; ++axis) {
      if (!(sides[axis] >= 1.0) || sides[axis] > kMaxGridSide) {
        return fail(ErrorCode::kInput, "{}: dim is {} {} {}; each must be 1 to {}", context.path,
                    dims[0], dims[1], dims[2], kMaxGridSide);
      }
      head.grid.dims[axis] = static_cast<int>(sides[axis]);
      head.grid.origin[axis] = translate[axis];
      head.grid.voxel_size[axis] = scale / std::max({dims[0], dims[1], dims[2]});
    }
    head.placed = has_translate && has_scale;
    return head;
  }
  return fail(ErrorCode::kInput, "{}: the header has no line 'data'", context.path);
}

}  // namespace

Result<VoxelVolume> read_binvox_voxels(ReadContext& context) {
  const Result<BinvoxHead> head = parse_binvox_head(context);
  if (!head) return tl::unexpected(head.error());
  if (auto place = check_place(context, head->grid); !place) return tl::unexpected(place.error());
  const glm::ivec3 dims = head->grid.dims;
  VoxelVolume volume;
  volume.set = VoxelIntervals(head->grid, Axis::kY);
  volume.type = "bool";
  volume.placed = head->placed;
  std::vector<TileRuns> tiles(static_cast<std::size_t>(volume.set.tiles_v()));
  const auto store = [&](int tu) {
    for (std::size_t tv = 0; tv < tiles.size(); ++tv) {
      if (tiles[tv].empty()) continue;
      if (!context.budget.take(tiles[tv].pieces() * sizeof(Interval) +
                               VoxelIntervals::kTileColumns * sizeof(std::uint32_t))) {
        return false;
      }
      tiles[tv].store(volume.set, tu, static_cast<int>(tv), false);
    }
    return true;
  };
  ByteCursor cursor(context.bytes, head->data);
  glm::ivec3 at(0);
  while (at.x < dims.x) {
    const std::uint64_t place = cursor.at();
    const auto value = cursor.get<std::uint8_t>(), count = cursor.get<std::uint8_t>();
    if (cursor.failed()) {
      return fail(ErrorCode::kInput,
                  "{}: byte {}: the file ends at voxel ({}, {}, {}) of {} x {} x {}", context.path,
                  place, at.x, at.y, at.z, dims.x, dims.y, dims.z);
    }
    for (int left = count; left > 0;) {
      if (at.x == dims.x) {
        return fail(ErrorCode::kInput, "{}: byte {}: {} voxels more than {} x {} x {}",
                    context.path, place, left, dims.x, dims.y, dims.z);
      }
      const int length = std::min(left, dims.y - at.y);
      if (value != 0) {
        const auto local = static_cast<unsigned>(at.z % kTileSide * kTileSide + at.x % kTileSide);
        tiles[static_cast<std::size_t>(at.z / kTileSide)].add(local, at.y, at.y + length - 1, 1);
      }
      left -= length;
      at.y += length;
      if (at.y < dims.y) continue;
      at.y = 0;
      if (++at.z < dims.z) continue;
      at.z = 0;
      ++at.x;
      if (at.x % kTileSide != 0 && at.x != dims.x) continue;
      if (context.stopped()) return context.cancelled();
      if (!store((at.x - 1) / kTileSide)) return context.too_large("the runs of voxels");
    }
  }
  return volume;
}

}  // namespace strata
