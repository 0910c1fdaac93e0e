// Zarr version 2 arrays (zarr.readthedocs.io/en/stable/spec/v2.html): three axes, C or Fortran
// order, chunks of any size, plain or packed by zlib, gzip or Blosc. A chunk that is not there
// holds the fill value. `.zattrs` may say origin and voxel_size, as write_zarr.cpp does.

#include <unistd.h>

#include <algorithm>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <vector>

#include "mesh/text/input_bytes.h"
#include "strata/voxelize/readers/read_voxel_grid.h"
#include "voxelize/readers/readers.h"
#include "voxelize/readers/unblosc.h"
#include "voxelize/volume/dense_array.h"
#include "voxelize/volume/inflate_stream.h"
#include "voxelize/volume/tile_runs.h"

namespace strata {
namespace {

enum class Packing { kNone, kZlib, kGzip, kBlosc };

struct ZarrHead {
  VoxelGrid grid;
  glm::ivec3 chunk{0}, chunks{0};  // voxels of a chunk; chunks along each axis
  NumberType type = NumberType::kU8;
  bool big_endian = false, fortran = false, placed = false;
  Packing packing = Packing::kNone;
  double fill = 0.0;
  char separator = '.';
  // Of OME-Zarr: the axes are z, y, x, which is the other order of storage, too, and the names of
  // chunks begin with those of axes that have one index.
  bool reversed = false;
  std::string folder;
  std::string before;
  std::string after;  // of the name of a chunk
  // Red, green, blue, alpha, side by side, of OME-Zarr in chunks of their own: `type` is that of
  // all four.
  bool colours = false;

