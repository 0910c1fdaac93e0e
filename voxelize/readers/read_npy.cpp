// NumPy's .npy, versions 1 to 3 (numpy/lib/format.py), and .npz: a ZIP of them, as savez and
// savez_compressed write it. Of an .npz the array `voxels` is read, or the only one of three
// dimensions; `origin` and `spacing` say where it lies.

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "voxelize/heads/grid_axes.h"
#include "voxelize/readers/readers.h"
#include "voxelize/scans/scan_readers.h"
#include "voxelize/volume/dense_array.h"
#include "voxelize/volume/inflate_stream.h"
#include "voxelize/volume/zip_directory.h"

namespace strata {
namespace {

/// What the head of a .npy file says.
struct NpyHead {
  NumberType type = NumberType::kU8;
  bool big_endian = false, fortran = false;
  std::vector<std::int64_t> shape;
  std::size_t bytes = 0;  // of the head
};

// The text after 'key': in the dictionary.
std::string_view value_of(std::string_view text, std::string_view key) {
  for (const char quote : {'\'', '"'}) {
    const std::string quoted = quote + std::string(key) + quote;
    const std::size_t at = text.find(quoted);
    if (at == std::string_view::npos) continue;
    std::string_view rest = text.substr(at + quoted.size());
    const std::size_t start = rest.find_first_not_of(" :");
    return start == std::string_view::npos ? std::string_view() : rest.substr(start);
  }
  return {};
}

bool parse_shape(std::string_view text, std::vector<std::int64_t>& shape) {
  const std::size_t end = text.find(')');
  if (!text.starts_with('(') || end == std::string_view::npos) return false;
  text = text.substr(1, end - 1);
  while (true) {
    const std::size_t start = text.find_first_not_of(" ,");
    if (start == std::string_view::npos) return true;
    text.remove_prefix(start);
    std::int64_t length = 0;
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), length);
    if (error != std::errc() || length < 0 || shape.size() == 32) return false;
    if (rest != text.data() + text.size() && *rest == 'L') {  // of Python 2
      text.remove_prefix(1);
    }
    text.remove_prefix(static_cast<std::size_t>(rest - text.data()));
    shape.push_back(length);
  }
}

/// @param name  of the file, and of the array in it
Result<NpyHead> parse_npy_head(std::string_view bytes, const std::string& name) {
  ByteCursor cursor(bytes);
  NpyHead head;
  if (cursor.take(6) != "\x93NUMPY") {
    return fail(ErrorCode::kInput, "{}: byte 0: no .npy file: it does not begin with \\x93NUMPY",
                name);
  }
  const int version = cursor.get<std::uint8_t>();
  cursor.get<std::uint8_t>();
  if (version < 1 || version > 3) {
    return fail(ErrorCode::kInput, "{}: byte 6: version {} of .npy; 1 to 3 are read", name,
                version);
  }
  const std::uint32_t length =
      version == 1 ? cursor.get<std::uint16_t>() : cursor.get<std::uint32_t>();
  const std::string_view text = cursor.take(length);
  if (cursor.failed()) {
    return fail(ErrorCode::kInput, "{}: byte 8: the head has {} bytes, the file has {}", name,
                length, bytes.size());
  }
  head.bytes = cursor.at();
  const std::string_view descr = value_of(text, "descr"), shape = value_of(text, "shape");
  const std::string_view order = value_of(text, "fortran_order");
  if (!descr.starts_with('\'') && !descr.starts_with('"')) {
    return fail(ErrorCode::kInput, "{}: descr of the head must be one number type, such as '|b1'",
                name);
  }
  const std::string_view type = descr.substr(1, descr.find(descr[0], 1) - 1);
  const bool marked =
      !type.empty() && std::string_view("<>|=").find(type[0]) != std::string_view::npos;
  const std::optional<NumberType> found = numpy_type(type.substr(marked ? 1 : 0));
  if (!found) {
    return fail(ErrorCode::kInput,
                "{}: descr of the head is '{}'; read are b1, u1 to u8, i1 to i8 and f2 to f8", name,
                type.substr(0, 40));
  }
  head.type = *found;
  head.big_endian = marked && type[0] == '>';
  head.fortran = order.starts_with("True");
  if (!head.fortran && !order.starts_with("False")) {
    return fail(ErrorCode::kInput, "{}: fortran_order of the head must be True or False", name);
  }
  if (!parse_shape(shape, head.shape)) {
    return fail(ErrorCode::kInput, "{}: shape of the head must be (nx, ny, nz)", name);
  }
  return head;
}

