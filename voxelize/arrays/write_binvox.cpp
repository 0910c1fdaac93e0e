// binvox (Min, patrickmin.com/binvox/binvox.html): run lengths of bytes, y fastest, then z, then x.
// The grid is a cube, as binvox itself writes it: many readers refuse or misread other shapes. So
// empty voxels are added beyond the greatest x, y and z. A world position is
// translate + scale * (index + 0.5) / side, so voxels must be cubes.
//
// Slabs come by z, the file wants x slowest: the run lengths wait in memory until all are there.

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "voxelize/output/block_output.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

class RunLengths {
 public:
  explicit RunLengths(Bytes& out) : out_(out) {}
  void run(std::uint8_t value, int length) {
    if (value == value_) {
      length_ += length;
      return;
    }
    flush();
    value_ = value;
    length_ = length;
  }
  void flush() {
    for (; length_ > 0; length_ -= std::min(length_, kLongest)) {
      out_.push_back(std::byte{value_});
      out_.push_back(static_cast<std::byte>(std::min(length_, kLongest)));
    }
  }

 private:
  static constexpr int kLongest = 255;
  Bytes& out_;
  std::uint8_t value_ = 0;
  int length_ = 0;  // at most a tile's rows of the largest grid: 2^22
};

class BinvoxWriter final : public SlabWriter {
 public:
  BinvoxWriter(const std::string& path, const VoxelGrid& grid, BlockOutput output)
      : SlabWriter(path, grid, Axis::kY),
        output_(std::move(output)),
        side_(std::max({grid.dims.x, grid.dims.y, grid.dims.z})) {}

 private:
  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    // A piece is 64 rows at most, whatever the slab, so that the bytes do not depend on slabs.
    const std::size_t first = pieces_.size();
    pieces_.resize(first + static_cast<std::size_t>(slab.tiles_v()));
    for (std::size_t i = first; i < pieces_.size(); ++i) {
      pieces_[i].resize(static_cast<std::size_t>(dims().x));
    }
    scratch_.resize(std::max(scratch_.size(), static_cast<std::size_t>(execution.thread_count())));
    const auto columns = static_cast<std::size_t>(slab.columns());
    const std::size_t count = columns * static_cast<std::size_t>(slab.tiles_v());
    parallel_for(execution, count, [&](std::size_t index, int worker) {
      const int x = static_cast<int>(index % columns);
      const std::size_t tile = index / columns;
      const int begin = slab.v_begin() + static_cast<int>(tile) * VoxelIntervals::kTileSide;
      const int end = std::min(begin + VoxelIntervals::kTileSide, slab.v_end());
      Bytes& bytes = scratch_[static_cast<std::size_t>(worker)];
      bytes.clear();
      RunLengths runs(bytes);
      for (int z = begin; z < end; ++z) {
        int done = 0;
        for (const Interval& interval : slab.column(x, z)) {
          runs.run(0, interval.begin() - done);
          runs.run(1, interval.length());
          done = interval.end();
        }
        runs.run(0, side_ - done);
      }
      runs.flush();
      pieces_[first + tile][static_cast<std::size_t>(x)] = Bytes(bytes.begin(), bytes.end());
    });
    return {};
  }

  Result<void> finish_output(const Execution& execution) override {
    const VoxelGrid& g = grid();
    Result<void> written = output_.append(
        fmt::format("#binvox 1\ndim {0} {0} {0}\ntranslate {1} {2} {3}\nscale {4}\ndata\n", side_,
                    g.origin.x, g.origin.y, g.origin.z, side_ * g.voxel_size.x));
    if (!written) return written;
    const auto layers = static_cast<std::size_t>(g.dims.x);
    written = output_.append_blocks(execution, static_cast<std::size_t>(side_),
                                    [&](std::size_t x, Bytes& out, int) {
                                      out.clear();
                                      if (x >= layers) return put_empty_rows(out, side_);
                                      for (const std::vector<Bytes>& row : pieces_) {
                                        out.insert(out.end(), row[x].begin(), row[x].end());
                                      }
                                      put_empty_rows(out, side_ - dims().z);
                                    });
    if (!written) return written;
    return output_.commit();
  }

  void put_empty_rows(Bytes& out, int rows) const {
    RunLengths runs(out);
    for (int z = 0; z < rows; z += VoxelIntervals::kTileSide) {  // not more than a run counts
      runs.run(0, side_ * std::min(rows - z, VoxelIntervals::kTileSide));
      runs.flush();
    }
  }

  BlockOutput output_;
  int side_;                                // of the cube, in voxels
  std::vector<std::vector<Bytes>> pieces_;  // by 64 rows of z, then by x
  std::vector<Bytes> scratch_;              // by worker
};

}  // namespace

VoxelWriterResult open_binvox_writer(const std::string& path, const VoxelGrid& grid) {
  const glm::dvec3 size = grid.voxel_size;
  if (size.x != size.y || size.y != size.z) {
    return fail(ErrorCode::kUsage, "{}: .binvox needs cubic voxels, these are {} x {} x {}", path,
                size.x, size.y, size.z);
  }
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  return std::make_unique<BinvoxWriter>(path, grid, std::move(*output));
}

}  // namespace strata