  [[nodiscard]] std::size_t chunk_bytes() const {
    return static_cast<std::size_t>(chunk.x) * static_cast<std::size_t>(chunk.y) *
           static_cast<std::size_t>(chunk.z) * bytes_of(type);
  }
};

Result<void> take_type(const JsonValue& json, const std::string& path, ZarrHead& head) {
  const JsonValue* type = json.find("dtype");
  const std::string text = type == nullptr ? "" : type->text;
  const std::optional<NumberType> found =
      text.size() == 3 ? numpy_type(std::string_view(text).substr(1)) : std::nullopt;
  if (!found)
    return fail(ErrorCode::kInput, "{}: dtype '{}' is not read", path, text.substr(0, 40));
  head.type = *found;
  head.big_endian = text[0] == '>';
  const JsonValue* order = json.find("order");
  head.fortran = order != nullptr && order->text == "F";
  const JsonValue* fill = json.find("fill_value");
  if (fill != nullptr && fill->kind == JsonValue::kNumber) head.fill = fill->number;
  if (fill != nullptr && fill->kind == JsonValue::kBool) head.fill = fill->truth ? 1.0 : 0.0;
  const JsonValue* separator = json.find("dimension_separator");
  if (separator != nullptr && separator->text == "/") head.separator = '/';
  const JsonValue* filters = json.find("filters");
  if (filters != nullptr && !filters->items.empty()) {
    return fail(ErrorCode::kInput, "{}: filters are not read", path);
  }
  const JsonValue* compressor = json.find("compressor");
  if (compressor == nullptr || compressor->kind == JsonValue::kNull) return {};
  const JsonValue* id = compressor->find("id");
  const std::string name = id == nullptr ? "" : id->text;
  head.packing = name == "zlib"    ? Packing::kZlib
                 : name == "gzip"  ? Packing::kGzip
                 : name == "blosc" ? Packing::kBlosc
                                   : Packing::kNone;
  if (head.packing == Packing::kNone) {
    return fail(ErrorCode::kInput, "{}: compressor '{}' is not read; zlib, gzip and blosc are",
                path, name.substr(0, 40));
  }
  return {};
}

/// The three axes of a shape or of chunks as x, y, z; of OME-Zarr the last three, of which those
/// before have one index. Nothing if there are others.
/// @param colours  a further axis follows, of OME-Zarr one of channels comes before
std::optional<std::vector<double>> three_axes(const JsonValue& json, std::string_view name,
                                              bool ome, bool colours) {
  const JsonValue* list = json.find(name);
  const std::size_t axes = colours ? 4 : 3;
  if (list == nullptr || list->items.size() < axes || (!ome && list->items.size() != axes)) {
    return std::nullopt;
  }
  auto numbers = json.numbers(name, list->items.size());
  if (numbers && colours && !ome) numbers->pop_back();
  if (!numbers || !ome) return numbers;
  if (colours) numbers->erase(numbers->end() - 4);
  for (; numbers->size() > 3; numbers->erase(numbers->begin())) {
    if (numbers->front() != 1.0) return std::nullopt;
  }
  std::reverse(numbers->begin(), numbers->end());
  return numbers;
}

/// Whether the last of four axes, of OME-Zarr the one before z, y, x, is that of red, green, blue
/// and alpha.
bool has_colours(const JsonValue& json, bool ome) {
  const JsonValue *type = json.find("dtype"), *shape = json.find("shape");
  const JsonValue *chunks = json.find("chunks"), *order = json.find("order");
  const auto has = [ome](const JsonValue* list, double count) {
    if (list == nullptr || list->items.size() < 4) return false;
    const std::size_t axis = list->items.size() - (ome ? 4 : 1);
    return list->items[axis].number == count;
  };
  return type != nullptr && type->text == "|u1" && has(shape, 4.0) &&
         has(chunks, ome ? 1.0 : 4.0) && (order == nullptr || order->text != "F");
}

/// @param folder  of the array; of OME-Zarr in that of the group
Result<ZarrHead> read_head(const ReadContext& context, const std::string& folder, bool ome) {
  const std::string path = folder + "/.zarray";
  const Result<JsonValue> json = read_json_file(path, context.execution);
  if (!json) return tl::unexpected(json.error());
  ZarrHead head;
  head.reversed = ome;
  head.folder = folder;
  const JsonValue* version = json->find("zarr_format");
  head.colours = has_colours(*json, ome);
  const auto shape = three_axes(*json, "shape", ome, head.colours);
  const auto chunks = three_axes(*json, "chunks", ome, head.colours);
  if (version == nullptr || version->number != 2.0 || !shape || !chunks) {
    return fail(ErrorCode::kInput, "{}: zarr_format must be 2, shape and chunks 3 numbers each",
                path);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    for (const double side : {(*shape)[i], (*chunks)[i]}) {
      if (!(side >= 1.0 && side <= kMaxGridSide)) {
        return fail(ErrorCode::kInput, "{}: a side of {}; each must be 1 to {}", path, side,
                    kMaxGridSide);
      }
    }
    head.grid.dims[axis] = static_cast<int>((*shape)[i]);
    head.chunk[axis] = static_cast<int>((*chunks)[i]);
    head.chunks[axis] = (head.grid.dims[axis] + head.chunk[axis] - 1) / head.chunk[axis];
  }
  if (auto taken = take_type(*json, path, head); !taken) return tl::unexpected(taken.error());
  if (head.colours) {
    head.type = NumberType::kU32;
    if (!ome) head.after = std::string(1, head.separator) + "0";
  }
  if (ome) {
    head.fortran = !head.fortran;
    for (std::size_t i = head.colours ? 4 : 3; i < json->find("shape")->items.size(); ++i) {
      head.before += std::string("0") + head.separator;
    }
    const auto place = read_voxel_grid(context.path, context.execution);
    head.placed = place.has_value();
    if (place) head.grid = place->grid;
    return head;
  }
  const std::string attributes = context.path + "/.zattrs";
  if (::access(attributes.c_str(), R_OK) == 0) {
    const Result<JsonValue> placed = read_json_file(attributes, context.execution);
    if (!placed) return tl::unexpected(placed.error());
    const auto origin = placed->numbers("origin", 3), size = placed->numbers("voxel_size", 3);
    head.placed = origin.has_value() && size.has_value();
    for (int axis = 0; axis < 3 && head.placed; ++axis) {
      head.grid.origin[axis] = (*origin)[static_cast<std::size_t>(axis)];
      head.grid.voxel_size[axis] = (*size)[static_cast<std::size_t>(axis)];
    }
  }
  if (auto place = check_place(context, head.grid); !place) return tl::unexpected(place.error());
  return head;
}

Result<void> unpack_chunk(std::string_view packed, const std::string& path,
                          std::vector<std::byte>& to) {
  if (!kHaveBlosc) {
    return fail(ErrorCode::kUsage,
                "{}: packed by Blosc, which this build of Strata lacks: it needs libblosc-dev",
                path);
  }
  if (!unblosc(packed, to)) return fail(ErrorCode::kInput, "{}: damaged data (Blosc)", path);
  return {};
}

/// A chunk after the other, of a column of chunks along z.
class ChunkReader {
 public:
  ChunkReader(ReadContext& context, const ZarrHead& head) : context_(context), head_(head) {}

