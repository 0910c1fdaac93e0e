#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

#include "strata/core/grid.h"
#include "voxelize/volume/read_context.h"

namespace strata {

/// The type of a number in a file. (Internal to voxelize/.)
enum class NumberType { kBool, kU8, kI8, kU16, kI16, kU32, kI32, kU64, kI64, kF16, kF32, kF64 };
[[nodiscard]] std::size_t bytes_of(NumberType type);
/// "bool", "uint8", ..., "float", "double".
[[nodiscard]] std::string_view name_of(NumberType type);
[[nodiscard]] bool is_float(NumberType type);
/// Of NumPy's code without its byte order, such as "f4".
[[nodiscard]] std::optional<NumberType> numpy_type(std::string_view letters);

/// How the numbers of an array stand in a file.
struct DenseLayout {
  VoxelGrid grid;
  NumberType type = NumberType::kU8;
  bool big_endian = false;
  std::array<int, 3> axes{0, 1, 2};  ///< x, y or z: the file's fastest axis first
  std::array<bool, 3> flipped{};     ///< by the file's axes: the greatest index comes first
  [[nodiscard]] std::uint64_t bytes() const {
    return static_cast<std::uint64_t>(grid.dims.x) * static_cast<std::uint64_t>(grid.dims.y) *
           static_cast<std::uint64_t>(grid.dims.z) * bytes_of(type);
  }
};

/// The numbers: in memory, or one piece after the other.
struct DenseData {
  std::string_view all{};
  /// Fills `to` with the bytes that follow; used where `all` is empty.
  std::function<Result<void>(std::byte* to, std::size_t bytes)> next{};
};

/// Turns numbers of a file into floats or ids.
class RowConverter {
 public:
  explicit RowConverter(const DenseLayout& layout)
      : type_(layout.type), big_endian_(layout.big_endian) {}
  void to_floats(const std::byte* from, std::size_t count, float* to) const;
  /// @return false if a number is negative or above 2^32 - 1
  [[nodiscard]] bool to_ids(const std::byte* from, std::size_t count, std::uint32_t* to) const;

 private:
  NumberType type_;
  bool big_endian_;
};

/// Puts a row of values along `axis` into a field without a shift; `at` is its first voxel. A block
/// that has the values already takes no room.
void put_row(ScalarField& field, int axis, const float* row, int count, const glm::ivec3& at);

/// Reads an array in rows, never as a whole: booleans and ids become runs, other numbers a field,
/// whose kind depends on them.
/// @pre check_dims; data.all, if not empty, is layout.bytes() long
Result<VoxelVolume> read_dense(ReadContext& context, const DenseLayout& layout,
                               const DenseData& data);

/// The set, kind and threshold of `volume` from its values. The kind stays if it is kFog,
/// kDistances or kIds; kMask means that it is unknown.
Result<void> settle_values(ReadContext& context, VoxelVolume& volume, const VoxelGrid& grid);
/// Makes labels that are packed colours, as ReadContext::colours has them, numbers of a palette.
void settle_colours(VoxelVolume& volume);
/// Takes ids that are all 1, or all the largest value of their type, for a mask.
void settle_ids(VoxelVolume& volume, std::uint32_t largest_of_type);
/// Whether ids of 8 bits are rather filled fractions: 255 is more frequent than any other, and
/// there are others. Not where the user said that they are ids.
[[nodiscard]] bool are_fractions(const ReadContext& context, const VoxelVolume& volume);
/// The kind of a volume of ids or, with NumberType::kBool, of a mask. @return kInput, with
/// ReadContext::wants_values, if they are rather filled fractions
Result<void> settle_integers(ReadContext& context, VoxelVolume& volume, NumberType type);
/// Makes labels of 8 bits the values of voxels, and settles these. @return kLimit, kCancelled
Result<void> labels_to_values(ReadContext& context, VoxelVolume& volume,
                              const std::array<float, 256>& value_of_label);

}  // namespace strata
