// NRRD, version 4 (Kindlmann, teem.sourceforge.net/nrrd/format.html): attached header, unsigned, x
// fastest, gzip. Voxels are cells; "space origin" is the centre of the first one, as the format
// has it. The gzip stream is one member, made of pieces that threads deflate apart, a layer each.

#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <bit>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "voxelize/block_output.h"
#include "voxelize/dense_rows.h"
#include "voxelize/run_deflate.h"
#include "voxelize/slab_writer.h"
#include "voxelize/writers.h"

namespace strata {
namespace {

/// CRC-32 of a layer whose rows are given as runs of values among zeros. But for a constant that
/// only the length tells, a CRC is linear over XOR: a row's is the XOR of what the ends of its runs
/// give, bit by bit of the value, and one table look-up a byte of the CRC moves it on by a row.
class LayerCrc {
 public:
  LayerCrc(int length, int rows, const DenseValues& values)
      : length_(static_cast<std::size_t>(length)) {
    uLong zeros = 0;
    for (int bit = 0; bit < values.bits; ++bit) {
      const std::uint32_t zero = 0, one = std::uint32_t{1} << bit;
      std::vector<std::uint32_t>& tail = tails_.emplace_back(length_ + 1);
      zeros = crc32(0, nullptr, 0);
      uLong ones = zeros;
      for (std::size_t i = 1; i <= length_; ++i) {
        zeros = crc32_z(zeros, reinterpret_cast<const Bytef*>(&zero), values.bytes);
        ones = crc32_z(ones, reinterpret_cast<const Bytef*>(&one), values.bytes);
        tail[i] = static_cast<std::uint32_t>(ones ^ zeros);
      }
    }
    const uLong row = crc32_combine_gen(static_cast<z_off_t>(length_ * values.bytes));
    for (std::size_t byte = 0; byte < 4; ++byte) {
      for (std::size_t value = 0; value < 256; ++value) {
        next_row_[byte][value] =
            static_cast<std::uint32_t>(crc32_combine_op(value << (8 * byte), 0, row));
      }
    }
    uLong constant = crc32(0, nullptr, 0);
    for (int i = 0; i < rows; ++i) constant = crc32_combine_op(constant, zeros, row);
    constant_ = static_cast<std::uint32_t>(constant);
  }

  [[nodiscard]] uLong of(const VoxelIntervals& slab, int z) const {
    std::uint32_t sum = 0;
    for (int y = 0; y < slab.columns(); ++y) {
      sum = next_row_[0][sum & 0xff] ^ next_row_[1][sum >> 8 & 0xff] ^
            next_row_[2][sum >> 16 & 0xff] ^ next_row_[3][sum >> 24];
      for_each_labelled(slab, y, z, [&](const Interval& interval, std::uint32_t value) {
        const std::size_t from = length_ - static_cast<std::size_t>(interval.begin());
        const std::size_t to = length_ - static_cast<std::size_t>(interval.end());
        for (; value != 0; value &= value - 1) {
          const auto& tail = tails_[static_cast<std::size_t>(std::countr_zero(value))];
          sum ^= tail[from] ^ tail[to];
        }
      });
    }
    return sum ^ constant_;
  }

 private:
  std::size_t length_;
  std::vector<std::vector<std::uint32_t>> tails_;  // by bit: of so many ones at the end of a row
  std::array<std::array<std::uint32_t, 256>, 4> next_row_;
  std::uint32_t constant_ = 0;  // the CRC of zeros
};

std::string one_line(std::string text) {
  for (char& letter : text) {
    if (static_cast<unsigned char>(letter) < ' ') letter = ' ';
  }
  return text;
}

class NrrdWriter final : public SlabWriter {
 public:
  NrrdWriter(const std::string& path, const VoxelGrid& grid, std::uint32_t ids, BlockOutput output)
      : SlabWriter(path, grid, Axis::kX),
        values_(ids),
        output_(std::move(output)),
        layer_crc_(grid.dims.x, grid.dims.y, values_) {}

  Result<void> begin(const std::string& name) {
    const VoxelGrid& g = grid();
    const glm::dvec3 centre = g.origin + 0.5 * g.voxel_size;
    std::string header = fmt::format(
        "NRRD0004\n# Complete NRRD file format specification at:\n"
        "# http://teem.sourceforge.net/nrrd/format.html\n"
        "content: {}\ntype: uint{}\n{}dimension: 3\nspace dimension: 3\nsizes: {} {} {}\n"
        "space directions: ({},0,0) (0,{},0) (0,0,{})\nspace origin: ({},{},{})\n"
        "centers: cell cell cell\nkinds: domain domain domain\nencoding: gzip\n\n",
        one_line(name), 8 * values_.bytes, values_.bytes == 1 ? "" : "endian: little\n", g.dims.x,
        g.dims.y, g.dims.z, g.voxel_size.x, g.voxel_size.y, g.voxel_size.z, centre.x, centre.y,
        centre.z);
    // Magic, deflate, no flags, no time stamp, fastest, Unix (RFC 1952).
    header.append("\x1f\x8b\x08\x00\x00\x00\x00\x00\x04\x03", 10);
    return output_.append(header);
  }

 private:
  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    std::vector<uLong> crcs(static_cast<std::size_t>(slab.v_end() - slab.v_begin()));
    Result<void> written =
        output_.append_blocks(execution, crcs.size(), [&](std::size_t index, Bytes& out, int) {
          const int z = slab.v_begin() + static_cast<int>(index);
          out.clear();
          RunDeflater deflater(values_.kind, values_.bytes);
          deflater.begin(out, false);
          emit_layer(slab, z, [&](std::uint32_t value, int length) {
            deflater.run(value, static_cast<std::uint64_t>(length));
          });
          deflater.end();
          crcs[index] = layer_crc_.of(slab, z);
        });
    const auto layer = static_cast<z_off_t>(values_.bytes) * dims().x * dims().y;
    for (const uLong crc : crcs) crc_ = crc32_combine(crc_, crc, layer);
    return written;
  }

  Result<void> finish_output(const Execution&) override {
    std::string end("\x03\x00", 2);  // an empty block of fixed codes, marked as the last
    const std::uint64_t bytes = static_cast<std::uint64_t>(dims().x) *
                                static_cast<std::uint64_t>(dims().y) *
                                static_cast<std::uint64_t>(dims().z) * values_.bytes;
    for (const std::uint64_t value : {static_cast<std::uint64_t>(crc_), bytes}) {
      for (int i = 0; i < 4; ++i) end += static_cast<char>(value >> (8 * i) & 0xff);
    }
    if (Result<void> written = output_.append(end); !written) return written;
    return output_.commit();
  }

  DenseValues values_;
  BlockOutput output_;
  LayerCrc layer_crc_;
  uLong crc_ = 0;
};

}  // namespace

VoxelWriterResult open_nrrd_writer(const std::string& path, const VoxelGrid& grid,
                                   const VoxelWriterOptions& options) {
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  auto writer = std::make_unique<NrrdWriter>(path, grid, options.ids, std::move(*output));
  if (Result<void> begun = writer->begin(options.name); !begun) {
    return tl::unexpected(begun.error());
  }
  return writer;
}

}  // namespace strata
