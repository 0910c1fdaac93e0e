#include "voxelize/readers/vdb_stream.h"

#include <libdeflate.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>

#include "core/srgb.h"
#include "voxelize/readers/unblosc.h"
#include "voxelize/volume/half_float.h"

namespace strata {
namespace {

constexpr std::uint64_t kMagic = 0x56444220;
constexpr std::uint32_t kOldestVersion = 222, kNewestVersion = 224;
constexpr std::uint32_t kZip = 1, kActiveMask = 2, kBlosc = 4;
constexpr std::size_t kUuidBytes = 36;
constexpr std::uint32_t kMostGrids = 100000, kMostMetadata = 100000;

// How inactive values stand in a list.
enum ListKind : std::uint8_t {
  kBackground = 0,
  kMinusBackground = 1,
  kOneValue = 2,
  kMaskBackground = 3,
  kMaskOneValue = 4,
  kMaskTwoValues = 5,
  kAllValues = 6
};

std::string text(ByteCursor& cursor) {
  return std::string(cursor.take(cursor.get<std::uint32_t>()));
}

tl::unexpected<Error> ends(const ReadContext& context, std::string_view where) {
  return fail(ErrorCode::kInput, "{}: the file of {} bytes ends within {}", context.path,
              context.bytes.size(), where);
}

std::map<std::string, std::string> metadata(ByteCursor& cursor) {
  std::map<std::string, std::string> entries;
  const auto count = cursor.get<std::uint32_t>();
  if (count > kMostMetadata) cursor.take(~std::uint64_t{0});
  for (std::uint32_t i = 0; i < count && !cursor.failed(); ++i) {
    std::string name = text(cursor);
    text(cursor);  // type
    entries[std::move(name)] = text(cursor);
  }
  return entries;
}

glm::dvec3 vector(ByteCursor& cursor) {
  glm::dvec3 value;
  for (int axis = 0; axis < 3; ++axis) value[axis] = cursor.get<double>();
  return value;
}

// A matrix for row vectors: the images of the axes, then the translation.
void read_matrix(ByteCursor& cursor, VdbGridHead& head) {
  bool turned = false;
  for (int row = 0; row < 4; ++row) {
    const glm::dvec3 v = vector(cursor);
    cursor.get<double>();
    if (row == 3) {
      head.centre = v;
      continue;
    }
    head.steps[row] = v;
    head.voxel_size[row] = std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
    turned = turned || std::abs(v[row]) != head.voxel_size[row] || v[row] < 0.0;
  }
  if (turned) head.note = "the transform turns or mirrors the grid; it is shown along its own axes";
}

bool read_transform(ByteCursor& cursor, const std::string& type, VdbGridHead& head) {
  const bool translates = type.find("Translat") != std::string::npos;
  if (type == "AffineMap" || type == "UnitaryMap") {
    read_matrix(cursor, head);
    return true;
  }
  if (type == "TranslationMap") {
    head.centre = vector(cursor);
    return true;
  }
  if (type != "ScaleMap" && type != "UniformScaleMap" && type != "ScaleTranslateMap" &&
      type != "UniformScaleTranslateMap") {
    return false;
  }
  if (translates) head.centre = vector(cursor);
  head.voxel_size = vector(cursor);
  for (int i = 0; i < 4; ++i) vector(cursor);  // lengths and inverses
  for (int axis = 0; axis < 3; ++axis) {
    head.steps[axis][axis] = head.voxel_size[axis];
    if (head.voxel_size[axis] >= 0.0) continue;
    head.voxel_size[axis] = -head.voxel_size[axis];
    head.note = "the transform mirrors the grid; it is shown along its own axes";
  }
  return true;
}

std::string unzip(std::string_view packed, std::byte* to, std::size_t bytes) {
  struct Free {
    void operator()(libdeflate_decompressor* unpacker) const {
      libdeflate_free_decompressor(unpacker);
    }
  };
  thread_local const std::unique_ptr<libdeflate_decompressor, Free> unpacker(
      libdeflate_alloc_decompressor());
  if (unpacker == nullptr) return "no memory for libdeflate";
  const libdeflate_result result =
      libdeflate_zlib_decompress(unpacker.get(), packed.data(), packed.size(), to, bytes, nullptr);
  return result == LIBDEFLATE_SUCCESS ? "" : "damaged values (zlib)";
}

std::string unpack_blosc(std::string_view packed, std::byte* to, std::size_t bytes) {
  if (!kHaveBlosc) {
    return "values packed by Blosc, which this build of Strata lacks: it needs libblosc-dev";
  }
  return unblosc(packed, {to, bytes}) ? "" : "damaged values (Blosc)";
}

}  // namespace

std::size_t bytes_of(VdbType type) {
  switch (type) {
    case VdbType::kMask:
    case VdbType::kBool:
      return 1;
    case VdbType::kInt32:
    case VdbType::kFloat:
      return 4;
    case VdbType::kVec3s:
      return 12;
    case VdbType::kInt64:
    case VdbType::kDouble:
      break;
  }
  return 8;
}

std::string_view name_of(VdbType type) {
  constexpr std::string_view kNames[] = {"mask",  "bool",   "int32", "int64",
                                         "float", "double", "vec3s"};
  return kNames[static_cast<std::size_t>(type)];
}

VdbTreeType vdb_tree_type(std::string_view name) {
  constexpr std::string_view kHead = "Tree_", kTail = "_5_4_3", kHalf = "_HalfFloat";
  VdbTreeType result;
  if (name.ends_with(kHalf)) {
    result.half = true;
    name.remove_suffix(kHalf.size());
  }
  if (!name.starts_with(kHead) || !name.ends_with(kTail)) return {};
  name = name.substr(kHead.size(), name.size() - kHead.size() - kTail.size());
  for (const VdbType type : {VdbType::kMask, VdbType::kBool, VdbType::kInt32, VdbType::kInt64,
                             VdbType::kFloat, VdbType::kDouble, VdbType::kVec3s}) {
    if (name == name_of(type)) result.type = type, result.read = true;
  }
  const bool real = result.type == VdbType::kFloat || result.type == VdbType::kDouble;
  if (result.type == VdbType::kVec3s && result.half) result.read = false;
  if (!real) result.half = false;
  return result;
}

Result<std::vector<VdbGridEntry>> read_vdb_entries(const ReadContext& context) {
  ByteCursor cursor(context.bytes);
  if (cursor.get<std::uint64_t>() != kMagic) {
    return fail(ErrorCode::kInput, "{}: byte 0: not an OpenVDB file", context.path);
  }
  const auto version = cursor.get<std::uint32_t>();
  if (!cursor.failed() && (version < kOldestVersion || version > kNewestVersion)) {
    return fail(ErrorCode::kInput, "{}: byte 8: version {} of OpenVDB's files; {} to {} are read",
                context.path, version, kOldestVersion, kNewestVersion);
  }
  cursor.take(8);  // of the library
  const bool offsets = cursor.get<std::uint8_t>() != 0;
  cursor.take(kUuidBytes);
  metadata(cursor);
  const auto count = cursor.get<std::uint32_t>();
  if (count > kMostGrids) {
    return fail(ErrorCode::kInput, "{}: {} grids; at most {} are read", context.path, count,
                kMostGrids);
  }
  std::vector<VdbGridEntry> entries;
  for (std::uint32_t i = 0; i < count; ++i) {
    VdbGridEntry entry;
    entry.name = text(cursor);
    entry.tree_type = text(cursor);
    entry.parent = text(cursor);
    entry.grid_at = cursor.get<std::uint64_t>();
    entry.blocks_at = cursor.get<std::uint64_t>();
    const auto end = cursor.get<std::uint64_t>();
    if (cursor.failed()) return ends(context, fmt::format("grid {} of {}", i + 1, count));
    // The same name again has a number after a separator.
    entry.name = entry.name.substr(0, entry.name.find('\x1e'));
    if (!offsets) {  // written to a pipe: the first grid follows, the others are not found
      entry.grid_at = cursor.at();
      entry.blocks_at = 0;
      entries.push_back(std::move(entry));
      return entries;
    }
    entries.push_back(std::move(entry));
    if (i + 1 < count) cursor.seek(end);
  }
  if (cursor.failed()) return ends(context, "its head");
  return entries;
}

Result<VdbGridHead> read_vdb_head(const ReadContext& context, const VdbGridEntry& entry) {
  ByteCursor cursor(context.bytes, entry.grid_at);
  VdbGridHead head;
  head.compression = cursor.get<std::uint32_t>();
  head.metadata = metadata(cursor);
  const std::string type = text(cursor);
  if (cursor.failed()) return ends(context, "the metadata of grid '" + entry.name + "'");
  if (!read_transform(cursor, type, head)) {
    return fail(ErrorCode::kInput,
                "{}: grid '{}' has a {} as its transform; maps that scale, turn and move are read",
                context.path, entry.name, type);
  }
  if (cursor.failed()) return ends(context, "the transform of grid '" + entry.name + "'");
  if ((head.compression & ~(kZip | kActiveMask | kBlosc)) != 0) {
    return fail(ErrorCode::kInput, "{}: byte {}: compression {} is none of OpenVDB's", context.path,
                entry.grid_at, head.compression);
  }
  head.tree_at = cursor.at();
  return head;
}

// --- lists of values ----------------------------------------------------------------------------

float VdbValueLists::number(const std::byte* from) const {
  const auto as = [from](auto value) {
    std::memcpy(&value, from, sizeof value);
    return static_cast<float>(value);
  };
  switch (type_.type) {
    case VdbType::kMask:
    case VdbType::kBool:
      return *from != std::byte{0} ? 1.0f : 0.0f;
    case VdbType::kInt32:
      return as(std::int32_t{});
    case VdbType::kInt64:
      return as(std::int64_t{});
    case VdbType::kFloat:
      return as(float{});
    case VdbType::kVec3s: {
      float light[3], packed = 1.0f, place = 1.0f;
      std::memcpy(light, from, sizeof light);
      for (const float each : light) {
        const double share = srgb_of_linear(std::clamp(static_cast<double>(each), 0.0, 1.0));
        packed += place * static_cast<float>(std::lround(255.0 * share));
        place *= 256.0f;
      }
      return packed;
    }
    case VdbType::kDouble:
      break;
  }
  return as(double{});
}

float VdbValueLists::one(ByteCursor& cursor) const {
  const std::string_view bytes = cursor.take(bytes_of(type_.type));
  return bytes.empty() ? 0.0f : number(reinterpret_cast<const std::byte*>(bytes.data()));
}

VdbValueLists::Head VdbValueLists::head(ByteCursor& cursor,
                                        std::span<const std::uint64_t> mask) const {
  Head head;
  head.kind = cursor.get<std::uint8_t>();
  head.inactive[1] = background_;
  const bool truth = bytes_of(type_.type) == 1;
  head.inactive[0] = head.kind == kBackground ? background_
                     : truth                  ? 1.0f - background_
                                              : -background_;
  if (head.kind == kOneValue || head.kind == kMaskOneValue || head.kind == kMaskTwoValues) {
    head.inactive[0] = one(cursor);
    if (head.kind == kMaskTwoValues) head.inactive[1] = one(cursor);
  }
  if (head.kind == kMaskBackground || head.kind == kMaskOneValue || head.kind == kMaskTwoValues) {
    head.selection = cursor.take(mask.size_bytes());
  }
  head.count = mask.size() * 64;
  if ((compression_ & kActiveMask) != 0 && head.kind != kAllValues) {
    head.count = 0;
    for (const std::uint64_t word : mask)
      head.count += static_cast<std::size_t>(std::popcount(word));
  }
  return head;
}

void VdbValueLists::skip(ByteCursor& cursor, std::span<const std::uint64_t> mask) const {
  const Head values = head(cursor, mask);
  if (type_.half && values.count == 0) return;
  if ((compression_ & (kZip | kBlosc)) == 0) {
    cursor.take(values.count * stored_bytes());
    return;
  }
  const auto bytes = cursor.get<std::int64_t>();
  cursor.take(bytes < 0 ? std::uint64_t{0} - static_cast<std::uint64_t>(bytes)
                        : static_cast<std::uint64_t>(bytes));
}

std::string VdbValueLists::read(ByteCursor& cursor, std::span<const std::uint64_t> mask,
                                float* values) const {
  const Head list = head(cursor, mask);
  const std::size_t bytes = list.count * stored_bytes();
  thread_local std::vector<std::byte> unpacked;
  const std::byte* from = nullptr;
  if (type_.half && list.count == 0) {
    // nothing follows
  } else if ((compression_ & (kZip | kBlosc)) == 0) {
    from = reinterpret_cast<const std::byte*>(cursor.take(bytes).data());
  } else {
    const auto length = cursor.get<std::int64_t>();
    if (length <= 0) {  // stored as they are
      const std::string_view stored =
          cursor.take(std::uint64_t{0} - static_cast<std::uint64_t>(length));
      if (!cursor.failed() && stored.size() != bytes) return "values of another size";
      from = reinterpret_cast<const std::byte*>(stored.data());
    } else {
      const std::string_view packed = cursor.take(static_cast<std::uint64_t>(length));
      if (cursor.failed()) return "the end of the file";
      unpacked.resize(bytes);
      const std::string fault = (compression_ & kBlosc) != 0
                                    ? unpack_blosc(packed, unpacked.data(), bytes)
                                    : unzip(packed, unpacked.data(), bytes);
      if (!fault.empty()) return fault;
      from = unpacked.data();
    }
  }
  if (cursor.failed()) return "the end of the file";
  const bool all = list.count == mask.size() * 64;
  for (std::size_t i = 0; i < mask.size() * 64; ++i) {
    const bool active = (mask[i / 64] >> i % 64 & 1) != 0;
    if (all || active) {
      values[i] = type_.half ? [&] {
        std::uint16_t half;
        std::memcpy(&half, from, sizeof half);
        return float_of_half(half);
      }() : number(from);
      from += stored_bytes();
      continue;
    }
    const bool second = !list.selection.empty() &&
                        (static_cast<unsigned char>(list.selection[i / 8]) >> i % 8 & 1) != 0;
    values[i] = list.inactive[second ? 1 : 0];
  }
  for (std::size_t i = 0; colours() && i < mask.size() * 64; ++i) {
    if ((mask[i / 64] >> i % 64 & 1) == 0) values[i] = 0.0f;
  }
  return "";
}

}  // namespace strata
