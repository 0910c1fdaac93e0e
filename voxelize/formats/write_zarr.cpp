// A Zarr version 2 array (zarr.readthedocs.io/en/stable/spec/v2.html): shape (nx, ny, nz), of
// colours (nx, ny, nz, 4), C order, chunks of 64^3 that zlib reads, a file each and none for an
// empty chunk. Chunks at the border are whole, as the format wants it; what lies outside is 0. The
// world transform stands in the attributes.

#include <fmt/core.h>

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "voxelize/output/dense_rows.h"
#include "voxelize/output/folder_output.h"
#include "voxelize/output/run_deflate.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

constexpr int kChunkSide = VoxelIntervals::kTileSide;
constexpr std::uint32_t kChunkVoxels = std::uint32_t{kChunkSide} * kChunkSide * kChunkSide;

class ZarrWriter final : public SlabWriter {
 public:
  ZarrWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
             FolderOutput folder)
      : SlabWriter(path, grid, Axis::kZ), values_(options), folder_(std::move(folder)) {
    RunDeflater deflater(RunBytes::kFlags);
    append_zlib_stream(deflater, full_chunk_, [](RunDeflater& to) { to.run(1, kChunkVoxels); });
  }

 private:
  struct Scratch {
    std::vector<std::uint32_t> voxels;                               // by chunk along z
    std::array<std::uint32_t, VoxelIntervals::kTileColumns> next{};  // interval of a column
    Bytes bytes;
  };

  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    scratch_.resize(std::max(scratch_.size(), static_cast<std::size_t>(execution.thread_count())));
    const auto count =
        static_cast<std::size_t>(slab.tiles_u()) * static_cast<std::size_t>(slab.tiles_v());
    return FolderOutput::for_each(execution, count, [&](std::size_t index, int worker) {
      std::unique_ptr<Scratch>& scratch = scratch_[static_cast<std::size_t>(worker)];
      if (!scratch) scratch = std::make_unique<Scratch>();
      const int tu = static_cast<int>(index) % slab.tiles_u();
      const int tv = static_cast<int>(index) / slab.tiles_u();
      return write_chunks(slab.tile(tu, tv), tu, slab.v_begin() / kChunkSide + tv, *scratch);
    });
  }

  // The chunks above a tile.
  Result<void> write_chunks(VoxelIntervals::TileView tile, int chunk_x, int chunk_y,
                            Scratch& scratch) const {
    if (tile.items.empty()) return {};
    const int chunks = (dims().z + kChunkSide - 1) / kChunkSide;
    scratch.voxels.assign(static_cast<std::size_t>(chunks), 0);
    for (const Interval& interval : tile.items) {
      for (int z = interval.begin(); z < interval.end();) {
        const int end = std::min(interval.end(), (z / kChunkSide + 1) * kChunkSide);
        scratch.voxels[static_cast<std::size_t>(z / kChunkSide)] +=
            static_cast<std::uint32_t>(end - z);
        z = end;
      }
    }
    std::copy_n(tile.offsets.begin(), scratch.next.size(), scratch.next.begin());
    for (int chunk = 0; chunk < chunks; ++chunk) {
      const std::uint32_t voxels = scratch.voxels[static_cast<std::size_t>(chunk)];
      if (voxels == 0) continue;
      const Bytes* bytes = &full_chunk_;
      if (voxels != kChunkVoxels || values_.kind != DenseValues::Kind::kFlags) {
        make_chunk(tile, chunk, scratch);
        bytes = &scratch.bytes;
      }
      Result<void> written = folder_.write(
          fmt::format("{}.{}.{}{}", chunk_x, chunk_y, chunk, values_.components == 1 ? "" : ".0"),
          bytes->data(), bytes->size());
      if (!written) return written;
    }
    return {};
  }

  void make_chunk(const VoxelIntervals::TileView& tile, int chunk, Scratch& scratch) const {
    const int begin = chunk * kChunkSide, end = begin + kChunkSide;
    scratch.bytes.clear();
    RunDeflater deflater(values_.codes, values_.bytes);
    append_zlib_stream(deflater, scratch.bytes, [&](RunDeflater& to) {
      const auto run = [&to](std::uint32_t value, int length) {
        if (length > 0) to.run(value, static_cast<std::uint64_t>(length));
      };
      for (std::size_t x = 0; x < kChunkSide; ++x) {
        for (std::size_t y = 0; y < kChunkSide; ++y) {
          const std::size_t column = y * kChunkSide + x;
          std::uint32_t& next = scratch.next[column];
          const std::uint32_t past = tile.offsets[column + 1];
          int done = begin;
          for (; next < past && tile.items[next].begin() < end; ++next) {
            const int first = std::max(tile.items[next].begin(), done);
            const int last = std::min(tile.items[next].end(), end);
            if (last > first) {
              run(0, first - done);
              run(tile.labels.empty() ? values_.unlabelled() : values_.bits_of(tile.labels[next]),
                  last - first);
              done = last;
            }
            if (tile.items[next].end() > end) break;  // goes on in the next chunk
          }
          run(0, end - done);
        }
      }
    });
  }

  Result<void> finish_output(const Execution&) override {
    const VoxelGrid& g = grid();
    const glm::dvec3 size = g.voxel_size, centre = g.origin + 0.5 * size;
    const std::string array = fmt::format(
        "{{\n  \"chunks\": [{0}, {0}, {0}{7}],\n  \"compressor\": {{\"id\": \"zlib\", \"level\": "
        "1}},\n"
        "  \"dtype\": \"{4}{6}{5}\",\n  \"fill_value\": 0,\n  \"filters\": null,\n  \"order\": "
        "\"C\",\n"
        "  \"shape\": [{1}, {2}, {3}{7}],\n  \"zarr_format\": 2\n}}\n",
        kChunkSide, g.dims.x, g.dims.y, g.dims.z, values_.number_bits() == 8 ? '|' : '<',
        values_.number_bits() / 8, values_.is_float() ? 'f' : 'u',
        values_.components == 1 ? "" : ", 4");
    const std::string attributes = fmt::format(
        "{{\n  \"axes\": [\"x\", \"y\", \"z\"{}],\n  \"origin\": [{}, {}, {}],\n"
        "  \"voxel_size\": [{}, {}, {}],\n"
        "  \"world_from_index\": [[{}, 0, 0, {}], [0, {}, 0, {}], [0, 0, {}, {}], [0, 0, 0, 1]]\n"
        "}}\n",
        values_.components == 1 ? "" : ", \"c\"", g.origin.x, g.origin.y, g.origin.z, size.x,
        size.y, size.z, size.x, centre.x, size.y, centre.y, size.z, centre.z);
    for (const auto& [name, text] : {std::pair{".zarray", &array}, {".zattrs", &attributes}}) {
      if (Result<void> written = folder_.write(name, text->data(), text->size()); !written) {
        return written;
      }
    }
    return folder_.commit();
  }

  DenseValues values_;
  FolderOutput folder_;
  Bytes full_chunk_;
  std::vector<std::unique_ptr<Scratch>> scratch_;  // by worker
};

}  // namespace

VoxelWriterResult open_zarr_writer(const std::string& path, const VoxelGrid& grid,
                                   const VoxelWriterOptions& options) {
  Result<FolderOutput> folder = FolderOutput::create(path);
  if (!folder) return tl::unexpected(folder.error());
  return std::make_unique<ZarrWriter>(path, grid, options, std::move(*folder));
}

}  // namespace strata
