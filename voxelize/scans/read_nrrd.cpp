// NRRD, versions 1 to 5 (Kindlmann, teem.sourceforge.net/nrrd/format.html): the data in the file or
// in one beside it, three axes, raw or gzip. The first axis is fastest. Space directions that run
// along the axes of the world in any order and sign are followed; others are shown along the grid's
// own axes.

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/letters.h"
#include "voxelize/heads/nrrd_head.h"
#include "voxelize/scans/scan_readers.h"
#include "voxelize/volume/dense_array.h"
#include "voxelize/volume/inflate_stream.h"

namespace strata {
namespace {

std::optional<NumberType> nrrd_type(std::string_view name) {
  constexpr std::pair<std::string_view, NumberType> kTypes[] = {
      {"signed char", NumberType::kI8},
      {"int8", NumberType::kI8},
      {"int8_t", NumberType::kI8},
      {"char", NumberType::kI8},
      {"uchar", NumberType::kU8},
      {"unsigned char", NumberType::kU8},
      {"uint8", NumberType::kU8},
      {"uint8_t", NumberType::kU8},
      {"short", NumberType::kI16},
      {"short int", NumberType::kI16},
      {"signed short", NumberType::kI16},
      {"signed short int", NumberType::kI16},
      {"int16", NumberType::kI16},
      {"int16_t", NumberType::kI16},
      {"ushort", NumberType::kU16},
      {"unsigned short", NumberType::kU16},
      {"unsigned short int", NumberType::kU16},
      {"uint16", NumberType::kU16},
      {"uint16_t", NumberType::kU16},
      {"int", NumberType::kI32},
      {"signed int", NumberType::kI32},
      {"int32", NumberType::kI32},
      {"int32_t", NumberType::kI32},
      {"uint", NumberType::kU32},
      {"unsigned int", NumberType::kU32},
      {"uint32", NumberType::kU32},
      {"uint32_t", NumberType::kU32},
      {"longlong", NumberType::kI64},
      {"long long", NumberType::kI64},
      {"long long int", NumberType::kI64},
      {"signed long long", NumberType::kI64},
      {"int64", NumberType::kI64},
      {"int64_t", NumberType::kI64},
      {"ulonglong", NumberType::kU64},
      {"unsigned long long", NumberType::kU64},
      {"uint64", NumberType::kU64},
      {"unsigned long long int", NumberType::kU64},
      {"uint64_t", NumberType::kU64},
      {"float", NumberType::kF32},
      {"double", NumberType::kF64}};
  for (const auto& [text, type] : kTypes) {
    if (text == name) return type;
  }
  return std::nullopt;
}

/// Spacing, origin, order and direction of the axes.
class Placement {
 public:
  Placement(const NrrdHead& head, const std::array<int, 3>& sizes, bool colours,
            DenseLayout& layout)
      : head_(head), sizes_(sizes), colours_(colours), layout_(layout) {}

  /// @return a note where the axes are turned
  std::string place() {
    // Of four axes the first is that of colours, which lies nowhere: "none" is three numbers.
    const auto in_space = [this](std::string_view text, std::size_t each) {
      std::vector<double> list = numbers_of(text);
      if (colours_ && list.size() > 3 * each) {
        list.erase(list.begin(), list.end() - static_cast<std::ptrdiff_t>(3 * each));
      }
      return list;
    };
    const std::vector<double> d = in_space(head_.get("space directions"), 3);
    if (d.size() == 9) return by_directions(d);
    const std::vector<double> spacing = in_space(head_.get("spacings"), 1);
    const std::vector<double> mins = in_space(head_.get("axis mins", "axismins"), 1);
    const std::vector<double> origin = numbers_of(head_.get("space origin"));
    const bool node = head_.get("centers", "centerings").find("node") != std::string_view::npos;
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      double& size = layout_.grid.voxel_size[axis];
      double& low = layout_.grid.origin[axis];
      if (spacing.size() == 3 && std::isfinite(spacing[i]) && spacing[i] != 0.0) {
        size = std::abs(spacing[i]);
        placed_ = true;
      }
      if (mins.size() == 3 && std::isfinite(mins[i])) low = mins[i] - (node ? size / 2 : 0.0);
      if (origin.size() == 3) low = origin[i] - size / 2;
    }
    set_dims({0, 1, 2});
    return "";
  }
  [[nodiscard]] bool placed() const { return placed_; }

