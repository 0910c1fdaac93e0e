// A folder of PNG slices with a slices.json, as write_slices.cpp makes it: a picture a layer of z,
// grey or coloured, rows along y in either order. An .sl1 of a resin printer, which is an archive
// of such pictures with the settings of PrusaSlicer.

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mesh/text/input_bytes.h"
#include "voxelize/readers/readers.h"
#include "voxelize/volume/dense_array.h"
#include "voxelize/volume/inflate_stream.h"
#include "voxelize/volume/slice_png.h"
#include "voxelize/volume/tile_runs.h"
#include "voxelize/volume/zip_directory.h"

namespace strata {
namespace {

/// The bytes of a picture.
struct PictureBytes {
  MemoryLoan memory;
  std::optional<detail::InputBytes> file;
  std::optional<std::string> unpacked;
  std::string_view stored;  // in an archive

  [[nodiscard]] std::string_view view() const {
    return file ? file->view() : unpacked ? std::string_view(*unpacked) : stored;
  }
};

struct SliceFolder {
  std::string path;
  std::vector<ZipMember> members;  // pictures in an archive; empty: files of a folder
  VoxelGrid grid;
  bool descending = true;     // rows
  bool mirrored = false;      // columns descend
  bool shares = false;        // greys are filled fractions
  double gamma = 1.0;         // of them
  std::string before, after;  // of the number in a file's name
  int digits = 0;

