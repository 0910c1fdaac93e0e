#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>

#include "strata/voxelize/intervals.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/dense_values.h"

namespace strata {

/// Slabs of x intervals as one value a voxel, 0 outside, x fastest, then y, then z: the order of
/// .npy, .nrrd and .vti. A layer is one z. (Internal to voxelize/.)

/// The rows of a slab in blocks of about a megabyte.
class RowBlocks {
 public:
  RowBlocks(const VoxelIntervals& slab, const DenseValues& values)
      : slab_(slab),
        values_(values),
        bytes_(values.bytes),
        length_(static_cast<std::size_t>(slab.grid().dims.x)),
        rows_(static_cast<std::size_t>(slab.columns()) *
              static_cast<std::size_t>(slab.v_end() - slab.v_begin())),
        rows_a_block_(std::max<std::size_t>(1, (std::size_t{1} << 20) / (length_ * bytes_))) {}

  [[nodiscard]] std::size_t count() const { return (rows_ + rows_a_block_ - 1) / rows_a_block_; }

  void make(std::size_t index, Bytes& out) const {
    const std::size_t first = index * rows_a_block_;
    const std::size_t last = std::min(first + rows_a_block_, rows_);
    out.resize((last - first) * length_ * bytes_);
    std::memset(out.data(), 0, out.size());
    std::byte* to = out.data();
    const auto columns = static_cast<std::size_t>(slab_.columns());
    for (std::size_t row = first; row < last; ++row, to += length_ * bytes_) {
      for_each_value(
          slab_, values_, static_cast<int>(row % columns),
          slab_.v_begin() + static_cast<int>(row / columns),
          [&](const Interval& interval, std::uint32_t value) { fill(to, interval, value); });
    }
  }

 private:
  // Rows begin at multiples of a value's size.
  void fill(std::byte* row, const Interval& interval, std::uint32_t value) const {
    std::byte* to = row + static_cast<std::size_t>(interval.begin()) * bytes_;
    const auto count = static_cast<std::size_t>(interval.length());
    if (bytes_ == 1) {
      std::memset(to, static_cast<int>(value), count);
    } else if (bytes_ == 2) {
      std::fill_n(reinterpret_cast<std::uint16_t*>(to), count, static_cast<std::uint16_t>(value));
    } else {
      std::fill_n(reinterpret_cast<std::uint32_t*>(to), count, value);
    }
  }

  const VoxelIntervals& slab_;
  const DenseValues& values_;
  std::size_t bytes_, length_, rows_, rows_a_block_;
};

/// Gives the values of rows y_begin to y_end - 1 of layer z of a slab as runs: run(value, length).
template <class Run>
void emit_rows(const VoxelIntervals& slab, const DenseValues& values, int z, int y_begin, int y_end,
               Run&& run) {
  const int length = slab.grid().dims.x;
  for (int y = y_begin; y < y_end; ++y) {
    int done = 0;
    for_each_value(slab, values, y, z, [&](const Interval& interval, std::uint32_t value) {
      if (interval.begin() > done) run(std::uint32_t{0}, interval.begin() - done);
      run(value, interval.length());
      done = interval.end();
    });
    if (length > done) run(std::uint32_t{0}, length - done);
  }
}

/// The same of a whole layer.
template <class Run>
void emit_layer(const VoxelIntervals& slab, const DenseValues& values, int z, Run&& run) {
  emit_rows(slab, values, z, 0, slab.columns(), std::forward<Run>(run));
}

}  // namespace strata
