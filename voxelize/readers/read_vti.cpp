// VTK's XML image data (IO/XML of VTK 9): one piece, cells or points, `appended` as raw bytes or
// base64, or `binary`; plain or packed by zlib in blocks. Of cells a value fills a voxel; a point
// is the centre of one.

#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "voxelize/heads/grid_axes.h"
#include "voxelize/readers/readers.h"
#include "voxelize/volume/dense_array.h"
#include "voxelize/volume/inflate_stream.h"

namespace strata {
namespace {

/// A start tag of XML: its attributes and where its content begins.
struct Tag {
  std::string_view attributes{};
  std::size_t begin = 0, end = 0;  // of the tag in the text

  [[nodiscard]] std::string get(std::string_view name) const {
    for (std::size_t at = attributes.find(name); at != std::string_view::npos;
         at = attributes.find(name, at + 1)) {
      const bool starts = at == 0 || attributes[at - 1] == ' ' || attributes[at - 1] == '\n' ||
                          attributes[at - 1] == '\t';
      std::string_view rest = attributes.substr(at + name.size());
      rest.remove_prefix(std::min(rest.size(), rest.find_first_not_of(" \t\r\n")));
      if (!starts || !rest.starts_with('=')) continue;
      const std::size_t quote = rest.find_first_of("\"'");
      if (quote == std::string_view::npos) return {};
      const std::size_t close = rest.find(rest[quote], quote + 1);
      if (close == std::string_view::npos) return {};
      return unescaped(rest.substr(quote + 1, close - quote - 1));
    }
    return {};
  }
  static std::string unescaped(std::string_view text) {
    std::string out;
    constexpr std::pair<std::string_view, char> kNames[] = {
        {"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}};
    for (std::size_t at = 0; at < text.size();) {
      bool named = false;
      for (const auto& [name, letter] : kNames) {
        if (named || !text.substr(at).starts_with(name)) continue;
        out += letter;
        at += name.size();
        named = true;
      }
      if (!named) out += text[at++];
    }
    return out;
  }
};

std::optional<Tag> find_tag(std::string_view text, std::string_view name, std::size_t from = 0) {
  const std::string open = "<" + std::string(name);
  for (std::size_t at = text.find(open, from); at != std::string_view::npos;
       at = text.find(open, at + 1)) {
    const std::size_t after = at + open.size();
    if (after >= text.size() ||
        std::string_view(" \t\r\n/>").find(text[after]) == std::string_view::npos) {
      continue;
    }
    char quote = 0;
    for (std::size_t end = after; end < text.size(); ++end) {
      if (quote != 0) {
        if (text[end] == quote) quote = 0;
      } else if (text[end] == '"' || text[end] == '\'') {
        quote = text[end];
      } else if (text[end] == '>') {
        return Tag{text.substr(after, end - after), at, end + 1};
      }
    }
    return std::nullopt;
  }
  return std::nullopt;
}

template <class T, std::size_t Count>
std::optional<std::array<T, Count>> numbers(std::string_view text) {
  std::array<T, Count> values{};
  for (T& value : values) {
    text.remove_prefix(std::min(text.size(), text.find_first_not_of(" \t\r\n")));
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc()) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(rest - text.data()));
  }
  return values;
}

std::optional<NumberType> vti_type(std::string_view name) {
  constexpr std::pair<std::string_view, NumberType> kTypes[] = {
      {"UInt8", NumberType::kU8},   {"Int8", NumberType::kI8},    {"UInt16", NumberType::kU16},
      {"Int16", NumberType::kI16},  {"UInt32", NumberType::kU32}, {"Int32", NumberType::kI32},
      {"UInt64", NumberType::kU64}, {"Int64", NumberType::kI64},  {"Float32", NumberType::kF32},
      {"Float64", NumberType::kF64}};
  for (const auto& [text, type] : kTypes) {
    if (text == name) return type;
  }
  return std::nullopt;
}

/// The bytes of base64 up to its padding. Nothing if a letter is wrong.
std::optional<std::string> base64(std::string_view text, std::size_t& used) {
  std::string out;
  std::uint32_t bits = 0;
  int held = 0;
  for (used = 0; used < text.size(); ++used) {
    const char c = text[used];
    int value = -1;
    if (c >= 'A' && c <= 'Z') value = c - 'A';
    if (c >= 'a' && c <= 'z') value = c - 'a' + 26;
    if (c >= '0' && c <= '9') value = c - '0' + 52;
    if (c == '+') value = 62;
    if (c == '/') value = 63;
    if (value < 0) break;
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    held += 6;
    if (held < 8) continue;
    held -= 8;
    out += static_cast<char>(bits >> held & 0xff);
  }
  while (used < text.size() && text[used] == '=') ++used;
  return out;
}

/// An array of the file and where its voxels lie.
struct VtiArray {
  Tag tag;
  std::string name, type, format;
  bool points = false;
  bool colours = false;  // red, green, blue, alpha
};

/// Attributes of the image and of its piece.
struct VtiPlace {
  std::array<std::int64_t, 6> extent;
  std::array<double, 3> origin, spacing;
  std::optional<std::array<double, 9>> direction;
};

class VtiReader {
 public:
  explicit VtiReader(ReadContext& context) : context_(context) {}
  Result<VoxelVolume> read();
  Result<VoxelFileGrid> grid();

