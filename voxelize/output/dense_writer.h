#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "voxelize/output/block_output.h"
#include "voxelize/output/dense_stream.h"
#include "voxelize/output/slab_writer.h"

namespace strata {

/// A file that is a text and then the voxels as one stream. (Internal to voxelize/.)
class DenseWriter final : public SlabWriter {
 public:
  DenseWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
              DenseStream::Packing packing, BlockOutput output)
      : SlabWriter(path, grid, Axis::kX),
        output_(std::move(output)),
        stream_(grid, DenseValues(options), packing) {}

  /// @param before  bytes of the file before the stream
  /// @param head    bytes of the stream before the voxels
  Result<void> begin(std::string_view before, std::string_view head) {
    Result<void> written = output_.append(before);
    return written ? stream_.begin(output_, head) : written;
  }

 private:
  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    return stream_.append(slab, output_, execution);
  }

  Result<void> finish_output(const Execution&) override {
    if (Result<void> written = stream_.end(output_); !written) return written;
    return output_.commit();
  }

  BlockOutput output_;
  DenseStream stream_;
};

}  // namespace strata
