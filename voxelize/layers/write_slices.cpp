// A folder of PNG slices (PNG, second edition, ISO/IEC 15948:2004), one 1-bit grey picture a layer
// of z, of 8 or 16 bits for ids, 8 for shares, RGBA for colours. The first row is the greatest y,
// so that a picture shows the layer as seen from above (+z), upright and not mirrored. Made from
// the runs: libpng, whose deflate looks at every byte, takes 0.4 ms a layer of 1024 x 1024 at its
// fastest setting, this a tenth of it and less.

#include <zlib.h>

#include <memory>
#include <utility>

#include "core/png_chunks.h"
#include "voxelize/output/dense_rows.h"
#include "voxelize/output/folder_output.h"
#include "voxelize/output/run_deflate.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

constexpr std::uint8_t kNoFilter = 0;

// Pixels of a row are bits, the first one highest; solid is 1.
void emit_row(RunDeflater& deflater, std::span<const Interval> row, int row_bytes) {
  deflater.run(kNoFilter, 1);
  int done = 0;       // bytes given out
  unsigned bits = 0;  // of byte `done`, so far; 0 if it is not begun
  const auto advance = [&](int to) {
    if (bits != 0 && done < to) {
      deflater.run(static_cast<std::uint8_t>(bits), 1);
      ++done;
      bits = 0;
    }
    if (done < to) deflater.run(0x00, static_cast<std::uint64_t>(to - done));
    done = to;
  };
  for (const Interval& interval : row) {
    const int first = interval.begin() / 8, last = interval.end() / 8;
    advance(first);
    const unsigned head = 0xffu >> interval.begin() % 8;
    const unsigned tail = 0xff00u >> interval.end() % 8 & 0xffu;
    if (first == last) {
      bits |= head & tail;
      continue;
    }
    deflater.run(static_cast<std::uint8_t>(bits | head), 1);
    if (last > first + 1) deflater.run(0xff, static_cast<std::uint64_t>(last - first - 1));
    done = last;
    bits = tail;
  }
  advance(row_bytes);
}

// A pixel a value; 16 bits have the higher byte first.
void emit_values(RunDeflater& deflater, const VoxelIntervals& slab, const DenseValues& values,
                 int y, int z) {
  deflater.byte(kNoFilter);
  int done = 0;
  const bool wide = values.bytes == 2;
  for_each_value(slab, values, y, z, [&](const Interval& interval, std::uint32_t value) {
    deflater.run(0, static_cast<std::uint64_t>(interval.begin() - done));
    deflater.run(wide ? (value >> 8 | (value & 0xff) << 8) : value,
                 static_cast<std::uint64_t>(interval.length()));
    done = interval.end();
  });
  deflater.run(0, static_cast<std::uint64_t>(slab.grid().dims.x - done));
}

// Pictures hold no floats.
VoxelWriterOptions bytes_of_shares(VoxelWriterOptions options) {
  options.fog_floats = false;
  return options;
}

class PngWriter final : public SlabWriter {
 public:
  PngWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
            FolderOutput folder)
      : SlabWriter(path, grid, Axis::kX),
        values_(bytes_of_shares(options)),
        folder_(std::move(folder)) {}

 private:
  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    scratch_.resize(std::max(scratch_.size(), static_cast<std::size_t>(execution.thread_count())));
    const auto layers = static_cast<std::size_t>(slab.v_end() - slab.v_begin());
    return FolderOutput::for_each(execution, layers, [&](std::size_t index, int worker) {
      Bytes& out = scratch_[static_cast<std::size_t>(worker)];
      const int z = slab.v_begin() + static_cast<int>(index);
      make_picture(slab, z, out);
      return folder_.write(fmt::format("slice_{:05d}.png", z), out.data(), out.size());
    });
  }

  void make_picture(const VoxelIntervals& slab, int z, Bytes& out) const {
    PngChunks png(out, [](const void* data, std::size_t bytes) {
      return static_cast<std::uint32_t>(crc32_z(0, static_cast<const Bytef*>(data), bytes));
    });
    const bool flags = values_.kind == DenseValues::Kind::kFlags;
    constexpr unsigned kGrey = 0, kRgba = 6;
    png.header(dims().x, dims().y, flags ? 1 : static_cast<unsigned>(values_.number_bits()),
               values_.kind == DenseValues::Kind::kColours ? kRgba : kGrey);
    png.begin("IDAT");
    RunDeflater deflater(flags ? RunBytes::kBits : RunBytes::kIds, values_.bytes);
    append_zlib_stream(deflater, out, [&](RunDeflater& to) {
      const int row_bytes = (dims().x + 7) / 8;
      for (int y = dims().y - 1; y >= 0; --y) {
        if (flags) {
          emit_row(to, slab.column(y, z), row_bytes);
        } else {
          emit_values(to, slab, values_, y, z);
        }
      }
    });
    png.end();
    png.begin("IEND");
    png.end();
  }

  Result<void> finish_output(const Execution&) override {
    const VoxelGrid& g = grid();
    const std::string json = fmt::format(
        "{{\n  \"dims\": [{}, {}, {}],\n  \"origin\": [{}, {}, {}],\n"
        "  \"voxel_size\": [{}, {}, {}],\n  \"slices\": \"slice_%05d.png\",\n"
        "  \"slice_axis\": \"z\",\n  \"slice_order\": \"ascending\",\n"
        "  \"row_axis\": \"y\",\n  \"row_order\": \"descending\",\n"
        "  \"column_axis\": \"x\",\n  \"column_order\": \"ascending\",\n"
        "  {}\n}}\n",
        g.dims.x, g.dims.y, g.dims.z, g.origin.x, g.origin.y, g.origin.z, g.voxel_size.x,
        g.voxel_size.y, g.voxel_size.z,
        values_.kind == DenseValues::Kind::kFlags ? "\"solid\": 1" : "\"outside\": 0");
    if (Result<void> written = folder_.write("slices.json", json.data(), json.size()); !written) {
      return written;
    }
    return folder_.commit();
  }

  DenseValues values_;
  FolderOutput folder_;
  std::vector<Bytes> scratch_;  // by worker
};

}  // namespace

VoxelWriterResult open_png_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options) {
  Result<FolderOutput> folder = FolderOutput::create(path);
  if (!folder) return tl::unexpected(folder.error());
  return std::make_unique<PngWriter>(path, grid, options, std::move(*folder));
}

}  // namespace strata
