#include "voxelize/output/dense_stream.h"

#include <zlib.h>

#include <string>
#include <vector>

#include "voxelize/output/dense_rows.h"

namespace strata {

DenseStream::DenseStream(const VoxelGrid& grid, const DenseValues& values, Packing packing)
    : values_(values),
      packing_(packing),
      layers_(static_cast<std::uint64_t>(grid.dims.z)),
      layer_bytes_(static_cast<std::uint64_t>(grid.dims.x) *
                   static_cast<std::uint64_t>(grid.dims.y) * values.bytes) {
  if (packing == Packing::kGzip) deflated_.emplace(grid, values);
}

Result<void> DenseStream::begin(BlockOutput& output, std::string_view head) {
  head_bytes_ = head.size();
  if (packing_ == Packing::kNone) return output.append(head);
  const bool gzip = packing_ == Packing::kGzip;
  const std::string_view begin = gzip ? DeflatedLayers::kGzipHead : "\x78\x01";
  const auto* bytes = reinterpret_cast<const Bytef*>(head.data());
  checksum_ = static_cast<std::uint32_t>(gzip ? crc32_z(crc32_z(0, nullptr, 0), bytes, head.size())
                                              : adler32_z(1, bytes, head.size()));
  if (head.empty()) return output.append(begin);
  Bytes packed;
  RunDeflater deflater(RunBytes::kIds);
  deflater.begin(packed, false);
  for (const char letter : head) deflater.byte(static_cast<std::uint8_t>(letter));
  deflater.end();
  if (auto written = output.append(begin); !written) return written;
  return output.append(packed.data(), packed.size());
}

Result<void> DenseStream::append(const VoxelIntervals& slab, BlockOutput& output,
                                 const Execution& execution) {
  if (packing_ == Packing::kGzip) return deflated_->append(slab, output, checksum_, execution);
  if (packing_ == Packing::kZlib) return append_zlib(slab, output, execution);
  const RowBlocks blocks(slab, values_);
  return output.append_blocks(execution, blocks.count(),
                              [&](std::size_t index, Bytes& out, int) { blocks.make(index, out); });
}

Result<void> DenseStream::append_zlib(const VoxelIntervals& slab, BlockOutput& output,
                                      const Execution& execution) {
  std::vector<std::uint32_t> sums(static_cast<std::size_t>(slab.v_end() - slab.v_begin()));
  auto written =
      output.append_blocks(execution, sums.size(), [&](std::size_t index, Bytes& out, int) {
        out.clear();
        RunDeflater deflater(values_.codes, values_.bytes);
        deflater.begin(out, false);
        emit_layer(slab, values_, slab.v_begin() + static_cast<int>(index),
                   [&](std::uint32_t value, int length) {
                     deflater.run(value, static_cast<std::uint64_t>(length));
                   });
        deflater.end();
        sums[index] = deflater.adler();
      });
  for (const std::uint32_t sum : sums) {
    checksum_ = static_cast<std::uint32_t>(
        adler32_combine(checksum_, sum, static_cast<z_off_t>(layer_bytes_)));
  }
  return written;
}

Result<void> DenseStream::end(BlockOutput& output) const {
  if (packing_ == Packing::kNone) return {};
  if (packing_ == Packing::kGzip) {
    return output.append(DeflatedLayers::gzip_end(checksum_, head_bytes_ + dense_bytes()));
  }
  std::string end(DeflatedLayers::kEnd);
  for (const int shift : {24, 16, 8, 0}) end += static_cast<char>(checksum_ >> shift & 0xff);
  return output.append(end);
}

}  // namespace strata
