#include "voxelize/heads/metaimage_head.h"

#include <optional>
#include <vector>

#include "core/letters.h"
#include "voxelize/heads/head_fields.h"

namespace strata {
namespace {

std::optional<NumberType> metaimage_type(std::string_view name) {
  constexpr std::pair<std::string_view, NumberType> kTypes[] = {
      {"MET_CHAR", NumberType::kI8},       {"MET_UCHAR", NumberType::kU8},
      {"MET_SHORT", NumberType::kI16},     {"MET_USHORT", NumberType::kU16},
      {"MET_INT", NumberType::kI32},       {"MET_UINT", NumberType::kU32},
      {"MET_LONG", NumberType::kI32},      {"MET_ULONG", NumberType::kU32},
      {"MET_LONG_LONG", NumberType::kI64}, {"MET_ULONG_LONG", NumberType::kU64},
      {"MET_FLOAT", NumberType::kF32},     {"MET_DOUBLE", NumberType::kF64}};
  for (const auto& [text, type] : kTypes) {
    if (text == name) return type;
  }
  return std::nullopt;
}

bool is_true(std::string_view text) { return same_word(text, "true") || text == "1"; }

/// Offset, spacing and directions. @return kInput naming the field
Result<void> place(const HeadFields& fields, const std::string& path, int dimensions,
                   MetaImageHead& head) {
  const auto n = static_cast<std::size_t>(dimensions);
  const auto list = [&](std::initializer_list<std::string_view> names, std::size_t count,
                        std::vector<double>& values) -> Result<void> {
    for (const std::string_view name : names) {
      const std::string_view text = fields.get(lower_case(std::string(name)));
      if (text.empty()) continue;
      values = numbers_of(text);
      if (values.size() == count) return {};
      return fail(ErrorCode::kInput, "{}: {} is '{}'; it must be {} numbers", path, name,
                  text.substr(0, 60), count);
    }
    return {};
  };
  std::vector<double> sizes, spacing, offset, matrix;
  for (const auto& done :
       {list({"DimSize"}, n, sizes), list({"ElementSpacing", "ElementSize"}, n, spacing),
        list({"Offset", "Position", "Origin"}, n, offset),
        list({"TransformMatrix", "Rotation", "Orientation"}, n * n, matrix)}) {
    if (!done) return done;
  }
  if (sizes.empty()) return fail(ErrorCode::kInput, "{}: DimSize is missing", path);
  head.placed = !offset.empty();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<int>(axis);
    head.axes.sizes[axis] = axis < n ? sizes[axis] : 1.0;
    if (axis >= n) continue;
    if (!offset.empty()) head.axes.place[a] = offset[axis];
    const double length = spacing.empty() ? 1.0 : spacing[axis];
    for (std::size_t c = 0; c < 3; ++c) {
      // The file lists the direction of one axis after the other.
      const double along = c >= n           ? 0.0
                           : matrix.empty() ? (axis == c ? 1.0 : 0.0)
                                            : matrix[axis * n + c];
      head.axes.steps[a][static_cast<int>(c)] = along * length;
    }
  }
  return {};
}

}  // namespace

Result<MetaImageHead> parse_metaimage_head(std::string_view bytes, const std::string& path) {
  HeadFields fields;
  MetaImageHead head;
  int line_number = 0;
  for (std::size_t at = 0; at < bytes.size() && head.data_file.empty();) {
    constexpr std::size_t kLongestLine = 65536;
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    ++line_number;
    const std::string_view line = bytes.substr(at, end - at);
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos || line.size() > kLongestLine) {
      if (trimmed(line).empty()) {
        at = end + 1;
        continue;
      }
      return fail(ErrorCode::kInput, "{}:{}: not a MetaImage: a line must be 'Name = value'", path,
                  line_number);
    }
    const std::string name = lower_case(trimmed(line.substr(0, equals)));
    fields.set(name, trimmed(line.substr(equals + 1)));
    at = std::min(end + 1, bytes.size());
    head.data_at = at;
    if (name == "elementdatafile") head.data_file = fields.get(name);
  }
  if (head.data_file.empty()) {
    return fail(ErrorCode::kInput, "{}: not a MetaImage: ElementDataFile is missing", path);
  }
  if (same_word(head.data_file, "local")) head.data_file = "LOCAL";
  const std::vector<double> dimensions = numbers_of(fields.get("ndims"));
  if (dimensions.size() != 1 || (dimensions[0] != 3.0 && dimensions[0] != 2.0)) {
    return fail(ErrorCode::kInput, "{}: NDims is '{}'; voxels have 3", path,
                fields.get("ndims").substr(0, 40));
  }
  const auto type = metaimage_type(fields.get("elementtype"));
  if (!type) {
    return fail(ErrorCode::kInput,
                "{}: ElementType '{}' is not read; MET_UCHAR to MET_ULONG_LONG, MET_FLOAT and "
                "MET_DOUBLE are",
                path, fields.get("elementtype").substr(0, 40));
  }
  head.type = *type;
  head.big_endian = is_true(fields.get("binarydatabyteordermsb", "elementbyteordermsb"));
  head.compressed = is_true(fields.get("compresseddata"));
  const std::vector<double> channels = numbers_of(fields.get("elementnumberofchannels"));
  if (channels.size() == 1 && channels[0] >= 1.0 && channels[0] <= 1e6) {
    head.channels = static_cast<int>(channels[0]);
  }
  const std::vector<double> skip = numbers_of(fields.get("headersize"));
  if (skip.size() == 1 && skip[0] >= -1.0 && skip[0] < 1e15) {
    head.skip = static_cast<std::int64_t>(skip[0]);
  }
  head.unit_metres = unit_named(fields.get("distanceunits"));
  if (auto placed = place(fields, path, static_cast<int>(dimensions[0]), head); !placed) {
    return tl::unexpected(placed.error());
  }
  if (dimensions[0] == 2.0) head.axes.steps[2] = {0.0, 0.0, 1.0};
  return head;
}

Result<VoxelFileGrid> metaimage_grid(const MetaImageHead& head, const std::string& path) {
  auto grid = grid_of_axes(path, head.axes);
  if (grid) grid->frame.unit_metres = head.unit_metres;
  return grid;
}

}  // namespace strata
