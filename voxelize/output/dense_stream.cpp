#include "voxelize/output/dense_stream.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "voxelize/output/dense_rows.h"

namespace strata {
namespace {

/// The rows of a slab in blocks of about a megabyte.
class RowBlocks {
 public:
  RowBlocks(const VoxelIntervals& slab, const DenseValues& values)
      : slab_(slab),
        values_(values),
        bytes_(values.bytes),
        length_(static_cast<std::size_t>(slab.grid().dims.x)),
        rows_(static_cast<std::size_t>(slab.columns()) *
              static_cast<std::size_t>(slab.v_end() - slab.v_begin())),
        rows_a_block_(std::max<std::size_t>(1, (std::size_t{1} << 20) / (length_ * bytes_))) {}

  [[nodiscard]] std::size_t count() const { return (rows_ + rows_a_block_ - 1) / rows_a_block_; }

  void make(std::size_t index, Bytes& out) const {
    const std::size_t first = index * rows_a_block_;
    const std::size_t last = std::min(first + rows_a_block_, rows_);
    out.resize((last - first) * length_ * bytes_);
    std::memset(out.data(), 0, out.size());
    std::byte* to = out.data();
    const auto columns = static_cast<std::size_t>(slab_.columns());
    for (std::size_t row = first; row < last; ++row, to += length_ * bytes_) {
      for_each_value(
          slab_, values_, static_cast<int>(row % columns),
          slab_.v_begin() + static_cast<int>(row / columns),
          [&](const Interval& interval, std::uint32_t value) { fill(to, interval, value); });
    }
  }

 private:
  // Rows begin at multiples of a value's size.
  void fill(std::byte* row, const Interval& interval, std::uint32_t value) const {
    std::byte* to = row + static_cast<std::size_t>(interval.begin()) * bytes_;
    const auto count = static_cast<std::size_t>(interval.length());
    if (bytes_ == 1) {
      std::memset(to, static_cast<int>(value), count);
    } else if (bytes_ == 2) {
      std::fill_n(reinterpret_cast<std::uint16_t*>(to), count, static_cast<std::uint16_t>(value));
    } else {
      std::fill_n(reinterpret_cast<std::uint32_t*>(to), count, value);
    }
  }

  const VoxelIntervals& slab_;
  const DenseValues& values_;
  std::size_t bytes_, length_, rows_, rows_a_block_;
};

}  // namespace

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
