// A folder of PNG slices with a slices.json, as write_slices.cpp makes it: a grey picture a layer
// of z, rows along y in either order.

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "mesh/text/input_bytes.h"
#include "voxelize/readers/readers.h"
#include "voxelize/volume/dense_array.h"
#include "voxelize/volume/grey_png.h"
#include "voxelize/volume/tile_runs.h"

namespace strata {
namespace {

struct SliceFolder {
  VoxelGrid grid;
  bool descending = true;     // rows
  bool mirrored = false;      // columns descend
  bool shares = false;        // greys are filled fractions
  double gamma = 1.0;         // of them
  std::string before, after;  // of the number in a file's name
  int digits = 0;

  [[nodiscard]] std::string file(int z) const {
    return before + fmt::format("{:0{}d}", z, digits) + after;
  }
};

Result<SliceFolder> read_description(const ReadContext& context) {
  const std::string path = context.path + "/slices.json";
  const Result<JsonValue> json = read_json_file(path, context.execution);
  if (!json) return tl::unexpected(json.error());
  SliceFolder folder;
  const auto dims = json->numbers("dims", 3), origin = json->numbers("origin", 3);
  const auto size = json->numbers("voxel_size", 3);
  if (!dims || !origin || !size) {
    return fail(ErrorCode::kInput, "{}: dims, origin and voxel_size must be 3 numbers each", path);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    if (!((*dims)[i] >= 1.0 && (*dims)[i] <= kMaxGridSide)) {
      return fail(ErrorCode::kInput, "{}: dims {} x {} x {}; each must be 1 to {}", path,
                  (*dims)[0], (*dims)[1], (*dims)[2], kMaxGridSide);
    }
    folder.grid.dims[axis] = static_cast<int>((*dims)[i]);
    folder.grid.origin[axis] = (*origin)[i];
    folder.grid.voxel_size[axis] = (*size)[i];
  }
  const JsonValue* order = json->find("row_order");
  folder.descending = order == nullptr || order->text != "ascending";
  const JsonValue* columns = json->find("column_order");
  folder.mirrored = columns != nullptr && columns->text == "descending";
  folder.shares = json->find("full") != nullptr;
  const JsonValue* gamma = json->find("gamma");
  if (gamma != nullptr && gamma->number > 0.0) folder.gamma = gamma->number;
  const JsonValue* across = json->find("slice_axis");
  if (across != nullptr && across->text != "z") {
    return fail(ErrorCode::kInput, "{}: slice_axis must be z to be read, got '{}'", path,
                across->text.substr(0, 20));
  }
  const JsonValue* name = json->find("slices");
  const std::string pattern = name == nullptr ? "slice_%05d.png" : name->text;
  const std::size_t percent = pattern.find("%0");
  const bool fits = percent != std::string::npos && percent + 3 < pattern.size() &&
                    pattern[percent + 2] >= '1' && pattern[percent + 2] <= '9' &&
                    pattern[percent + 3] == 'd' && pattern.find('/') == std::string::npos;
  if (!fits) {
    return fail(ErrorCode::kInput, "{}: slices must be a name like 'slice_%05d.png', got '{}'",
                path, pattern.substr(0, 60));
  }
  folder.before = context.path + "/" + pattern.substr(0, percent);
  folder.digits = pattern[percent + 2] - '0';
  folder.after = pattern.substr(percent + 4);
  if (auto place = check_place(context, folder.grid); !place) return tl::unexpected(place.error());
  return folder;
}

/// The pictures of 64 layers, which are a row of tiles.
class SlabOfSlices {
 public:
  SlabOfSlices(ReadContext& context, const SliceFolder& folder, VoxelIntervals& set)
      : context_(context),
        folder_(folder),
        set_(set),
        tiles_(static_cast<std::size_t>(set.tiles_u())) {}