 private:
  void set_dims(const std::array<int, 3>& axes) {
    layout_.axes = axes;
    for (std::size_t a = 0; a < 3; ++a) layout_.grid.dims[axes[a]] = sizes_[a];
  }
  std::string by_directions(const std::vector<double>& d) {
    std::array<int, 3> axes{-1, -1, -1};
    bool straight = true;
    for (std::size_t a = 0; a < 3; ++a) {
      for (int c = 0; c < 3; ++c) {
        if (d[3 * a + static_cast<std::size_t>(c)] == 0.0) continue;
        straight = straight && axes[a] == -1;
        axes[a] = c;
      }
    }
    straight = straight && axes[0] + axes[1] + axes[2] == 3 && axes[0] != axes[1] &&
               axes[1] != axes[2] && axes[0] != axes[2] && axes[0] >= 0 && axes[1] >= 0;
    if (!straight) axes = {0, 1, 2};
    const std::vector<double> origin = numbers_of(head_.get("space origin"));
    for (std::size_t a = 0; a < 3; ++a) {
      const double* v = d.data() + 3 * a;
      const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
      const int axis = axes[a];
      layout_.grid.voxel_size[axis] = length;
      layout_.flipped[a] = straight && v[axis] < 0.0;
      if (origin.size() != 3) continue;
      const double first = origin[static_cast<std::size_t>(axis)];
      layout_.grid.origin[axis] =
          first - length * (layout_.flipped[a] ? static_cast<double>(sizes_[a]) - 0.5 : 0.5);
    }
    set_dims(axes);
    placed_ = origin.size() == 3;
    return straight ? "" : "the space directions turn the grid; it is shown along its own axes";
  }

  const NrrdHead& head_;
  const std::array<int, 3>& sizes_;
  const bool colours_;
  DenseLayout& layout_;
  bool placed_ = false;
};

/// The name of the file that has the data; empty: they follow the head.
std::string data_file(const NrrdHead& head) {
  return std::string(head.get("data file", "datafile"));
}

std::string_view data_bytes(const ReadContext& context, const NrrdHead& head,
                            const std::optional<detail::InputBytes>& beside) {
  std::string_view data = beside ? beside->view() : context.bytes.substr(head.data);
  const std::vector<double> lines = numbers_of(head.get("line skip", "lineskip"));
  for (double left = lines.empty() ? 0.0 : lines[0]; left >= 1.0; left -= 1.0) {
    const std::size_t end = data.find('\n');
    if (end == std::string_view::npos) break;
    data.remove_prefix(end + 1);
  }
  return data;
}

}  // namespace