/// Whether numbers are red, green, blue and alpha of voxels, side by side in the file: the first of
/// four axes in Fortran order, the last in C order.
bool has_colours(const NpyHead& head) {
  return head.shape.size() == 4 && head.type == NumberType::kU8 &&
         (head.fortran ? head.shape.front() : head.shape.back()) == 4;
}

Result<DenseLayout> layout_of(ReadContext& context, const NpyHead& head) {
  std::vector<std::int64_t> shape = head.shape;
  context.colours = has_colours(head);
  if (context.colours) shape.erase(head.fortran ? shape.begin() : shape.end() - 1);
  if (shape.size() == 2) shape.push_back(1);  // a picture is a layer
  if (shape.size() != 3) {
    return fail(ErrorCode::kInput, "{}: an array of {} dimensions; voxels have 3", context.path,
                head.shape.size());
  }
  if (auto fits = check_dims(context, shape[0], shape[1], shape[2]); !fits) {
    return tl::unexpected(fits.error());
  }
  DenseLayout layout;
  for (int axis = 0; axis < 3; ++axis) {
    layout.grid.dims[axis] = static_cast<int>(shape[static_cast<std::size_t>(axis)]);
  }
  layout.type = context.colours ? NumberType::kU32 : head.type;
  layout.big_endian = head.big_endian;
  if (!head.fortran) layout.axes = {2, 1, 0};
  return layout;
}

std::string array_name(const ZipMember& member) {
  std::string name = member.name;
  if (name.ends_with(".npy")) name.resize(name.size() - 4);
  return name;
}

/// A .npz file and its arrays.
class NpzFile {
 public:
  NpzFile(ReadContext& context, std::vector<ZipMember> members)
      : context_(context), members_(std::move(members)) {}

  [[nodiscard]] const ZipMember* find(std::string_view name) const {
    for (const ZipMember& member : members_) {
      if (array_name(member) == name) return &member;
    }
    return nullptr;
  }
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const ZipMember& member : members_) names.push_back(array_name(member));
    return names;
  }
  [[nodiscard]] std::string name_of(const ZipMember& member) const {
    return context_.path + ": " + member.name;
  }
  [[nodiscard]] Result<std::string> head_bytes(const ZipMember& member, std::uint64_t most) const {
    const std::uint64_t bytes = std::min(member.bytes, most);
    if (!member.deflated) return std::string(member.packed.substr(0, bytes));
    std::string unpacked(bytes, '\0');
    InflateStream stream(member.packed, InflateStream::kBare, name_of(member));
    auto read = stream.read(reinterpret_cast<std::byte*>(unpacked.data()), unpacked.size());
    if (!read) return tl::unexpected(read.error());
    return unpacked;
  }
  [[nodiscard]] Result<NpyHead> head(const ZipMember& member) const {
    constexpr std::uint64_t kLongestHead = 1 << 16;
    const Result<std::string> bytes = head_bytes(member, kLongestHead);
    if (!bytes) return tl::unexpected(bytes.error());
    return parse_npy_head(*bytes, name_of(member));
  }
  /// Numbers of an array of that shape, the last index fastest; none if there is no such array.
  [[nodiscard]] Result<std::vector<double>> numbers(std::string_view name,
                                                    const std::vector<std::int64_t>& shape) const;
  /// Three numbers; nothing if there is no such array.
  [[nodiscard]] Result<std::optional<glm::dvec3>> vector(std::string_view name) const;
  [[nodiscard]] Result<const ZipMember*> voxels() const;
  [[nodiscard]] Result<VoxelVolume> read(const ZipMember& member, const DenseLayout& layout,
                                         std::size_t head_bytes) const;

 private:
  ReadContext& context_;
  std::vector<ZipMember> members_;
};

