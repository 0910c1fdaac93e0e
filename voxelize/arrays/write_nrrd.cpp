// NRRD: attached header (nrrd_text.h), x fastest, gzip. Voxels are cells; "space origin" is the
// centre of the first one, as the format has it.

#include <memory>
#include <string>
#include <utility>

#include "voxelize/arrays/nrrd_text.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/dense_writer.h"
#include "voxelize/output/writers.h"

namespace strata {

VoxelWriterResult open_nrrd_writer(const std::string& path, const VoxelGrid& grid,
                                   const VoxelWriterOptions& options) {
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  return begun(std::make_unique<DenseWriter>(path, grid, options, DenseStream::Packing::kGzip,
                                             std::move(*output)),
               nrrd_text(grid, options, DenseValues(options), ""), "");
}

}  // namespace strata