 private:
  [[nodiscard]] tl::unexpected<Error> fault(std::string_view what) const {
    return fail(ErrorCode::kInput, "{}: {}", context_.path, what);
  }
  Result<void> read_head();
  Result<void> find_arrays();
  [[nodiscard]] Result<VtiPlace> find_place() const;
  Result<void> place(const VtiArray& array);
  Result<std::string_view> array_bytes(const VtiArray& array);
  Result<std::string_view> decoded(std::string_view text);
  [[nodiscard]] std::uint64_t number(std::string_view bytes, std::size_t index) const {
    ByteCursor cursor(bytes, index * header_bytes_);
    return header_bytes_ == 8 ? cursor.get<std::uint64_t>() : cursor.get<std::uint32_t>();
  }
  Result<VoxelVolume> read_blocks(std::string_view bytes);

  ReadContext& context_;
  std::string_view text_;  // what stands before raw data
  Tag file_, image_, piece_;
  bool packed_ = false;
  std::size_t header_bytes_ = 4;
  std::vector<VtiArray> arrays_;
  std::string decoded_;
  std::string note_;
  DenseLayout layout_;
};

Result<void> VtiReader::read_head() {
  const std::optional<Tag> appended = find_tag(context_.bytes, "AppendedData");
  text_ = appended ? context_.bytes.substr(0, appended->end) : context_.bytes;
  const auto file = find_tag(text_, "VTKFile"), image = find_tag(text_, "ImageData");
  const auto piece = find_tag(text_, "Piece");
  if (!file || !image || !piece || file->get("type") != "ImageData") {
    return fault(
        "no image data of VTK: VTKFile type=\"ImageData\", ImageData and Piece are needed");
  }
  if (find_tag(text_, "Piece", piece->end)) return fault("several pieces; one is read");
  file_ = *file;
  image_ = *image;
  piece_ = *piece;
  const std::string compressor = file_.get("compressor");
  if (!compressor.empty() && compressor != "vtkZLibDataCompressor") {
    return fault("packed by " + compressor.substr(0, 60) + "; vtkZLibDataCompressor is read");
  }
  packed_ = !compressor.empty();
  header_bytes_ = file_.get("header_type") == "UInt64" ? 8 : 4;
  layout_.big_endian = file_.get("byte_order") == "BigEndian";
  if (layout_.big_endian) return fault("its sizes are big-endian; little-endian files are read");
  return {};
}

Result<void> VtiReader::find_arrays() {
  for (const bool points : {false, true}) {
    const std::string_view kind = points ? "PointData" : "CellData";
    const std::optional<Tag> section = find_tag(text_, kind, piece_.end);
    if (!section || section->attributes.ends_with('/')) continue;
    const std::size_t end = text_.find("</" + std::string(kind), section->end);
    const std::string_view inside = text_.substr(0, end);
    const std::string scalars = section->get("Scalars");
    std::size_t from = section->end;
    const std::size_t first = arrays_.size();
    while (const std::optional<Tag> tag = find_tag(inside, "DataArray", from)) {
      from = tag->end;
      VtiArray array{*tag, tag->get("Name"), tag->get("type"), tag->get("format"), points};
      const std::string components = tag->get("NumberOfComponents");
      array.colours = components == "4" && array.type == "UInt8";
      if (!components.empty() && components != "1" && !array.colours) continue;
      const bool main = array.name == scalars && arrays_.size() > first;
      arrays_.insert(main ? arrays_.begin() + static_cast<std::ptrdiff_t>(first) : arrays_.end(),
                     std::move(array));
    }
  }
  if (arrays_.empty()) {
    return fault("no array of one number a cell or point, or of red, green, blue and alpha");
  }
  return {};
}

Result<VtiPlace> VtiReader::find_place() const {
  const auto extent = numbers<std::int64_t, 6>(piece_.get("Extent"));
  const auto origin = numbers<double, 3>(image_.get("Origin"));
  const auto spacing = numbers<double, 3>(image_.get("Spacing"));
  if (!extent || !origin || !spacing) {
    return fault("Extent must have 6 numbers, Origin and Spacing 3");
  }
  return VtiPlace{*extent, *origin, *spacing, numbers<double, 9>(image_.get("Direction"))};
}

Result<void> VtiReader::place(const VtiArray& array) {
  const auto found = find_place();
  if (!found) return tl::unexpected(found.error());
  const auto& [extent, origin, spacing, direction] = *found;
  std::int64_t dims[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<int>(axis);
    const std::int64_t first = extent[2 * axis], last = extent[2 * axis + 1];
    if (std::abs(first) > 1'000'000'000 || std::abs(last) > 1'000'000'000) {
      return fault("Extent must lie within a billion");
    }
    dims[i] = last - first + (array.points ? 1 : 0);
    layout_.grid.voxel_size[i] = std::abs(spacing[axis]);
    layout_.grid.origin[i] =
        origin[axis] + (static_cast<double>(first) - (array.points ? 0.5 : 0.0)) * spacing[axis];
  }
  if (auto fits = check_dims(context_, dims[0], dims[1], dims[2]); !fits) return fits;
  layout_.grid.dims = glm::ivec3(dims[0], dims[1], dims[2]);
  if (direction && *direction != std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1}) {
    note_ = "the direction turns the grid; it is shown along its own axes";
  }
  return check_place(context_, layout_.grid);
}

// Header and blocks of an array in base64: the header of packed data is padded by itself.
Result<std::string_view> VtiReader::decoded(std::string_view text) {
  text.remove_prefix(std::min(text.size(), text.find_first_not_of(" \t\r\n")));
  if (!context_.budget.take(text.size())) return context_.too_large("the packed data");
  std::size_t used = 0;
  decoded_ = *base64(text, used);
  if (packed_) decoded_ += *base64(text.substr(used), used);
  return std::string_view(decoded_);
}

Result<std::string_view> VtiReader::array_bytes(const VtiArray& array) {
  if (array.format == "binary") return decoded(text_.substr(array.tag.end));
  if (array.format != "appended") {
    return fault("array '" + array.name + "' is written as '" + array.format +
                 "'; appended and binary are read");
  }
  const std::optional<Tag> appended = find_tag(context_.bytes, "AppendedData");
  const auto offset = numbers<std::uint64_t, 1>(array.tag.get("offset"));
  const std::size_t mark =
      appended ? context_.bytes.find('_', appended->end) : std::string_view::npos;
  if (!offset || mark == std::string_view::npos) return fault("its AppendedData are not there");
  if ((*offset)[0] > context_.bytes.size() - mark - 1) {
    return fault(fmt::format("offset {} of array '{}' lies behind the end of the file",
                             (*offset)[0], array.name));
  }
  const std::string_view bytes = context_.bytes.substr(mark + 1 + (*offset)[0]);
  return appended->get("encoding") == "base64" ? decoded(bytes) : bytes;
}

Result<VoxelVolume> VtiReader::read_blocks(std::string_view bytes) {
  const std::uint64_t blocks = number(bytes, 0), block = number(bytes, 1);
  const std::uint64_t last = number(bytes, 2);
  const bool fits = blocks >= 1 && blocks <= bytes.size() / header_bytes_ && block >= 1 &&
                    block <= layout_.bytes() + (std::uint64_t{1} << 30) && last <= block &&
                    (blocks - 1) * block + (last == 0 ? block : last) == layout_.bytes();
  if (!fits) {
    return fault(fmt::format("{} blocks of {} bytes, the last of {}; {} bytes are needed", blocks,
                             block, last, layout_.bytes()));
  }
  std::size_t index = 0;
  std::uint64_t at = (3 + blocks) * header_bytes_, left = 0;
  std::optional<InflateStream> stream;
  return read_dense(
      context_, layout_,
      {{}, [&](std::byte* to, std::size_t count) -> Result<void> {
         while (count != 0) {
           if (left == 0) {
             const std::uint64_t packed = number(bytes, 3 + index);
             if (index == blocks || at > bytes.size() || packed > bytes.size() - at) {
               return fault(fmt::format("block {} of {} is not there", index + 1, blocks));
             }
             stream.emplace(bytes.substr(at, packed), InflateStream::kZlib, context_.path);
             at += packed;
             left = ++index == blocks && last != 0 ? last : block;
           }
           const std::size_t piece = std::min<std::uint64_t>(left, count);
           if (auto got = stream->read(to, piece); !got) return got;
           to += piece;
           count -= piece;
           left -= piece;
         }
         return {};
       }});
}

Result<VoxelVolume> VtiReader::read() {
  if (auto head = read_head(); !head) return tl::unexpected(head.error());
  if (auto found = find_arrays(); !found) return tl::unexpected(found.error());
  const std::string& wanted = context_.options.grid;
  std::string names;
  const VtiArray* array = nullptr;
  for (const VtiArray& each : arrays_) {
    if (array == nullptr && (wanted.empty() || each.name == wanted)) array = &each;
    names += (names.empty() ? "'" : ", '") + each.name + "'";
  }
  if (array == nullptr) {
    return fail(ErrorCode::kUsage, "{}: no array '{}'; it has {}", context_.path, wanted, names);
  }
  const std::optional<NumberType> type = vti_type(array->type);
  if (!type) return fault("array '" + array->name + "' is of type " + array->type.substr(0, 40));
  layout_.type = array->colours ? NumberType::kU32 : *type;
  context_.colours = array->colours;
  if (auto placed = place(*array); !placed) return tl::unexpected(placed.error());
  const Result<std::string_view> bytes = array_bytes(*array);
  if (!bytes) return tl::unexpected(bytes.error());
  Result<VoxelVolume> volume = fault("");
  if (packed_) {
    volume = read_blocks(*bytes);
  } else {
    if (number(*bytes, 0) != layout_.bytes() || bytes->size() - header_bytes_ < layout_.bytes() ||
        bytes->size() < header_bytes_) {
      return fault(fmt::format("array '{}' announces {} bytes and has {}; {} are needed",
                               array->name, number(*bytes, 0), bytes->size(), layout_.bytes()));
    }
    volume = read_dense(context_, layout_, {bytes->substr(header_bytes_, layout_.bytes()), {}});
  }
  if (!volume) return volume;
  volume->name = array->name;
  for (const VtiArray& each : arrays_) volume->grids.push_back(each.name);
  if (!note_.empty()) volume->notes.push_back(note_);
  return volume;
}

Result<VoxelFileGrid> VtiReader::grid() {
  if (auto head = read_head(); !head) return tl::unexpected(head.error());
  const bool points = find_arrays().has_value() && arrays_.front().points;
  const auto found = find_place();
  if (!found) return tl::unexpected(found.error());
  const auto& [extent, origin, spacing, direction] = *found;
  GridAxes axes;
  axes.corner = !points;
  axes.place = {origin[0], origin[1], origin[2]};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<int>(axis);
    const auto first = static_cast<double>(extent[2 * axis]);
    axes.sizes[axis] = static_cast<double>(extent[2 * axis + 1]) - first + (points ? 1 : 0);
    for (std::size_t row = 0; row < 3; ++row) {
      const double along = direction ? (*direction)[3 * row + axis] : row == axis ? 1.0 : 0.0;
      axes.steps[a][static_cast<int>(row)] = along * spacing[axis];
    }
    axes.place += first * axes.steps[a];
  }
  return grid_of_axes(context_.path, axes);
}

}  // namespace

Result<VoxelVolume> read_vti_voxels(ReadContext& context) { return VtiReader(context).read(); }

Result<VoxelFileGrid> vti_grid(ReadContext& context) { return VtiReader(context).grid(); }

}  // namespace strata
