#include "voxelize/formats/labelled_distances.h"

#include <algorithm>
#include <bit>
#include <new>
#include <utility>
#include <vector>

namespace strata {
namespace {

constexpr int kTile = VoxelIntervals::kTileSide;
constexpr int kBlock = ScalarField::kBlockSide;

/// The runs of a tile of columns along x.
struct TileRuns {
  std::vector<std::uint32_t> offsets, labels;
  std::vector<Interval> items;

  /// The voxels of row (y, z) of a field.
  void add_row(const ScalarField& layers, int y, int z) {
    const int width = layers.dims().x;
    const std::size_t first = items.size();
    const auto add = [&](int begin, int end, float value) {
      const auto bits = std::bit_cast<std::uint32_t>(value);
      if (items.size() > first && labels.back() == bits) {
        items.back().last = static_cast<std::uint16_t>(end - 1);
        return;
      }
      items.push_back({static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(end - 1)});
      labels.push_back(bits);
    };
    for (int x = 0; x < width; x += kBlock) {
      const int end = std::min(x + kBlock, width);
      const ScalarField::Block block = layers.block(x / kBlock, y / kBlock, z / kBlock);
      if (block.values == nullptr) {
        add(x, end, block.constant);
        continue;
      }
      for (int i = x; i < end; ++i) {
        add(i, i + 1, block.values[ScalarField::offset(i - x, y % kBlock, z % kBlock)]);
      }
    }
  }
};

class LabelledDistances final : public VoxelWriter {
 public:
  LabelledDistances(std::unique_ptr<VoxelWriter> writer, const VoxelGrid& grid)
      : writer_(std::move(writer)), grid_(grid) {}

  Result<void> add(const VoxelIntervals&, const Execution&) override {
    return fail(ErrorCode::kInternal, "voxels came where distances were expected");
  }
  Result<void> add_distances(const ScalarField& layers, int z_begin,
                             const Execution& execution) override {
    const int z_end = z_begin + layers.dims().z;
    if (z_begin % kTile != 0 ||
        layers.dims() != glm::ivec3(grid_.dims.x, grid_.dims.y, z_end - z_begin)) {
      return fail(ErrorCode::kInternal, "distances of layers {} to {} do not fit", z_begin, z_end);
    }
    try {
      VoxelIntervals slab(grid_, Axis::kX, z_begin, z_end);
      const auto tiles_u = static_cast<std::size_t>(slab.tiles_u());
      parallel_for(execution, tiles_u * static_cast<std::size_t>(slab.tiles_v()),
                   [&](std::size_t index, int) {
                     fill_tile(layers, static_cast<int>(index % tiles_u),
                               static_cast<int>(index / tiles_u), slab);
                   });
      if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "cancelled");
      return writer_->add(slab, execution);
    } catch (const std::bad_alloc&) {
      return fail(ErrorCode::kLimit, "out of memory for the distances of {} layers",
                  layers.dims().z);
    }
  }
  Result<void> finish(const Execution& execution) override { return writer_->finish(execution); }

 private:
  static void fill_tile(const ScalarField& layers, int tu, int tv, VoxelIntervals& slab) {
    TileRuns runs;
    runs.offsets.push_back(0);
    for (int v = 0; v < kTile; ++v) {
      for (int u = 0; u < kTile; ++u) {
        const int y = tu * kTile + u, z = tv * kTile + v;
        if (y < layers.dims().y && z < layers.dims().z) runs.add_row(layers, y, z);
        runs.offsets.push_back(static_cast<std::uint32_t>(runs.items.size()));
      }
    }
    slab.set_tile(tu, tv, runs.offsets, runs.items, runs.labels);
  }

  std::unique_ptr<VoxelWriter> writer_;
  VoxelGrid grid_;
};

}  // namespace

std::unique_ptr<VoxelWriter> by_labels(std::unique_ptr<VoxelWriter> writer, const VoxelGrid& grid) {
  return std::make_unique<LabelledDistances>(std::move(writer), grid);
}

}  // namespace strata
