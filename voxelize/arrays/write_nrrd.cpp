// NRRD: attached header (nrrd_text.h), x fastest, gzip. Voxels are cells; "space origin" is the
// centre of the first one, as the format has it.

#include <memory>
#include <string>
#include <utility>

#include "voxelize/arrays/nrrd_text.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/dense_stream.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

class NrrdWriter final : public SlabWriter {
 public:
  NrrdWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
             BlockOutput output)
      : SlabWriter(path, grid, Axis::kX),
        values_(options),
        output_(std::move(output)),
        stream_(grid, values_, DenseStream::Packing::kGzip) {}

  Result<void> begin(const VoxelWriterOptions& options) {
    auto written = output_.append(nrrd_text(grid(), options, values_, ""));
    return written ? stream_.begin(output_) : written;
  }

 private:
  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    return stream_.append(slab, output_, execution);
  }

  Result<void> finish_output(const Execution&) override {
    if (Result<void> written = stream_.end(output_); !written) return written;
    return output_.commit();
  }

  DenseValues values_;
  BlockOutput output_;
  DenseStream stream_;
};

}  // namespace

VoxelWriterResult open_nrrd_writer(const std::string& path, const VoxelGrid& grid,
                                   const VoxelWriterOptions& options) {
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  return begun(std::make_unique<NrrdWriter>(path, grid, options, std::move(*output)), options);
}

}  // namespace strata
