#include "voxelize/heads/nifti_head.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>

namespace strata {
namespace {

/// Fields of a head of either version and byte order.
class NiftiFields {
 public:
  NiftiFields(std::string_view bytes, bool second, bool swapped)
      : bytes_(bytes), second_(second), swapped_(swapped) {}

  /// A field that has the same type in both versions.
  template <class T>
  [[nodiscard]] T get(std::size_t at) const {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + at, sizeof(T));
    if (swapped_) std::reverse(raw.begin(), raw.end());
    T value;
    std::memcpy(&value, raw.data(), sizeof(T));
    return value;
  }
  /// One of a list of floats or doubles. @param first, second  where it begins in each version
  [[nodiscard]] double real(std::size_t first, std::size_t second, std::size_t index = 0) const {
    return second_ ? get<double>(second + 8 * index)
                   : static_cast<double>(get<float>(first + 4 * index));
  }
  [[nodiscard]] double size(std::size_t index) const {
    return second_ ? static_cast<double>(get<std::int64_t>(16 + 8 * index))
                   : get<std::int16_t>(40 + 2 * index);
  }
  [[nodiscard]] int code(std::size_t first, std::size_t second) const {
    return second_ ? get<std::int32_t>(second) : get<std::int16_t>(first);
  }

 private:
  std::string_view bytes_;
  bool second_, swapped_;
};

std::optional<NumberType> nifti_type(int code) {
  switch (code) {
    case 2:
      return NumberType::kU8;
    case 4:
      return NumberType::kI16;
    case 8:
      return NumberType::kI32;
    case 16:
      return NumberType::kF32;
    case 64:
      return NumberType::kF64;
    case 256:
      return NumberType::kI8;
    case 512:
      return NumberType::kU16;
    case 768:
      return NumberType::kU32;
    case 1024:
      return NumberType::kI64;
    case 1280:
      return NumberType::kU64;
    default:
      return std::nullopt;
  }
}

/// Method 2 of nifti1.h: a quaternion, spacings and an offset.
void place_by_qform(const NiftiFields& fields, const glm::dvec3& spacing, GridAxes& axes) {
  const double b = fields.real(256, 352), c = fields.real(260, 360), d = fields.real(264, 368);
  const double a = std::sqrt(std::max(0.0, 1.0 - (b * b + c * c + d * d)));
  const double flip = fields.real(76, 104) < 0.0 ? -1.0 : 1.0;
  const glm::dvec3 x(a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c));
  const glm::dvec3 y(2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b));
  const glm::dvec3 z(2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c);
  axes.steps = glm::dmat3(x * spacing.x, y * spacing.y, z * (flip * spacing.z));
  axes.place = {fields.real(268, 376), fields.real(272, 384), fields.real(276, 392)};
}

/// Method 3: an affine matrix, by rows.
void place_by_sform(const NiftiFields& fields, GridAxes& axes) {
  for (int row = 0; row < 3; ++row) {
    const auto r = static_cast<std::size_t>(row);
    for (int column = 0; column < 3; ++column) {
      axes.steps[column][row] =
          fields.real(280 + 16 * r, 400 + 32 * r, static_cast<std::size_t>(column));
    }
    axes.place[row] = fields.real(280 + 16 * r, 400 + 32 * r, 3);
  }
}

void place(const NiftiFields& fields, NiftiHead& head) {
  glm::dvec3 spacing(1.0);
  for (int axis = 0; axis < 3; ++axis) {
    spacing[axis] = std::abs(fields.real(76, 104, 1 + static_cast<std::size_t>(axis)));
    if (spacing[axis] == 0.0) spacing[axis] = 1.0;
    head.axes.steps[axis][axis] = spacing[axis];
  }
  const int qform = fields.code(252, 344), sform = fields.code(254, 348);
  head.placed = qform > 0 || sform > 0;
  if (sform > 0) {
    place_by_sform(fields, head.axes);
  } else if (qform > 0) {
    place_by_qform(fields, spacing, head.axes);
  }
}

}  // namespace

Result<NiftiHead> parse_nifti_head(std::string_view bytes, const std::string& path) {
  constexpr std::int32_t kFirst = 348, kSecond = 540;
  bool second = false, swapped = false, known = false;
  if (bytes.size() >= 348) {
    for (const bool swap : {false, true}) {
      const auto size = NiftiFields(bytes, false, swap).get<std::int32_t>(0);
      if (size != kFirst && size != kSecond) continue;
      known = true, swapped = swap, second = size == kSecond;
    }
  }
  const std::string_view magic = !known ? "" : bytes.substr(second ? 4 : 344, 3);
  const bool single = magic == "n+1" || magic == "n+2";
  if (!single || (second && bytes.size() < 540)) {
    if (magic == "ni1" || magic == "ni2") {
      return fail(ErrorCode::kInput,
                  "{}: the voxels are in another file, .img; single files, .nii, are read", path);
    }
    return fail(ErrorCode::kInput, "{}: not a NIfTI file: its head must be 348 or 540 bytes long",
                path);
  }
  const NiftiFields fields(bytes, second, swapped);
  NiftiHead head;
  head.big_endian = swapped;
  const auto dimensions = static_cast<int>(fields.size(0));
  if (dimensions < 2 || dimensions > 7) {
    return fail(ErrorCode::kInput, "{}: {} dimensions; voxels have 3", path, dimensions);
  }
  for (std::size_t axis = 1; axis <= static_cast<std::size_t>(dimensions); ++axis) {
    if (axis <= 3) head.axes.sizes[axis - 1] = fields.size(axis);
    if (axis > 3) head.volumes *= std::max(1.0, fields.size(axis));
  }
  if (dimensions == 2) head.axes.sizes[2] = 1.0;
  const int code = second ? fields.get<std::int16_t>(12) : fields.get<std::int16_t>(70);
  constexpr int kRgba32 = 2304;
  head.colours = code == kRgba32;
  const std::optional<NumberType> type = head.colours ? NumberType::kU32 : nifti_type(code);
  if (!type) {
    return fail(ErrorCode::kInput,
                "{}: data type {}; whole numbers, float, double and RGBA are read", path, code);
  }
  head.type = *type;
  const double at = second ? static_cast<double>(fields.get<std::int64_t>(168))
                           : static_cast<double>(fields.get<float>(108));
  const double least = second ? kSecond : kFirst;
  head.data_at = static_cast<std::uint64_t>(at >= least && at < 1e15 ? at : least + 4);
  head.slope = fields.real(112, 176);
  head.intercept = fields.real(116, 184);
  constexpr double kUnits[] = {0.0, 1.0, 1e-3, 1e-6};
  const int unit = (second ? fields.get<std::int32_t>(500) : fields.get<std::uint8_t>(123)) & 7;
  head.unit_metres = unit <= 3 ? kUnits[unit] : 0.0;
  place(fields, head);
  return head;
}

Result<VoxelFileGrid> nifti_grid(const NiftiHead& head, const std::string& path) {
  auto grid = grid_of_axes(path, head.axes);
  if (!grid) return grid;
  grid->frame.unit_metres = head.unit_metres;
  grid->frame.space = "right-anterior-superior";
  return grid;
}

}  // namespace strata