  /// The numbers of a chunk in the order of the file; empty if there is no such file.
  Result<std::span<const std::byte>> read(const glm::ivec3& at) {
    if (!head_.colours || !head_.reversed) return read_file(at, head_.before, head_.chunk_bytes());
    colours_.assign(head_.chunk_bytes(), std::byte{0});
    bool any = false;
    for (std::size_t channel = 0; channel < 4; ++channel) {
      const std::string before = head_.before + fmt::format("{}{}", channel, head_.separator);
      const auto plane = read_file(at, before, colours_.size() / 4);
      if (!plane) return plane;
      any = any || !plane->empty();
      for (std::size_t i = 0; i < plane->size(); ++i) colours_[4 * i + channel] = (*plane)[i];
    }
    return any ? std::span<const std::byte>(colours_) : std::span<const std::byte>();
  }

 private:
  Result<std::span<const std::byte>> read_file(const glm::ivec3& at, const std::string& before,
                                               std::size_t bytes) {
    const glm::ivec3 name = head_.reversed ? glm::ivec3(at.z, at.y, at.x) : at;
    const std::string path =
        fmt::format("{}/{}{}{}{}{}{}{}", head_.folder, before, name.x, head_.separator, name.y,
                    head_.separator, name.z, head_.after);
    if (::access(path.c_str(), F_OK) != 0) return std::span<const std::byte>();
    const auto file = detail::InputBytes::open(path, context_.execution.memory_limit);
    if (!file) return tl::unexpected(file.error());
    const std::string_view packed = file->view();
    bytes_.resize(bytes);
    if (head_.packing == Packing::kNone) {
      if (packed.size() != bytes_.size()) {
        return fail(ErrorCode::kInput, "{}: {} bytes; a chunk has {}", path, packed.size(),
                    bytes_.size());
      }
      std::copy_n(reinterpret_cast<const std::byte*>(packed.data()), bytes_.size(), bytes_.begin());
      return std::span<const std::byte>(bytes_);
    }
    if (head_.packing == Packing::kBlosc) {
      if (auto done = unpack_chunk(packed, path, bytes_); !done)
        return tl::unexpected(done.error());
      return std::span<const std::byte>(bytes_);
    }
    InflateStream stream(
        packed, head_.packing == Packing::kZlib ? InflateStream::kZlib : InflateStream::kGzip,
        path);
    if (auto done = stream.read(bytes_.data(), bytes_.size()); !done) {
      return tl::unexpected(done.error());
    }
    return std::span<const std::byte>(bytes_);
  }

  ReadContext& context_;
  const ZarrHead& head_;
  std::vector<std::byte> bytes_, colours_;
};

/// Ids and booleans: the tiles above which a column of chunks lies.
class ChunkRuns {
 public:
  ChunkRuns(ReadContext& context, const ZarrHead& head, VoxelIntervals& set)
      : context_(context), head_(head), set_(set), chunks_(context, head), convert_(layout(head)) {}

  /// All chunks of a square of tiles. `square` has whole chunks and whole tiles.
  Result<void> read(const glm::ivec2& first_chunk, const glm::ivec2& chunks) {
    begin_ = first_chunk * glm::ivec2(head_.chunk);
    const glm::ivec2 end =
        glm::min((first_chunk + chunks) * glm::ivec2(head_.chunk), glm::ivec2(head_.grid.dims));
    tiles_u_ = (end.x - begin_.x + kTileSide - 1) / kTileSide;
    const int tiles_v = (end.y - begin_.y + kTileSide - 1) / kTileSide;
    tiles_.resize(static_cast<std::size_t>(tiles_u_) * static_cast<std::size_t>(tiles_v));
    for (int z = 0; z < head_.chunks.z; ++z) {
      for (int y = first_chunk.y; y < std::min(first_chunk.y + chunks.y, head_.chunks.y); ++y) {
        for (int x = first_chunk.x; x < std::min(first_chunk.x + chunks.x, head_.chunks.x); ++x) {
          if (context_.stopped()) return context_.cancelled();
          if (auto taken = take({x, y, z}); !taken) return taken;
        }
      }
    }
    const bool labels = head_.type != NumberType::kBool;
    for (std::size_t i = 0; i < tiles_.size(); ++i) {
      if (tiles_[i].empty()) continue;
      if (!context_.budget.take(tiles_[i].pieces() * (labels ? 8 : 4) +
                                VoxelIntervals::kTileColumns * sizeof(std::uint32_t))) {
        return context_.too_large("the runs of voxels");
      }
      const int tile = static_cast<int>(i);
      tiles_[i].store(set_, begin_.x / kTileSide + tile % tiles_u_,
                      begin_.y / kTileSide + tile / tiles_u_, labels);
    }
    return {};
  }