  /// @param bits  of the first picture
  Result<void> read(int tv, int bits) {
    const glm::ivec3 dims = folder_.grid.dims;
    for (int z = tv * kTileSide; z < std::min((tv + 1) * kTileSide, dims.z); ++z) {
      if (context_.stopped()) return context_.cancelled();
      if (auto read = read_layer(z, bits); !read) return read;
    }
    for (std::size_t tu = 0; tu < tiles_.size(); ++tu) {
      if (tiles_[tu].empty()) continue;
      const std::uint64_t item = bits == 1 ? sizeof(Interval) : 2 * sizeof(Interval);
      if (!context_.budget.take(tiles_[tu].pieces() * item +
                                VoxelIntervals::kTileColumns * sizeof(std::uint32_t))) {
        return context_.too_large("the runs of voxels");
      }
      tiles_[tu].store(set_, static_cast<int>(tu), tv, bits != 1);
    }
    return {};
  }

 private:
  Result<void> read_layer(int z, int bits) {
    const std::string path = folder_.file(z);
    const auto file = detail::InputBytes::open(path, context_.execution.memory_limit);
    if (!file) return tl::unexpected(file.error());
    const Result<GreyPng> png = GreyPng::open(file->view(), path);
    if (!png) return tl::unexpected(png.error());
    const glm::ivec3 dims = folder_.grid.dims;
    if (png->width() != dims.x || png->height() != dims.y || png->bits() != bits) {
      return fail(ErrorCode::kInput, "{}: {} x {} pixels of {} bits; {} x {} of {} are needed",
                  path, png->width(), png->height(), png->bits(), dims.x, dims.y, bits);
    }
    const Result<std::vector<std::uint16_t>> pixels = png->pixels();
    if (!pixels) return tl::unexpected(pixels.error());
    for (int row = 0; row < dims.y; ++row) {
      const int y = folder_.descending ? dims.y - 1 - row : row;
      const std::uint16_t* from =
          pixels->data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(dims.x);
      TileRuns& tile = tiles_[static_cast<std::size_t>(y / kTileSide)];
      const auto local = static_cast<unsigned>(z % kTileSide * kTileSide + y % kTileSide);
      const auto pixel = [&](int x) { return from[folder_.mirrored ? dims.x - 1 - x : x]; };
      for (int x = 0; x < dims.x;) {
        int past = x + 1;
        while (past < dims.x && pixel(past) == pixel(x)) ++past;
        if (pixel(x) != 0) tile.add(local, x, past - 1, pixel(x));
        x = past;
      }
    }
    return {};
  }

  ReadContext& context_;
  const SliceFolder& folder_;
  VoxelIntervals& set_;
  std::vector<TileRuns> tiles_;
};

}  // namespace

Result<VoxelVolume> read_slice_voxels(ReadContext& context) {
  const Result<SliceFolder> folder = read_description(context);
  if (!folder) return tl::unexpected(folder.error());
  const auto first = detail::InputBytes::open(folder->file(0), context.execution.memory_limit);
  if (!first) return tl::unexpected(first.error());
  const Result<GreyPng> png = GreyPng::open(first->view(), folder->file(0));
  if (!png) return tl::unexpected(png.error());
  VoxelVolume volume;
  volume.set = VoxelIntervals(folder->grid, Axis::kX);
  if (!context.budget.take(volume.set.memory_bytes())) return context.too_large("the grid");
  const int bits = png->bits();
  volume.type = bits == 1 ? "bool" : bits == 8 ? "uint8" : "uint16";
  std::vector<Result<void>> results(static_cast<std::size_t>(volume.set.tiles_v()));
  parallel_for(context.execution, results.size(), [&](std::size_t tv, int) {
    results[tv] = SlabOfSlices(context, *folder, volume.set).read(static_cast<int>(tv), bits);
  });
  if (context.stopped()) return context.cancelled();
  for (const Result<void>& result : results) {
    if (!result) return tl::unexpected(result.error());
  }
  if (bits != 1) {
    volume.kind = VoxelKind::kIds;
    settle_ids(volume, bits == 8 ? 255 : 65535);
  }
  const bool asked = context.options.integers == IntegerVoxels::kValues;
  const bool auto_shares = folder->shares && context.options.integers == IntegerVoxels::kAuto;
  if (bits == 8 && volume.kind == VoxelKind::kIds &&
      (asked || auto_shares || are_fractions(context, volume))) {
    std::array<float, 256> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] =
          static_cast<float>(255.0 * std::pow(static_cast<double>(i) / 255, 1 / folder->gamma));
    }
    if (auto done = labels_to_values(context, volume, values); !done) {
      return tl::unexpected(done.error());
    }
  }
  return volume;
}

}  // namespace strata
