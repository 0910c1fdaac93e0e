// The bytes of the voxels, x fastest, little-endian, and beside them a detached NRRD header that
// says what they are (nrrd_text.h): `part.raw` and `part.nhdr`, which ITK, ParaView and 3D Slicer
// open.

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "voxelize/arrays/nrrd_text.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/dense_room.h"
#include "voxelize/output/dense_rows.h"
#include "voxelize/output/dense_stream.h"
#include "voxelize/output/file_pair.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

class RawWriter final : public SlabWriter {
 public:
  RawWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
            std::optional<BlockOutput> head, BlockOutput data)
      : SlabWriter(path, grid, Axis::kX, false, options.part.has_value()),
        part_(options.part.has_value()),
        values_(options),
        head_(std::move(head)),
        data_(std::move(data)),
        stream_(grid, values_, DenseStream::Packing::kNone) {}

  Result<void> begin(const VoxelWriterOptions& options, const std::string& data_file) {
    if (!head_) return {};
    return head_->append(nrrd_text(grid(), options, values_, data_file));
  }

 private:
  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    if (part_) data_.seek(place_of_layer(dims(), values_, slab.v_begin()));
    return stream_.append(slab, data_, execution);
  }

  Result<void> finish_output(const Execution&) override {
    if (Result<void> there = data_.commit(); !there) return there;
    return head_ ? head_->commit() : Result<void>();
  }

  bool part_;
  DenseValues values_;
  std::optional<BlockOutput> head_;  // not of a pipe
  BlockOutput data_;
  DenseStream stream_;
};

}  // namespace

VoxelWriterResult open_raw_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options) {
  const FilePair pair(path, ".nhdr", ".raw");
  const auto room = check_dense_room(pair.data, grid.dims, DenseValues(options));
  if (!room) return tl::unexpected(room.error());
  Result<BlockOutput> data = options.part ? Result<BlockOutput>(BlockOutput(options.part->write_at))
                                          : BlockOutput::create(pair.data);
  if (!data) return tl::unexpected(data.error());
  std::optional<BlockOutput> head;
  if (!data->sequential() && (!options.part || options.part->head)) {
    Result<BlockOutput> created = BlockOutput::create(pair.head);
    if (!created) return tl::unexpected(created.error());
    head = std::move(*created);
  }
  return begun(std::make_unique<RawWriter>(path, grid, options, std::move(head), std::move(*data)),
               options, pair.data_name());
}

}  // namespace strata