  [[nodiscard]] std::string file(int z) const {
    if (!members.empty()) return path + ": " + members[static_cast<std::size_t>(z)].name;
    return before + fmt::format("{:0{}d}", z, digits) + after;
  }
  [[nodiscard]] Result<PictureBytes> bytes(int z, const ReadContext& context) const {
    PictureBytes made;
    if (members.empty()) {
      auto file_bytes = detail::InputBytes::open(file(z), context.execution.memory_limit);
      if (!file_bytes) return tl::unexpected(file_bytes.error());
      made.file = *std::move(file_bytes);
    } else {
      const ZipMember& member = members[static_cast<std::size_t>(z)];
      made.stored = member.packed;
      if (member.deflated) {
        auto unpacked = unpack(member, file(z), context, made.memory);
        if (!unpacked) return tl::unexpected(unpacked.error());
        made.unpacked = *std::move(unpacked);
      }
    }
    // SlicePng has a copy.
    if (!made.memory.take(context.budget, made.view().size())) {
      return context.too_large("a picture");
    }
    return made;
  }
  static Result<std::string> unpack(const ZipMember& member, const std::string& name,
                                    const ReadContext& context, MemoryLoan& memory) {
    constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;
    if (member.bytes > kMostBytes) {
      return fail(ErrorCode::kLimit, "{}: {} bytes unpacked; at most {} are read", name,
                  member.bytes, kMostBytes);
    }
    if (!memory.take(context.budget, member.bytes)) return context.too_large(member.name);
    if (!member.deflated) return std::string(member.packed);
    std::string bytes(member.bytes, '\0');
    InflateStream stream(member.packed, InflateStream::kBare, name);
    auto read = stream.read(reinterpret_cast<std::byte*>(bytes.data()), bytes.size());
    if (!read) return tl::unexpected(read.error());
    return bytes;
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

  /// @param first  the first picture, which the others are alike
  Result<void> read(int tv, const SlicePng& first) {
    const int bits = first.bits();
    const glm::ivec3 dims = folder_.grid.dims;
    for (int z = tv * kTileSide; z < std::min((tv + 1) * kTileSide, dims.z); ++z) {
      if (context_.stopped()) return context_.cancelled();
      if (auto read = read_layer(z, first); !read) return read;
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
  Result<void> read_layer(int z, const SlicePng& first) {
    const std::string path = folder_.file(z);
    const auto bytes = folder_.bytes(z, context_);
    if (!bytes) return tl::unexpected(bytes.error());
    const Result<SlicePng> png = SlicePng::open(bytes->view(), path);
    if (!png) return tl::unexpected(png.error());
    const glm::ivec3 dims = folder_.grid.dims;
    const auto kind = [](const SlicePng& one) {
      return fmt::format("{} bits{}", one.bits(), one.colours() ? " a colour" : "");
    };
    if (png->width() != dims.x || png->height() != dims.y || kind(*png) != kind(first)) {
      return fail(ErrorCode::kInput, "{}: {} x {} pixels of {}; {} x {} of {} are needed", path,
                  png->width(), png->height(), kind(*png), dims.x, dims.y, kind(first));
    }
    return png->rows([&](int row, std::span<const std::uint32_t> from) {
      const int y = folder_.descending ? dims.y - 1 - row : row;
      TileRuns& tile = tiles_[static_cast<std::size_t>(y / kTileSide)];
      const auto local = static_cast<unsigned>(z % kTileSide * kTileSide + y % kTileSide);
      const auto pixel = [&](int x) {
        return from[static_cast<std::size_t>(folder_.mirrored ? dims.x - 1 - x : x)];
      };
      for (int x = 0; x < dims.x;) {
        int past = x + 1;
        while (past < dims.x && pixel(past) == pixel(x)) ++past;
        if (pixel(x) != 0) tile.add(local, x, past - 1, pixel(x));
        x = past;
      }
    });
  }

  ReadContext& context_;
  const SliceFolder& folder_;
  VoxelIntervals& set_;
  std::vector<TileRuns> tiles_;
};

Result<SlicePng> first_picture(const ReadContext& context, const SliceFolder& folder) {
  const auto first = folder.bytes(0, context);
  if (!first) return tl::unexpected(first.error());
  return SlicePng::open(first->view(), folder.file(0));
}

Result<VoxelVolume> read_pictures(ReadContext& context, const SliceFolder& folder) {
  const Result<SlicePng> png = first_picture(context, folder);
  if (!png) return tl::unexpected(png.error());
  VoxelVolume volume;
  volume.set = VoxelIntervals(folder.grid, Axis::kX);
  if (!context.budget.take(volume.set.memory_bytes())) return context.too_large("the grid");
  const int bits = png->bits();
  volume.type = bits == 1 ? "bool" : bits == 8 ? "uint8" : "uint16";
  std::vector<Result<void>> results(static_cast<std::size_t>(volume.set.tiles_v()));
  parallel_for(context.execution, results.size(), [&](std::size_t tv, int) {
    results[tv] = SlabOfSlices(context, folder, volume.set).read(static_cast<int>(tv), *png);
  });
  if (context.stopped()) return context.cancelled();
  for (const Result<void>& result : results) {
    if (!result) return tl::unexpected(result.error());
  }
  if (png->colours()) {
    context.colours = true;
    return volume;
  }
  if (bits != 1) {
    volume.kind = VoxelKind::kIds;
    settle_ids(volume, bits == 8 ? 255 : 65535);
  }
  const bool asked = context.options.integers == IntegerVoxels::kValues;
  const bool auto_shares = folder.shares && context.options.integers == IntegerVoxels::kAuto;
  if (bits == 8 && volume.kind == VoxelKind::kIds &&
      (asked || auto_shares || are_fractions(context, volume))) {
    std::array<float, 256> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] =
          static_cast<float>(255.0 * std::pow(static_cast<double>(i) / 255, 1 / folder.gamma));
    }
    if (auto done = labels_to_values(context, volume, values); !done) {
      return tl::unexpected(done.error());
    }
  }
  return volume;
}

/// Lines `name = value` of the archive's text files.
class Settings {
 public:
  Result<void> add(const ZipMember& member, const std::string& name, const ReadContext& context) {
    MemoryLoan memory;
    const auto text = SliceFolder::unpack(member, name, context, memory);
    if (!text) return tl::unexpected(text.error());
    for (std::string_view rest = *text; !rest.empty();) {
      const std::string_view line = rest.substr(0, rest.find_first_of("\r\n"));
      rest.remove_prefix(std::min(line.size() + 1, rest.size()));
      const std::size_t equal = line.find('=');
      if (equal == std::string_view::npos) continue;
      values_[std::string(trimmed(line.substr(0, equal)))] = trimmed(line.substr(equal + 1));
    }
    return {};
  }
  /// Empty where there is none.
  [[nodiscard]] std::string text(const char* name) const {
    const auto found = values_.find(name);
    return found == values_.end() ? std::string() : found->second;
  }
  /// Above 0; else 0.
  [[nodiscard]] double number(const char* name) const {
    const std::string digits = text(name);
    double value = 0;
    const auto end = std::from_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    return end != digits.data() && std::isfinite(value) && value > 0 ? value : 0;
  }