Result<VoxelVolume> read_nrrd_voxels(ReadContext& context) {
  const Result<NrrdHead> head = parse_nrrd_head(context.bytes, context.path);
  if (!head) return tl::unexpected(head.error());
  DenseLayout layout;
  std::vector<double> sizes = numbers_of(head->get("sizes"));
  const std::optional<NumberType> type = nrrd_type(lower_case(std::string(head->get("type"))));
  // Red, green, blue and alpha side by side.
  context.colours = sizes.size() == 4 && sizes[0] == 4.0 && type == NumberType::kU8 &&
                    head->get("dimension") == "4";
  if (context.colours) sizes.erase(sizes.begin());
  if (sizes.size() != 3 || head->get("dimension") != (context.colours ? "4" : "3")) {
    return fail(ErrorCode::kInput, "{}: dimension is '{}' and sizes '{}'; voxels have 3",
                context.path, head->get("dimension"), head->get("sizes").substr(0, 40));
  }
  std::array<int, 3> sides{};
  for (std::size_t a = 0; a < 3; ++a) {
    const bool fits =
        sizes[a] >= 1.0 && sizes[a] <= kMaxGridSide && std::floor(sizes[a]) == sizes[a];
    if (!fits) {
      return fail(ErrorCode::kInput, "{}: sizes '{}'; each must be 1 to {}", context.path,
                  head->get("sizes").substr(0, 40), kMaxGridSide);
    }
    sides[a] = static_cast<int>(sizes[a]);
  }
  if (!type) {
    return fail(ErrorCode::kInput, "{}: type '{}' is not read; integers, float and double are",
                context.path, head->get("type").substr(0, 40));
  }
  layout.type = context.colours ? NumberType::kU32 : *type;
  layout.big_endian = lower_case(std::string(head->get("endian"))) == "big" && !context.colours;
  Placement placement(*head, sides, context.colours, layout);
  const std::string note = placement.place();
  if (auto place = check_place(context, layout.grid); !place) return tl::unexpected(place.error());

  const std::string encoding = lower_case(std::string(head->get("encoding")));
  std::optional<detail::InputBytes> beside;
  if (const std::string file = data_file(*head); !file.empty()) {
    auto opened = open_data_file(context, file);
    if (!opened) return tl::unexpected(opened.error());
    beside = std::move(*opened);
  }
  const std::string_view data = data_bytes(context, *head, beside);
  Result<VoxelVolume> volume =
      fail(ErrorCode::kInput, "{}: encoding '{}' is not read; raw and gzip are", context.path,
           std::string_view(encoding).substr(0, 40));
  if (encoding == "raw") {
    const std::vector<double> skip = numbers_of(head->get("byte skip", "byteskip"));
    const double first = skip.empty() ? 0.0 : skip[0];
    const std::uint64_t size = data.size();
    const std::uint64_t at = first < 0.0 ? size - std::min(size, layout.bytes())
                                         : static_cast<std::uint64_t>(std::min(first, 1e15));
    if (at > size || size - at < layout.bytes()) {
      return fail(ErrorCode::kInput, "{}: {} bytes of voxels; {} x {} x {} of type {} need {}",
                  context.path, size - std::min(at, size), sides[0], sides[1], sides[2],
                  name_of(layout.type), layout.bytes());
    }
    volume = read_dense(context, layout, {data.substr(at, layout.bytes()), {}});
  } else if (encoding == "gzip" || encoding == "gz") {
    InflateStream stream(data, InflateStream::kGzip, context.path);
    volume =
        read_dense(context, layout,
                   {{}, [&](std::byte* to, std::size_t bytes) { return stream.read(to, bytes); }});
  }
  if (!volume) return volume;
  volume->name = head->get("content");
  volume->placed = placement.placed();
  if (!note.empty()) volume->notes.push_back(note);
  return volume;
}

namespace {

/// Reads `part.nhdr` or `part.raw.nhdr`, which says what part.raw holds, by a reader of heads.
template <class Read>
auto with_head(ReadContext& context, Read&& read) -> decltype(read(context)) {
  std::string stem = context.path;
  if (lower_case(stem).ends_with(".raw")) stem.resize(stem.size() - 4);
  for (const std::string& path : {stem + ".nhdr", context.path + ".nhdr"}) {
    auto head =
        detail::InputBytes::open(path, context.execution.memory_limit, context.execution.stop);
    if (!head) continue;
    ReadContext beside{path, head->view(), context.options, context.execution, context.budget};
    beside.integers_as_values = context.integers_as_values;
    auto result = read(beside);
    context.wants_values = beside.wants_values.load();
    context.colours = beside.colours;
    return result;
  }
  return fail(ErrorCode::kInput,
              "{}: the header {}.nhdr, which would say what it holds, is missing", context.path,
              stem);
}

}  // namespace

Result<VoxelVolume> read_raw_voxels(ReadContext& context) {
  return with_head(context, read_nrrd_voxels);
}

Result<VoxelFileGrid> nrrd_file_grid(ReadContext& context) {
  const auto head = parse_nrrd_head(context.bytes, context.path);
  if (!head) return tl::unexpected(head.error());
  return nrrd_grid(*head, context.path);
}

Result<VoxelFileGrid> raw_grid(ReadContext& context) { return with_head(context, nrrd_file_grid); }

}  // namespace strata