Result<std::vector<double>> NpzFile::numbers(std::string_view name,
                                             const std::vector<std::int64_t>& shape) const {
  const ZipMember* member = find(name);
  if (member == nullptr) return std::vector<double>();
  constexpr std::uint64_t kMost = 4096;
  const Result<std::string> bytes = head_bytes(*member, kMost);
  if (!bytes) return tl::unexpected(bytes.error());
  const Result<NpyHead> head = parse_npy_head(*bytes, name_of(*member));
  if (!head) return tl::unexpected(head.error());
  std::size_t count = 1;
  for (const std::int64_t side : shape) count *= static_cast<std::size_t>(side);
  const bool fits = head->type == NumberType::kF64 && !head->big_endian && head->shape == shape &&
                    bytes->size() >= head->bytes + count * sizeof(double);
  if (!fits) {
    return fail(ErrorCode::kInput, "{}: must be {} numbers of type <f8", name_of(*member),
                shape.size() == 1 ? "3" : "3 x 3");
  }
  std::vector<double> values(count);
  std::memcpy(values.data(), bytes->data() + head->bytes, count * sizeof(double));
  if (head->fortran && shape.size() == 2) {
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < row; ++column) {
        std::swap(values[3 * row + column], values[3 * column + row]);
      }
    }
  }
  return values;
}

Result<std::optional<glm::dvec3>> NpzFile::vector(std::string_view name) const {
  const auto list = numbers(name, {3});
  if (!list) return tl::unexpected(list.error());
  if (list->empty()) return std::nullopt;
  return glm::dvec3((*list)[0], (*list)[1], (*list)[2]);
}

Result<const ZipMember*> NpzFile::voxels() const {
  const std::string& wanted = context_.options.grid;
  const ZipMember* found = find(wanted.empty() ? "voxels" : wanted);
  if (found == nullptr && wanted.empty()) {
    for (const ZipMember& member : members_) {
      if (!member.name.ends_with(".npy")) continue;
      const Result<NpyHead> read = head(member);
      if (!read || (read->shape.size() != 3 && !has_colours(*read))) continue;
      found = &member;
      break;
    }
  }
  if (found != nullptr) return found;
  std::string names;
  for (const std::string& name : this->names()) names += (names.empty() ? "" : ", ") + name;
  return fail(wanted.empty() ? ErrorCode::kInput : ErrorCode::kUsage, "{}: no array {}; it has {}",
              context_.path, wanted.empty() ? "of three dimensions" : "'" + wanted + "'",
              names.empty() ? "none" : names);
}

Result<VoxelVolume> NpzFile::read(const ZipMember& member, const DenseLayout& layout,
                                  std::size_t head_bytes) const {
  if (member.bytes - std::min<std::uint64_t>(member.bytes, head_bytes) < layout.bytes()) {
    return fail(ErrorCode::kInput, "{}: {} bytes of voxels; {} x {} x {} of type {} need {}",
                name_of(member), member.bytes - head_bytes, layout.grid.dims.x, layout.grid.dims.y,
                layout.grid.dims.z, strata::name_of(layout.type), layout.bytes());
  }
  if (!member.deflated) {
    return read_dense(context_, layout, {member.packed.substr(head_bytes, layout.bytes()), {}});
  }
  InflateStream stream(member.packed, InflateStream::kBare, name_of(member));
  std::vector<std::byte> head(head_bytes);
  if (auto read = stream.read(head.data(), head.size()); !read) return tl::unexpected(read.error());
  return read_dense(context_, layout,
                    {{}, [&](std::byte* to, std::size_t bytes) { return stream.read(to, bytes); }});
}

}  // namespace

