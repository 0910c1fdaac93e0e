// NRRD, version 4 (Kindlmann, teem.sourceforge.net/nrrd/format.html): attached header, x fastest,
// gzip. Voxels are cells; "space origin" is the centre of the first one, as the format
// has it. The gzip stream is one member, made of pieces that threads deflate apart, a layer each.

#include <fmt/core.h>
#include <zlib.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "voxelize/output/block_output.h"
#include "voxelize/output/deflated_layers.h"
#include "voxelize/output/dense_rows.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

std::string one_line(std::string text) {
  for (char& letter : text) {
    if (static_cast<unsigned char>(letter) < ' ') letter = ' ';
  }
  return text;
}

std::string type_name(const DenseValues& values) {
  if (values.is_float()) return "float";
  return fmt::format("uint{}", values.number_bits());
}

class NrrdWriter final : public SlabWriter {
 public:
  NrrdWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
             BlockOutput output)
      : SlabWriter(path, grid, Axis::kX),
        values_(options),
        output_(std::move(output)),
        layers_(grid, values_) {}

  Result<void> begin(const std::string& name) {
    const VoxelGrid& g = grid();
    const glm::dvec3 centre = g.origin + 0.5 * g.voxel_size;
    const bool colours = values_.kind == DenseValues::Kind::kColours;  // the fastest axis
    std::string header = fmt::format(
        "NRRD0004\n# Complete NRRD file format specification at:\n"
        "# http://teem.sourceforge.net/nrrd/format.html\n"
        "content: {}\ntype: {}\n{}dimension: {}\nspace dimension: 3\nsizes: {}{} {} {}\n"
        "space directions: {}({},0,0) (0,{},0) (0,0,{})\nspace origin: ({},{},{})\n"
        "centers: {}cell cell cell\nkinds: {}domain domain domain\nencoding: gzip\n\n",
        one_line(name), type_name(values_), values_.number_bits() == 8 ? "" : "endian: little\n",
        colours ? 4 : 3, colours ? "4 " : "", g.dims.x, g.dims.y, g.dims.z, colours ? "none " : "",
        g.voxel_size.x, g.voxel_size.y, g.voxel_size.z, centre.x, centre.y, centre.z,
        colours ? "??? " : "", colours ? "RGBA-color " : "");
    // Magic, deflate, no flags, no time stamp, fastest, Unix (RFC 1952).
    header.append("\x1f\x8b\x08\x00\x00\x00\x00\x00\x04\x03", 10);
    return output_.append(header);
  }

 private:
  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    return layers_.append(slab, output_, crc_, execution);
  }

  Result<void> finish_output(const Execution&) override {
    std::string end(DeflatedLayers::kEnd);
    const std::uint64_t bytes = static_cast<std::uint64_t>(dims().x) *
                                static_cast<std::uint64_t>(dims().y) *
                                static_cast<std::uint64_t>(dims().z) * values_.bytes;
    for (const std::uint64_t value : {std::uint64_t{crc_}, bytes}) {
      for (int i = 0; i < 4; ++i) end += static_cast<char>(value >> (8 * i) & 0xff);
    }
    if (Result<void> written = output_.append(end); !written) return written;
    return output_.commit();
  }

  DenseValues values_;
  BlockOutput output_;
  DeflatedLayers layers_;
  std::uint32_t crc_ = 0;
};

}  // namespace

VoxelWriterResult open_nrrd_writer(const std::string& path, const VoxelGrid& grid,
                                   const VoxelWriterOptions& options) {
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  auto writer = std::make_unique<NrrdWriter>(path, grid, options, std::move(*output));
  if (Result<void> begun = writer->begin(options.name); !begun) {
    return tl::unexpected(begun.error());
  }
  return writer;
}

}  // namespace strata
