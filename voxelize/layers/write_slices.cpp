// A folder of PNG slices, one a layer, and slices.json, which says where a pixel is. The first row
// is the greatest y, so that a picture shows the layer as seen from above (+z), upright and not
// mirrored.

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "voxelize/layers/layer_pictures.h"
#include "voxelize/output/folder_output.h"
#include "voxelize/output/grid_text.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

class PngWriter final : public SlabWriter {
 public:
  /// @param unit  of the grid, or empty
  PngWriter(const std::string& path, const VoxelGrid& grid, LayerPictures pictures,
            std::string_view unit, FolderOutput folder)
      : SlabWriter(path, grid, pictures.runs(), pictures.needs_all()),
        pictures_(std::move(pictures)),
        unit_(unit.empty() ? "" : fmt::format("  \"unit\": \"{}\",\n", unit)),
        folder_(std::move(folder)) {}

 private:
  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    scratch_.resize(std::max(scratch_.size(), static_cast<std::size_t>(execution.thread_count())));
    const int first = pictures_.needs_all() ? 0 : slab.v_begin();
    const int last = pictures_.needs_all() ? pictures_.count() : slab.v_end();
    return FolderOutput::for_each(
        execution, static_cast<std::size_t>(last - first), [&](std::size_t index, int worker) {
          Bytes& out = scratch_[static_cast<std::size_t>(worker)];
          const int layer = first + static_cast<int>(index);
          pictures_.make(slab, layer, out);
          return folder_.write(fmt::format("slice_{:05d}.png", layer), out.data(), out.size());
        });
  }

  Result<void> finish_output(const Execution&) override {
    const VoxelGrid& g = grid();
    const std::string json = fmt::format(
        "{{\n  \"dims\": [{}, {}, {}],\n  \"origin\": [{}, {}, {}],\n"
        "  \"voxel_size\": [{}, {}, {}],\n{}  \"slices\": \"slice_%05d.png\",\n{}}}\n",
        g.dims.x, g.dims.y, g.dims.z, g.origin.x, g.origin.y, g.origin.z, g.voxel_size.x,
        g.voxel_size.y, g.voxel_size.z, unit_, pictures_.description());
    if (Result<void> written = folder_.write("slices.json", json.data(), json.size()); !written) {
      return written;
    }
    return folder_.commit();
  }

  LayerPictures pictures_;
  std::string unit_;  // a line of slices.json
  FolderOutput folder_;
  std::vector<Bytes> scratch_;  // by worker
};

}  // namespace

VoxelWriterResult open_png_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options) {
  Result<FolderOutput> folder = FolderOutput::create(path);
  if (!folder) return tl::unexpected(folder.error());
  return std::make_unique<PngWriter>(path, grid, LayerPictures(grid, options),
                                     unit_name(options.frame.unit_metres), std::move(*folder));
}

}  // namespace strata
