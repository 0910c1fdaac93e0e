#pragma once

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "voxelize/output/block_output.h"
#include "voxelize/output/dense_rows.h"
#include "voxelize/output/run_deflate.h"

namespace strata {

/// CRC-32 of a layer whose rows are given as runs of values among zeros. But for a constant that
/// only the length tells, a CRC is linear over XOR: a row's is the XOR of what the ends of its runs
/// give, bit by bit of the value, and one table look-up a byte of the CRC moves it on by a row.
/// (Internal to voxelize/.)
class LayerCrc {
 public:
  LayerCrc(int length, int rows, const DenseValues& values)
      : values_(values), length_(static_cast<std::size_t>(length)) {
    uLong zeros = 0;
    for (int bit = 0; bit < values.bits; ++bit) {
      const std::uint32_t zero = 0, one = std::uint32_t{1} << bit;
      std::vector<std::uint32_t>& tail = tails_.emplace_back(length_ + 1);
      zeros = crc32(0, nullptr, 0);
      uLong ones = zeros;
      for (std::size_t i = 1; i <= length_; ++i) {
        zeros = crc32_z(zeros, reinterpret_cast<const Bytef*>(&zero), values.bytes);
        ones = crc32_z(ones, reinterpret_cast<const Bytef*>(&one), values.bytes);
        tail[i] = static_cast<std::uint32_t>(ones ^ zeros);
      }
    }
    const uLong row = crc32_combine_gen(static_cast<z_off_t>(length_ * values.bytes));
    for (std::size_t byte = 0; byte < 4; ++byte) {
      for (std::size_t value = 0; value < 256; ++value) {
        next_row_[byte][value] =
            static_cast<std::uint32_t>(crc32_combine_op(value << (8 * byte), 0, row));
      }
    }
    uLong constant = crc32(0, nullptr, 0);
    for (int i = 0; i < rows; ++i) constant = crc32_combine_op(constant, zeros, row);
    constant_ = static_cast<std::uint32_t>(constant);
  }

  [[nodiscard]] uLong of(const VoxelIntervals& slab, int z) const {
    if (values_.kind == DenseValues::Kind::kDistances) return of_floats(slab, z);
    std::uint32_t sum = 0;
    for (int y = 0; y < slab.columns(); ++y) {
      sum = next_row_[0][sum & 0xff] ^ next_row_[1][sum >> 8 & 0xff] ^
            next_row_[2][sum >> 16 & 0xff] ^ next_row_[3][sum >> 24];
      for_each_value(slab, values_, y, z, [&](const Interval& interval, std::uint32_t value) {
        const std::size_t from = length_ - static_cast<std::size_t>(interval.begin());
        const std::size_t to = length_ - static_cast<std::size_t>(interval.end());
        for (; value != 0; value &= value - 1) {
          const auto& tail = tails_[static_cast<std::size_t>(std::countr_zero(value))];
          sum ^= tail[from] ^ tail[to];
        }
      });
    }
    return sum ^ constant_;
  }

 private:
  /// Of rows where runs are as short as a voxel.
  [[nodiscard]] uLong of_floats(const VoxelIntervals& slab, int z) const {
    std::vector<std::uint32_t> row(length_);
    uLong crc = crc32(0, nullptr, 0);
    for (int y = 0; y < slab.columns(); ++y) {
      std::fill(row.begin(), row.end(), 0);
      for_each_value(slab, values_, y, z, [&](const Interval& interval, std::uint32_t value) {
        std::fill_n(row.begin() + interval.begin(), interval.length(), value);
      });
      crc = crc32_z(crc, reinterpret_cast<const Bytef*>(row.data()), length_ * sizeof row[0]);
    }
    return crc;
  }

  DenseValues values_;
  std::size_t length_;
  std::vector<std::vector<std::uint32_t>> tails_;  // by bit: of so many ones at the end of a row
  std::array<std::array<std::uint32_t, 256>, 4> next_row_;
  std::uint32_t constant_ = 0;  // the CRC of zeros
};

/// The layers of a grid as one raw deflate stream, made from runs. (Internal to voxelize/.)
class DeflatedLayers {
 public:
  /// What ends the stream: an empty block of fixed codes, marked as the last.
  static constexpr std::string_view kEnd{"\x03\x00", 2};
  /// What stands before the stream in gzip (RFC 1952): magic, deflate, no flags, no time stamp,
  /// fastest, Unix.
  static constexpr std::string_view kGzipHead{"\x1f\x8b\x08\x00\x00\x00\x00\x00\x04\x03", 10};
  /// What ends the stream and the gzip around it.
  /// @param crc, bytes  CRC-32 and number of all bytes before deflation
  [[nodiscard]] static std::string gzip_end(std::uint32_t crc, std::uint64_t bytes) {
    std::string end(kEnd);
    for (const std::uint64_t value : {std::uint64_t{crc}, bytes}) {
      for (int i = 0; i < 4; ++i) end += static_cast<char>(value >> (8 * i) & 0xff);
    }
    return end;
  }

  DeflatedLayers(const VoxelGrid& grid, const DenseValues& values)
      : values_(values),
        layer_crc_(grid.dims.x, grid.dims.y, values),
        layer_bytes_(static_cast<z_off_t>(values.bytes) * grid.dims.x * grid.dims.y) {}

  /// Appends the layers of a slab to `output`.
  /// @param crc  the CRC-32 of what came before them; theirs is taken in
  Result<void> append(const VoxelIntervals& slab, BlockOutput& output, std::uint32_t& crc,
                      const Execution& execution) const {
    std::vector<uLong> crcs(static_cast<std::size_t>(slab.v_end() - slab.v_begin()));
    Result<void> written =
        output.append_blocks(execution, crcs.size(), [&](std::size_t index, Bytes& out, int) {
          const int z = slab.v_begin() + static_cast<int>(index);
          out.clear();
          RunDeflater deflater(values_.codes, values_.bytes);
          deflater.begin(out, false);
          emit_layer(slab, values_, z, [&](std::uint32_t value, int length) {
            deflater.run(value, static_cast<std::uint64_t>(length));
          });
          deflater.end();
          crcs[index] = layer_crc_.of(slab, z);
        });
    for (const uLong layer : crcs) {
      crc = static_cast<std::uint32_t>(crc32_combine(crc, layer, layer_bytes_));
    }
    return written;
  }

 private:
  DenseValues values_;
  LayerCrc layer_crc_;
  z_off_t layer_bytes_;
};

}  // namespace strata
