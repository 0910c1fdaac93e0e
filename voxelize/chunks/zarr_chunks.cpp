#include "voxelize/chunks/zarr_chunks.h"

#include <algorithm>
#include <utility>

namespace strata {
namespace {

constexpr std::uint32_t kVoxels =
    std::uint32_t{ZarrChunks::kSide} * ZarrChunks::kSide * ZarrChunks::kSide;

}  // namespace

ZarrChunks::ZarrChunks(const DenseValues& values, Order order, Name name)
    : values_(values),
      order_(order),
      name_(std::move(name)),
      planes_(order == Order::kZyx ? values.components : 1) {
  RunDeflater deflater(RunBytes::kFlags);
  append_zlib_stream(deflater, full_chunk_, [](RunDeflater& to) { to.run(1, kVoxels); });
}

Result<void> ZarrChunks::write(const VoxelIntervals& slab, const FolderOutput& folder,
                               const Execution& execution) {
  scratch_.resize(std::max(scratch_.size(), static_cast<std::size_t>(execution.thread_count())));
  const auto count =
      static_cast<std::size_t>(slab.tiles_u()) * static_cast<std::size_t>(slab.tiles_v());
  return FolderOutput::for_each(execution, count, [&](std::size_t index, int worker) {
    std::unique_ptr<Scratch>& scratch = scratch_[static_cast<std::size_t>(worker)];
    if (!scratch) scratch = std::make_unique<Scratch>();
    const int tu = static_cast<int>(index) % slab.tiles_u();
    const int tv = static_cast<int>(index) / slab.tiles_u();
    return write_column(slab, tu, tv, folder, *scratch);
  });
}

// The chunks along the columns of a tile.
Result<void> ZarrChunks::write_column(const VoxelIntervals& slab, int tu, int tv,
                                      const FolderOutput& folder, Scratch& scratch) const {
  const VoxelIntervals::TileView tile = slab.tile(tu, tv);
  if (tile.items.empty()) return {};
  const AxisFrame frame(slab.axis());
  const int chunks = (slab.grid().dims[frame.w] + kSide - 1) / kSide;
  scratch.voxels.assign(static_cast<std::size_t>(chunks), 0);
  for (const Interval& interval : tile.items) {
    for (int w = interval.begin(); w < interval.end();) {
      const int end = std::min(interval.end(), (w / kSide + 1) * kSide);
      scratch.voxels[static_cast<std::size_t>(w / kSide)] += static_cast<std::uint32_t>(end - w);
      w = end;
    }
  }
  for (std::size_t plane = 0; plane < planes_; ++plane) {
    std::copy_n(tile.offsets.begin(), scratch.next.size(), scratch.next.begin());
    for (int chunk = 0; chunk < chunks; ++chunk) {
      const std::uint32_t voxels = scratch.voxels[static_cast<std::size_t>(chunk)];
      if (voxels == 0) continue;
      const Bytes* bytes = &full_chunk_;
      if (voxels != kVoxels || values_.kind != DenseValues::Kind::kFlags) {
        make_chunk(tile, chunk, plane, scratch);
        bytes = &scratch.bytes;
      }
      glm::ivec3 at(0);
      at[frame.u] = tu, at[frame.v] = slab.v_begin() / kSide + tv, at[frame.w] = chunk;
      auto written = folder.write(name_(at, plane), bytes->data(), bytes->size());
      if (!written) return written;
    }
  }
  return {};
}

void ZarrChunks::make_chunk(const VoxelIntervals::TileView& tile, int chunk, std::size_t plane,
                            Scratch& scratch) const {
  const int begin = chunk * kSide, end = begin + kSide;
  scratch.bytes.clear();
  const bool planar = planes_ > 1;
  RunDeflater deflater(values_.codes, planar ? 1 : values_.bytes);
  append_zlib_stream(deflater, scratch.bytes, [&](RunDeflater& to) {
    const auto run = [&](std::uint32_t value, int length) {
      if (planar) value = value >> 8 * plane & 0xff;
      if (length > 0) to.run(value, static_cast<std::uint64_t>(length));
    };
    for (std::size_t slow = 0; slow < kSide; ++slow) {
      for (std::size_t fast = 0; fast < kSide; ++fast) {
        // Columns of a tile are u fastest: along x by z, but y by x; along y by z.
        const std::size_t column =
            order_ == Order::kXyz ? fast * kSide + slow : slow * kSide + fast;
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

}  // namespace strata
