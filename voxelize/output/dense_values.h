#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>

#include "strata/voxelize/output/voxel_output.h"
#include "voxelize/output/run_deflate.h"

namespace strata {

static_assert(std::endian::native == std::endian::little, "values are copied as they are");

/// What stands for a voxel in a dense format, little-endian, and how a label becomes it. Voxels of
/// no run are 0. Formats name the types in their own files. (Internal to voxelize/.)
class DenseValues {
 public:
  enum class Kind {
    kFlags,        ///< a byte: 0 or 1
    kIds,          ///< the label: an unsigned number of 1, 2 or 4 bytes
    kShares,       ///< a byte: 0 to 255, rounded
    kFloatShares,  ///< a float: 0 to 1
    kColours,      ///< four bytes: red, green, blue, alpha
    kDistances     ///< a float; comes as a field, not as labels
  };

  explicit DenseValues(const VoxelWriterOptions& options)
      : kind(kind_of(options)), largest_(kind == Kind::kIds ? options.ids : options.fog) {
    if (kind == Kind::kFlags) {
      bits = 1;
      codes = RunBytes::kFlags;
    } else if (kind == Kind::kIds) {
      bytes = largest_ <= 0xff ? 1 : largest_ <= 0xffff ? 2 : 4;
      bits = static_cast<int>(std::bit_width(largest_));
    } else if (kind == Kind::kShares) {
      bits = 8;
    } else {
      bytes = 4;
      bits = kind == Kind::kFloatShares ? 30 : 32;  // 1.0f is the largest share
    }
    components = kind == Kind::kColours ? 4 : 1;
  }

  /// Numbers that are not whole.
  [[nodiscard]] bool is_float() const {
    return kind == Kind::kFloatShares || kind == Kind::kDistances;
  }
  /// Bits of one number of a voxel.
  [[nodiscard]] std::size_t number_bits() const { return 8 * bytes / components; }
  /// NumPy's name of the type of a number: "|u1", "<u2", "<u4" or "<f4".
  [[nodiscard]] std::string numpy_type() const {
    return {number_bits() == 8 ? '|' : '<', is_float() ? 'f' : 'u',
            static_cast<char>('0' + number_bits() / 8)};
  }

  /// The bits of a voxel of a label.
  [[nodiscard]] std::uint32_t bits_of(std::uint32_t label) const {
    if (kind == Kind::kShares) {
      return static_cast<std::uint32_t>((std::uint64_t{2} * 255 * label + largest_) /
                                        (std::uint64_t{2} * largest_));
    }
    if (kind == Kind::kFloatShares) {
      return std::bit_cast<std::uint32_t>(
          static_cast<float>(static_cast<double>(label) / static_cast<double>(largest_)));
    }
    return label;
  }
  /// The bits of voxels of slabs that have no labels: all are filled.
  [[nodiscard]] std::uint32_t unlabelled() const {
    if (kind == Kind::kColours) return 0xffffffff;
    return kind == Kind::kShares || kind == Kind::kFloatShares ? bits_of(largest_) : 1;
  }

  Kind kind;
  std::size_t bytes = 1;            ///< of a voxel
  std::size_t components = 1;       ///< numbers of a voxel
  int bits = 0;                     ///< up to the highest one that is set in any voxel
  RunBytes codes = RunBytes::kIds;  ///< that suit the bytes

 private:
  static Kind kind_of(const VoxelWriterOptions& options) {
    if (options.band != 0) return Kind::kDistances;
    if (options.rgba) return Kind::kColours;
    if (options.fog != 0) return options.fog_floats ? Kind::kFloatShares : Kind::kShares;
    return options.ids != 0 ? Kind::kIds : Kind::kFlags;
  }

  std::uint32_t largest_;  // label: of ids, or of a voxel that is filled
};

/// Calls run(interval, bits) for the intervals of column (u, v).
template <class Run>
void for_each_value(const VoxelIntervals& slab, const DenseValues& values, int u, int v,
                    Run&& run) {
  const std::span<const Interval> column = slab.column(u, v);
  const std::span<const std::uint32_t> labels = slab.column_labels(u, v);
  for (std::size_t i = 0; i < column.size(); ++i) {
    run(column[i], labels.empty() ? values.unlabelled() : values.bits_of(labels[i]));
  }
}

}  // namespace strata
