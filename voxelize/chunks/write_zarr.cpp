// A Zarr version 2 array (zarr.readthedocs.io/en/stable/spec/v2.html): shape (nx, ny, nz), of
// colours (nx, ny, nz, 4), C order (zarr_chunks.h). The world transform stands in the
// attributes.

#include <fmt/core.h>

#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "voxelize/chunks/zarr_chunks.h"
#include "voxelize/output/folder_output.h"
#include "voxelize/output/grid_text.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

class ZarrWriter final : public SlabWriter {
 public:
  ZarrWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
             FolderOutput folder)
      : SlabWriter(path, grid, Axis::kZ, false, options.part.has_value()),
        head_(!options.part || options.part->head),
        values_(options),
        unit_(unit_name(options.frame.unit_metres)),
        folder_(std::move(folder)),
        chunks_(values_, ZarrChunks::Order::kXyz, [this](const glm::ivec3& chunk, std::size_t) {
          return fmt::format("{}.{}.{}{}", chunk.x, chunk.y, chunk.z,
                             values_.components == 1 ? "" : ".0");
        }) {}

 private:
  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    return chunks_.write(slab, folder_, execution);
  }

  Result<void> finish_output(const Execution&) override {
    if (!head_) return folder_.commit();
    const VoxelGrid& g = grid();
    const glm::dvec3 size = g.voxel_size, centre = g.origin + 0.5 * size;
    const std::string array = fmt::format(
        "{{\n  \"chunks\": [{0}, {0}, {0}{5}],\n  \"compressor\": {{\"id\": \"zlib\", \"level\": "
        "1}},\n"
        "  \"dtype\": \"{4}\",\n  \"fill_value\": 0,\n  \"filters\": null,\n  \"order\": "
        "\"C\",\n"
        "  \"shape\": [{1}, {2}, {3}{5}],\n  \"zarr_format\": 2\n}}\n",
        ZarrChunks::kSide, g.dims.x, g.dims.y, g.dims.z, values_.numpy_type(),
        values_.components == 1 ? "" : ", 4");
    const std::string unit = unit_.empty() ? "" : fmt::format("  \"unit\": \"{}\",\n", unit_);
    const std::string attributes = fmt::format(
        "{{\n  \"axes\": [\"x\", \"y\", \"z\"{}],\n  \"origin\": [{}, {}, {}],\n"
        "  \"voxel_size\": [{}, {}, {}],\n"
        "{}"
        "  \"world_from_index\": [[{}, 0, 0, {}], [0, {}, 0, {}], [0, 0, {}, {}], [0, 0, 0, 1]]\n"
        "}}\n",
        values_.components == 1 ? "" : ", \"c\"", g.origin.x, g.origin.y, g.origin.z, size.x,
        size.y, size.z, unit, size.x, centre.x, size.y, centre.y, size.z, centre.z);
    for (const auto& [name, text] : {std::pair{".zarray", &array}, {".zattrs", &attributes}}) {
      if (Result<void> written = folder_.write(name, text->data(), text->size()); !written) {
        return written;
      }
    }
    return folder_.commit();
  }

  bool head_;
  DenseValues values_;
  std::string_view unit_;  // of the grid, or empty
  FolderOutput folder_;
  ZarrChunks chunks_;
};

}  // namespace

VoxelWriterResult open_zarr_writer(const std::string& path, const VoxelGrid& grid,
                                   const VoxelWriterOptions& options) {
  Result<FolderOutput> folder =
      options.part ? FolderOutput::join(options.part->folder) : FolderOutput::create(path);
  if (!folder) return tl::unexpected(folder.error());
  return std::make_unique<ZarrWriter>(path, grid, options, std::move(*folder));
}

}  // namespace strata