  static DenseLayout layout(const ZarrHead& head) {
    DenseLayout layout;
    layout.type = head.type;
    layout.big_endian = head.big_endian;
    return layout;
  }

 private:
  Result<void> take(const glm::ivec3& chunk) {
    const Result<std::span<const std::byte>> bytes = chunks_.read(chunk);
    if (!bytes) return tl::unexpected(bytes.error());
    if (bytes->empty()) return {};  // a fill value other than 0 is read as values
    const auto voxels = head_.chunk_bytes() / bytes_of(head_.type);
    ids_.resize(voxels);
    if (!convert_.to_ids(bytes->data(), voxels, ids_.data())) {
      context_.wants_values = true;
      return fail(ErrorCode::kInput,
                  "{}: chunk {}.{}.{} has a number that is no id: an id is 0 to "
                  "4294967295",
                  context_.path, chunk.x, chunk.y, chunk.z);
    }
    const glm::ivec3 first = chunk * head_.chunk;
    const glm::ivec3 end = glm::min(head_.chunk, head_.grid.dims - first);
    const auto s = [](int value) { return static_cast<std::size_t>(value); };
    const std::size_t step_z = head_.fortran ? s(head_.chunk.x) * s(head_.chunk.y) : 1;
    const std::size_t step_y = head_.fortran ? s(head_.chunk.x) : s(head_.chunk.z);
    const std::size_t step_x = head_.fortran ? 1 : s(head_.chunk.y) * s(head_.chunk.z);
    for (int x = 0; x < end.x; ++x) {
      for (int y = 0; y < end.y; ++y) {
        const std::uint32_t* column = ids_.data() + s(x) * step_x + s(y) * step_y;
        const int u = first.x + x, v = first.y + y;
        TileRuns& tile =
            tiles_[s((v - begin_.y) / kTileSide) * s(tiles_u_) + s((u - begin_.x) / kTileSide)];
        const auto local = static_cast<unsigned>(v % kTileSide * kTileSide + u % kTileSide);
        for (int z = 0; z < end.z;) {
          const std::uint32_t label = column[s(z) * step_z];
          int past = z + 1;
          while (past < end.z && column[s(past) * step_z] == label) ++past;
          if (label != 0) {
            tile.add(local, first.z + z, first.z + past - 1,
                     head_.type == NumberType::kBool ? 1 : label);
          }
          z = past;
        }
      }
    }
    return {};
  }

