#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "strata/core/execution.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/deflated_layers.h"
#include "voxelize/output/dense_values.h"

namespace strata {

/// The voxels of a grid as one stream of bytes, x fastest, then y, then z. A packed stream is made
/// of pieces that threads deflate apart, a layer each. (Internal to voxelize/.)
class DenseStream {
 public:
  enum class Packing {
    kNone,
    kGzip,  ///< RFC 1952: one member
    kZlib   ///< RFC 1950
  };

  DenseStream(const VoxelGrid& grid, const DenseValues& values, Packing packing);

  /// @param head  bytes of the stream before the voxels
  Result<void> begin(BlockOutput& output, std::string_view head = {});
  /// Slabs of intervals along x.
  Result<void> append(const VoxelIntervals& slab, BlockOutput& output, const Execution& execution);
  Result<void> end(BlockOutput& output) const;

  /// Bytes of the voxels, not packed.
  [[nodiscard]] std::uint64_t dense_bytes() const { return layers_ * layer_bytes_; }

 private:
  Result<void> append_zlib(const VoxelIntervals& slab, BlockOutput& output,
                           const Execution& execution);

  DenseValues values_;
  Packing packing_;
  std::uint64_t layers_, layer_bytes_, head_bytes_ = 0;
  std::optional<DeflatedLayers> deflated_;  // of kGzip
  std::uint32_t checksum_ = 0;              // CRC-32 or Adler-32 of what was appended
};

}  // namespace strata