Result<VoxelVolume> read_npy_voxels(ReadContext& context) {
  const Result<NpyHead> head = parse_npy_head(context.bytes, context.path);
  if (!head) return tl::unexpected(head.error());
  const Result<DenseLayout> layout = layout_of(context, *head);
  if (!layout) return tl::unexpected(layout.error());
  const auto all = voxel_bytes(context, context.bytes, head->bytes, *layout);
  if (!all) return tl::unexpected(all.error());
  Result<VoxelVolume> volume = read_dense(context, *layout, {*all, {}});
  if (!volume) return volume;
  volume->placed = false;
  return volume;
}

Result<VoxelVolume> read_npz_voxels(ReadContext& context) {
  Result<std::vector<ZipMember>> members = zip_members(context.bytes, context.path);
  if (!members) return tl::unexpected(members.error());
  const NpzFile file(context, std::move(*members));
  if (file.find("voxels") == nullptr && file.find("offsets") != nullptr &&
      file.find("world_from_image") != nullptr) {
    return read_list_voxels(context, false);
  }
  const Result<const ZipMember*> member = file.voxels();
  if (!member) return tl::unexpected(member.error());
  const Result<NpyHead> head = file.head(**member);
  if (!head) return tl::unexpected(head.error());
  Result<DenseLayout> layout = layout_of(context, *head);
  if (!layout) return tl::unexpected(layout.error());
  const auto origin = file.vector("origin"), spacing = file.vector("spacing");
  if (!origin) return tl::unexpected(origin.error());
  if (!spacing) return tl::unexpected(spacing.error());
  layout->grid.origin = origin->value_or(glm::dvec3(0.0));
  layout->grid.voxel_size = spacing->value_or(glm::dvec3(1.0));
  if (auto place = check_place(context, layout->grid); !place) return tl::unexpected(place.error());
  Result<VoxelVolume> volume = file.read(**member, *layout, head->bytes);
  if (!volume) return volume;
  volume->placed = origin->has_value() && spacing->has_value();
  volume->name = array_name(**member);
  volume->grids = file.names();
  return volume;
}

Result<std::array<double, 3>> npy_sizes(ReadContext& context) {
  const Result<NpyHead> head = parse_npy_head(context.bytes, context.path);
  if (!head) return tl::unexpected(head.error());
  const Result<DenseLayout> layout = layout_of(context, *head);
  if (!layout) return tl::unexpected(layout.error());
  const glm::dvec3 dims(layout->grid.dims);
  return std::array<double, 3>{dims.x, dims.y, dims.z};
}

Result<VoxelFileGrid> npz_grid(ReadContext& context) {
  Result<std::vector<ZipMember>> members = zip_members(context.bytes, context.path);
  if (!members) return tl::unexpected(members.error());
  const NpzFile file(context, std::move(*members));
  const Result<const ZipMember*> member = file.voxels();
  if (!member) return tl::unexpected(member.error());
  const Result<NpyHead> head = file.head(**member);
  if (!head) return tl::unexpected(head.error());
  const Result<DenseLayout> layout = layout_of(context, *head);
  if (!layout) return tl::unexpected(layout.error());
  const auto origin = file.vector("origin"), spacing = file.vector("spacing");
  const auto direction = file.numbers("direction", {3, 3});
  if (!origin) return tl::unexpected(origin.error());
  if (!spacing) return tl::unexpected(spacing.error());
  if (!direction) return tl::unexpected(direction.error());
  if (!*origin || !*spacing) {
    return fail(ErrorCode::kInput, "{}: array {} is missing, which says where the voxels lie",
                context.path, *origin ? "spacing" : "origin");
  }
  glm::dmat3 turn(1.0);
  for (std::size_t i = 0; i < direction->size(); ++i) {
    turn[static_cast<int>(i % 3)][static_cast<int>(i / 3)] = (*direction)[i];
  }
  const glm::dvec3 dims(layout->grid.dims);
  return grid_of_frame(context.path, {dims.x, dims.y, dims.z}, **origin, **spacing, turn);
}

}  // namespace strata
