#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "voxelize/block_output.h"
#include "voxelize/intervals.h"
#include "voxelize/run_deflate.h"

namespace strata {

/// Slabs of x intervals as one byte a voxel, 0 or 1, x fastest, then y, then z: the order of .npy,
/// .nrrd and .vti. A layer is one z. (Internal to voxelize/.)

/// The rows of a slab in blocks of about a megabyte.
class RowBlocks {
 public:
  explicit RowBlocks(const VoxelIntervals& slab)
      : slab_(slab),
        length_(static_cast<std::size_t>(slab.grid().dims.x)),
        rows_(static_cast<std::size_t>(slab.columns()) *
              static_cast<std::size_t>(slab.v_end() - slab.v_begin())),
        rows_a_block_(std::max<std::size_t>(1, (std::size_t{1} << 20) / length_)) {}

  [[nodiscard]] std::size_t count() const { return (rows_ + rows_a_block_ - 1) / rows_a_block_; }

  void make(std::size_t index, Bytes& out) const {
    const std::size_t first = index * rows_a_block_;
    const std::size_t last = std::min(first + rows_a_block_, rows_);
    out.resize((last - first) * length_);
    std::memset(out.data(), 0, out.size());
    std::byte* to = out.data();
    const auto columns = static_cast<std::size_t>(slab_.columns());
    for (std::size_t row = first; row < last; ++row, to += length_) {
      for (const Interval& interval :
           slab_.column(static_cast<int>(row % columns),
                        slab_.v_begin() + static_cast<int>(row / columns))) {
        std::memset(to + interval.begin(), 1, static_cast<std::size_t>(interval.length()));
      }
    }
  }

 private:
  const VoxelIntervals& slab_;
  std::size_t length_, rows_, rows_a_block_;
};

/// Gives the bytes of layer z of a slab as runs: run(value, length), row by row.
template <class Run>
void emit_layer(const VoxelIntervals& slab, int z, Run&& run) {
  const int length = slab.grid().dims.x;
  for (int y = 0; y < slab.columns(); ++y) {
    int done = 0;
    for (const Interval& interval : slab.column(y, z)) {
      if (interval.begin() > done) run(0, interval.begin() - done);
      run(1, interval.length());
      done = interval.end();
    }
    if (length > done) run(0, length - done);
  }
}

}  // namespace strata
