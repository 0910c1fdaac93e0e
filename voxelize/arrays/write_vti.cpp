// VTK XML image data (vtkXMLImageDataWriter), appended raw, one number a cell (four of colours), x
// fastest.
// Cells, so that a voxel is a box: extent 0..n, origin at the corner of the grid. A layer is a zlib
// block of vtkZLibDataCompressor; the table of their sizes stands before them and is filled in at
// the end. A pipe cannot be filled in later, and gets the bytes as they are.

#include <fmt/core.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/markup.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/dense_rows.h"
#include "voxelize/output/dense_stream.h"
#include "voxelize/output/grid_text.h"
#include "voxelize/output/run_deflate.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

class VtiWriter final : public SlabWriter {
 public:
  VtiWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
            BlockOutput output)
      : SlabWriter(path, grid, Axis::kX),
        values_(options),
        frame_(options.frame),
        output_(std::move(output)),
        plain_(grid, values_, DenseStream::Packing::kNone) {}

  Result<void> begin(const std::string& name) {
    const VoxelGrid& g = grid();
    const std::string extent = fmt::format("0 {} 0 {} 0 {}", g.dims.x, g.dims.y, g.dims.z);
    const std::string title = escape_markup(one_line(name));
    const glm::dvec3 corner = frame_.world(g.origin);
    const std::string header = fmt::format(
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" "
        "header_type=\"UInt64\"{}>\n"
        "  <ImageData WholeExtent=\"{}\" Origin=\"{} {} {}\" Spacing=\"{} {} {}\"{}>\n"
        "    <Piece Extent=\"{}\">\n"
        "      <PointData/>\n"
        "      <CellData Scalars=\"{}\">\n"
        "        <DataArray type=\"{}{}\" Name=\"{}\"{} format=\"appended\" offset=\"0\"/>\n"
        "      </CellData>\n    </Piece>\n  </ImageData>\n  <AppendedData encoding=\"raw\">\n_",
        compressed() ? " compressor=\"vtkZLibDataCompressor\"" : "", extent, corner.x, corner.y,
        corner.z, g.voxel_size.x, g.voxel_size.y, g.voxel_size.z, direction(), extent, title,
        values_.is_float() ? "Float" : "UInt", values_.number_bits(), title,
        values_.components == 1 ? "" : " NumberOfComponents=\"4\"");
    if (Result<void> written = output_.append(header); !written) return written;
    table_position_ = output_.position();
    const auto layers = static_cast<std::uint64_t>(g.dims.z);
    if (compressed()) {
      // Blocks, bytes of a block, bytes of a shorter last one (none), compressed sizes.
      table_ = {layers, plain_.dense_bytes() / layers, 0};
      table_.resize(table_.size() + layers);
    } else {
      table_ = {plain_.dense_bytes()};
    }
    return output_.append(table_.data(), table_.size() * sizeof(std::uint64_t));
  }

 private:
  /// Of VTK 9: rows of the matrix.
  [[nodiscard]] std::string direction() const {
    if (!frame_.turned()) return {};
    std::string text = " Direction=\"";
    for (int i = 0; i < 9; ++i) {
      text += fmt::format("{}{}", i == 0 ? "" : " ", frame_.direction[i % 3][i / 3] + 0.0);
    }
    return text + "\"";
  }
  [[nodiscard]] bool compressed() const { return !output_.sequential(); }

  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    if (!compressed()) return plain_.append(slab, output_, execution);
    const auto layers = static_cast<std::size_t>(slab.v_end() - slab.v_begin());
    return output_.append_blocks(execution, layers, [&](std::size_t index, Bytes& out, int) {
      const int z = slab.v_begin() + static_cast<int>(index);
      out.clear();
      RunDeflater deflater(values_.codes, values_.bytes);
      append_zlib_stream(deflater, out, [&](RunDeflater& to) {
        emit_layer(slab, values_, z, [&](std::uint32_t value, int length) {
          to.run(value, static_cast<std::uint64_t>(length));
        });
      });
      table_[3 + static_cast<std::size_t>(z)] = out.size();
    });
  }

  Result<void> finish_output(const Execution&) override {
    if (Result<void> written = output_.append("\n  </AppendedData>\n</VTKFile>\n"); !written) {
      return written;
    }
    if (compressed()) {
      Result<void> patched =
          output_.patch(table_position_, table_.data(), table_.size() * sizeof(std::uint64_t));
      if (!patched) return patched;
    }
    return output_.commit();
  }

  DenseValues values_;
  GridFrame frame_;
  BlockOutput output_;
  DenseStream plain_;  // for a pipe
  std::uint64_t table_position_ = 0;
  std::vector<std::uint64_t> table_;
};

}  // namespace

VoxelWriterResult open_vti_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options) {
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  return begun(std::make_unique<VtiWriter>(path, grid, options, std::move(*output)), options.name);
}

}  // namespace strata