 private:
  static std::string_view trimmed(std::string_view text) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ')) text.remove_suffix(1);
    return text;
  }
  std::map<std::string, std::string> values_;
};

/// The length of a pixel, where the settings say it; else 0.
double pixel_size(const Settings& settings, const char* length, const char* pixels) {
  const double count = settings.number(pixels);
  return count > 0 ? settings.number(length) / count : 0;
}

Result<SliceFolder> read_archive(ReadContext& context) {
  auto members = zip_members(context.bytes, context.path);
  if (!members) return tl::unexpected(members.error());
  SliceFolder folder;
  folder.path = context.path;
  Settings settings;
  for (ZipMember& member : *members) {
    const std::string name = context.path + ": " + member.name;
    if (member.name == "config.ini" || member.name == "prusaslicer.ini") {
      if (auto read = settings.add(member, name, context); !read)
        return tl::unexpected(read.error());
    } else if (member.name.ends_with(".png") && member.name.find('/') == std::string::npos) {
      folder.members.push_back(std::move(member));
    }
  }
  if (folder.members.empty()) {
    return fail(ErrorCode::kInput, "{}: the archive has no pictures of layers", context.path);
  }
  std::ranges::sort(folder.members, {}, &ZipMember::name);
  const Result<SlicePng> png = first_picture(context, folder);
  if (!png) return tl::unexpected(png.error());
  if (folder.members.size() > static_cast<std::size_t>(kMaxGridSide) ||
      png->width() > kMaxGridSide || png->height() > kMaxGridSide) {
    return fail(ErrorCode::kLimit, "{}: {} layers of {} x {} pixels; a side has at most {}",
                context.path, folder.members.size(), png->width(), png->height(), kMaxGridSide);
  }
  folder.grid.dims = {png->width(), png->height(), static_cast<int>(folder.members.size())};
  double x = pixel_size(settings, "display_width", "display_pixels_x");
  double y = pixel_size(settings, "display_height", "display_pixels_y");
  // Pictures of a display that stands upright have its height along their rows. Where that cannot
  // be seen, since both sides have as many pixels, the settings say it.
  const bool upright = png->width() == png->height()
                           ? settings.text("display_orientation") == "portrait"
                           : settings.number("display_pixels_x") == png->height();
  if (upright) std::swap(x, y);
  const double z = std::max(settings.number("layerHeight"), settings.number("layer_height"));
  folder.grid.voxel_size = {x > 0 ? x : 1, y > 0 ? y : 1, z > 0 ? z : 1};
  folder.mirrored = settings.number("display_mirror_x") == 1;
  folder.descending = settings.number("display_mirror_y") != 1;
  folder.shares = true;
  if (const double gamma = settings.number("gamma_correction"); gamma > 0) folder.gamma = gamma;
  if (auto place = check_place(context, folder.grid); !place) return tl::unexpected(place.error());
  return folder;
}

}  // namespace

Result<VoxelVolume> read_slice_voxels(ReadContext& context) {
  const Result<SliceFolder> folder = read_description(context);
  if (!folder) return tl::unexpected(folder.error());
  return read_pictures(context, *folder);
}

Result<VoxelVolume> read_sl1_voxels(ReadContext& context) {
  const Result<SliceFolder> folder = read_archive(context);
  if (!folder) return tl::unexpected(folder.error());
  auto volume = read_pictures(context, *folder);
  if (volume) volume->placed = false;  // somewhere on the printer's display
  return volume;
}

}  // namespace strata