  ReadContext& context_;
  const ZarrHead& head_;
  VoxelIntervals& set_;
  ChunkReader chunks_;
  RowConverter convert_;
  glm::ivec2 begin_{0};
  int tiles_u_ = 0;
  std::vector<TileRuns> tiles_;
  std::vector<std::uint32_t> ids_;
};

Result<VoxelIntervals> read_runs(ReadContext& context, const ZarrHead& head) {
  VoxelIntervals set(head.grid, Axis::kZ);
  if (!context.budget.take(set.memory_bytes())) return context.too_large("the grid");
  // Squares of whole chunks that are whole tiles, or else everything at once.
  glm::ivec2 square(head.chunks);
  if (head.chunk.x % kTileSide == 0 && head.chunk.y % kTileSide == 0) square = glm::ivec2(1);
  const glm::ivec2 squares((head.chunks.x + square.x - 1) / square.x,
                           (head.chunks.y + square.y - 1) / square.y);
  const auto count = static_cast<std::size_t>(squares.x) * static_cast<std::size_t>(squares.y);
  std::vector<Result<void>> results(count);
  parallel_for(context.execution, count, [&](std::size_t index, int) {
    const int i = static_cast<int>(index);
    const glm::ivec2 at(i % squares.x * square.x, i / squares.x * square.y);
    results[index] = ChunkRuns(context, head, set).read(at, square);
  });
  if (context.stopped()) return context.cancelled();
  for (const Result<void>& result : results) {
    if (!result) return tl::unexpected(result.error());
  }
  return set;
}

Result<ScalarField> read_field(ReadContext& context, const ZarrHead& head) {
  ScalarField field(head.grid.dims, static_cast<float>(head.fill));
  ChunkReader chunks(context, head);
  const RowConverter convert(ChunkRuns::layout(head));
  std::vector<float> values(head.chunk_bytes() / bytes_of(head.type));
  const auto s = [](int value) { return static_cast<std::size_t>(value); };
  const int axis = head.fortran ? 0 : 2;  // of a row
  const int middle = 1, slow = 2 - axis;
  for (int x = 0; x < head.chunks.x; ++x) {
    for (int y = 0; y < head.chunks.y; ++y) {
      for (int z = 0; z < head.chunks.z; ++z) {
        if (context.stopped()) return context.cancelled();
        const Result<std::span<const std::byte>> bytes = chunks.read({x, y, z});
        if (!bytes) return tl::unexpected(bytes.error());
        if (bytes->empty()) continue;
        convert.to_floats(bytes->data(), values.size(), values.data());
        const glm::ivec3 first = glm::ivec3(x, y, z) * head.chunk;
        const glm::ivec3 end = glm::min(head.chunk, head.grid.dims - first);
        for (int a = 0; a < end[slow]; ++a) {
          for (int b = 0; b < end[middle]; ++b) {
            glm::ivec3 at = first;
            at[slow] += a;
            at[middle] += b;
            const std::size_t row = (s(a) * s(head.chunk[middle]) + s(b)) * s(head.chunk[axis]);
            put_row(field, axis, values.data() + row, end[axis], at);
          }
        }
        if (field.memory_bytes() > context.budget.limit()) return context.too_large("the values");
      }
    }
  }
  return field;
}

Result<VoxelVolume> read_array(ReadContext& context, const std::string& folder, bool ome) {
  const Result<ZarrHead> head = read_head(context, folder, ome);
  if (!head) return tl::unexpected(head.error());
  if (!context.budget.take(head->chunk_bytes() * 2)) return context.too_large("a chunk");
  VoxelVolume volume;
  context.colours = head->colours;
  const bool ids =
      !is_float(head->type) && head->fill == 0.0 &&
      (head->type == NumberType::kBool || head->colours || !context.integers_as_values);
  if (ids) {
    Result<VoxelIntervals> set = read_runs(context, *head);
    if (!set) return tl::unexpected(set.error());
    volume.set = std::move(*set);
    if (auto settled = settle_integers(context, volume, head->type); !settled) {
      return tl::unexpected(settled.error());
    }
  } else {
    Result<ScalarField> field = read_field(context, *head);
    if (!field) return tl::unexpected(field.error());
    volume.values = std::move(*field);
    volume.kind = is_float(head->type) ? VoxelKind::kMask : VoxelKind::kValues;
    if (auto settled = settle_values(context, volume, head->grid); !settled) {
      return tl::unexpected(settled.error());
    }
  }
  volume.placed = head->placed;
  volume.type = name_of(head->type);
  return volume;
}

}  // namespace

Result<VoxelVolume> read_zarr_voxels(ReadContext& context) {
  return read_array(context, context.path, false);
}

// The finest level of the first image.
Result<VoxelVolume> read_ome_zarr_voxels(ReadContext& context) {
  const std::string path = context.path + "/.zattrs";
  const Result<JsonValue> json = read_json_file(path, context.execution);
  if (!json) return tl::unexpected(json.error());
  const JsonValue* scales = json->find("multiscales");
  const JsonValue* sets =
      scales == nullptr || scales->items.empty() ? nullptr : scales->items[0].find("datasets");
  const JsonValue* name =
      sets == nullptr || sets->items.empty() ? nullptr : sets->items[0].find("path");
  if (name == nullptr || name->text.empty() || name->text.front() == '/' ||
      name->text.find("..") != std::string::npos) {
    return fail(ErrorCode::kInput, "{}: multiscales must name the folder of an array", path);
  }
  const JsonValue* axes = scales->items[0].find("axes");
  std::string order;
  for (std::size_t i = 0; axes != nullptr && i < axes->items.size(); ++i) {
    const JsonValue* letter = axes->items[i].find("name");
    order += letter == nullptr ? axes->items[i].text : letter->text;
  }
  if (!order.ends_with("zyx")) {
    return fail(ErrorCode::kInput, "{}: axes '{}' are not read; those that end with z, y, x are",
                path, order.substr(0, 40));
  }
  Result<VoxelVolume> volume = read_array(context, context.path + "/" + name->text, true);
  if (volume && context.colours) {
    volume->notes.push_back("its four channels are shown as red, green, blue and alpha");
  }
  if (volume && json->find("direction") != nullptr) {
    volume->notes.push_back("the file turns the grid; it is shown along its own axes");
  }
  return volume;
}

}  // namespace strata
