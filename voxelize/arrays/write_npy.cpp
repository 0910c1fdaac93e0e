// NumPy's .npy, version 1.0 (numpy/lib/format.py). Shape (nx, ny, nz), so that a[i, j, k] is voxel
// (i, j, k); fortran_order, so that x is fastest and the slabs follow one another: C order would
// need the whole array, or seeking, which pipes cannot. numpy.load treats both alike. Colours are
// a[c, i, j, k], c = 0 to 3: red, green, blue, alpha. The format
// has no place for the world transform; .npz has (write_npz.cpp), and so has a file x.npy.json
// beside it, which is written where asked.

#include <fmt/core.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/atomic_file.h"
#include "voxelize/arrays/npy_voxels.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/dense_room.h"
#include "voxelize/output/dense_stream.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

class NpyWriter final : public SlabWriter {
 public:
  NpyWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
            BlockOutput output)
      : SlabWriter(path, grid, Axis::kX, false, options.part.has_value()),
        values_(options),
        part_(options.part),
        frame_(options.frame),
        output_(std::move(output)),
        stream_(grid, values_, DenseStream::Packing::kNone) {
    if (options.sidecar && path != "-") sidecar_ = path + ".json";
  }

  Result<void> begin() {
    const std::string head = npy_head(values_, dims());
    head_bytes_ = head.size();
    return part_ && !part_->head ? Result<void>() : stream_.begin(output_, head);
  }

 private:
  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    if (part_) output_.seek(head_bytes_ + place_of_layer(dims(), values_, slab.v_begin()));
    return stream_.append(slab, output_, execution);
  }
  Result<void> finish_output(const Execution&) override {
    if (!part_ || part_->head) {
      if (auto written = write_sidecar(); !written) return written;
    }
    return output_.commit();
  }
  /// Where the grid lies: centre = direction @ (origin + (index + 0.5) * spacing).
  Result<void> write_sidecar() const {
    if (sidecar_.empty()) return {};
    const VoxelGrid& g = grid();
    std::string text =
        fmt::format("{{\n  \"origin\": [{}, {}, {}],\n  \"spacing\": [{}, {}, {}],\n", g.origin.x,
                    g.origin.y, g.origin.z, g.voxel_size.x, g.voxel_size.y, g.voxel_size.z);
    text += "  \"direction\": [";
    for (int row = 0; row < 3; ++row) {
      const glm::dmat3& d = frame_.direction;
      text += fmt::format("{}[{}, {}, {}]", row == 0 ? "" : ", ", d[0][row], d[1][row], d[2][row]);
    }
    text += "]\n}\n";
    return write_file(sidecar_, text.data(), text.size());
  }

  DenseValues values_;
  std::optional<VoxelPart> part_;
  std::size_t head_bytes_ = 0;
  GridFrame frame_;
  std::string sidecar_;  // path; empty: none
  BlockOutput output_;
  DenseStream stream_;
};

}  // namespace

VoxelWriterResult open_npy_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options) {
  const DenseValues values(options);
  const std::size_t head = npy_head(values, grid.dims).size();
  const auto room = check_dense_room(path, grid.dims, values, head);
  if (!room) return tl::unexpected(room.error());
  Result<BlockOutput> output = options.part
                                   ? Result<BlockOutput>(BlockOutput(options.part->write_at))
                                   : BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  return begun(std::make_unique<NpyWriter>(path, grid, options, std::move(*output)));
}

}  // namespace strata
