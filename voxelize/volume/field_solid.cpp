// The solid voxels of a field, block by block: a constant block extends runs or ends them, and only
// the others are looked at voxel by voxel.

#include <algorithm>
#include <array>
#include <vector>

#include "strata/voxelize/volume/voxel_volume.h"
#include "voxelize/volume/tile_runs.h"

namespace strata {
namespace {

constexpr int kSide = ScalarField::kBlockSide;

/// Labels of values; 0 is empty.
struct Labeller {
  SolidRule rule;
  float threshold;
  [[nodiscard]] std::uint32_t operator()(float value) const {
    switch (rule) {
      case SolidRule::kAbove:
        return value > threshold ? 1 : 0;
      case SolidRule::kBelow:
        return value < threshold ? 1 : 0;
      case SolidRule::kIds:
        break;
    }
    return value >= 1.0f && value < 4294967296.0f ? static_cast<std::uint32_t>(value) : 0;
  }
};

/// The 8 x 8 columns of one column of blocks.
class BlockColumn {
 public:
  BlockColumn(const ScalarField& field, const Labeller& label, int bi, int bj, TileRuns& runs)
      : field_(field), label_(label), bi_(bi), bj_(bj), runs_(runs) {}

  void walk(int tile_u, int tile_v) {
    begin_u_ = tile_u * kTileSide;
    begin_v_ = tile_v * kTileSide;
    const glm::ivec3 blocks = field_.blocks();
    for (int bk = 0; bk < blocks.z;) {
      const ScalarField::Block block = field_.block(bi_, bj_, bk);
      if (block.values == nullptr) {
        const int count = field_.equal_blocks_along_z(bi_, bj_, bk);
        const std::uint32_t label = label_(block.constant);
        for (std::size_t c = 0; c < open_.size(); ++c) change(c, bk * kSide, label);
        bk += count;
        continue;
      }
      for (std::size_t c = 0; c < open_.size(); ++c) {
        const float* values = block.values + c * kSide;
        for (int z = 0; z < kSide; ++z) change(c, bk * kSide + z, label_(values[z]));
      }
      ++bk;
    }
    const int past = field_.dims().z + field_.shift().z;
    for (std::size_t c = 0; c < open_.size(); ++c) change(c, past, 0);
  }

 private:
  struct Open {
    int first = 0;
    std::uint32_t label = 0;
  };
  // From place z on, in blocks' voxels, the label of column c is `label`.
  void change(std::size_t c, int z, std::uint32_t label) {
    Open& open = open_[c];
    if (open.label == label) return;
    if (open.label != 0) emit(c, open, z);
    open = {z, label};
  }
  void emit(std::size_t c, const Open& open, int past) {
    const glm::ivec3 shift = field_.shift(), dims = field_.dims();
    const int u = bi_ * kSide + static_cast<int>(c) / kSide - shift.x;
    const int v = bj_ * kSide + static_cast<int>(c) % kSide - shift.y;
    if (u < std::max(begin_u_, 0) || u >= std::min(begin_u_ + kTileSide, dims.x)) return;
    if (v < std::max(begin_v_, 0) || v >= std::min(begin_v_ + kTileSide, dims.y)) return;
    const int first = std::max(open.first - shift.z, 0), end = std::min(past - shift.z, dims.z);
    if (first >= end) return;
    runs_.add(static_cast<unsigned>((v - begin_v_) * kTileSide + u - begin_u_), first, end - 1,
              open.label);
  }

  const ScalarField& field_;
  const Labeller& label_;
  int bi_, bj_, begin_u_ = 0, begin_v_ = 0;
  TileRuns& runs_;
  std::array<Open, 64> open_{};
};

}  // namespace

VoxelIntervals solid_voxels(const ScalarField& field, const VoxelGrid& grid, SolidRule rule,
                            float threshold, const Execution& execution) {
  VoxelIntervals set(grid, Axis::kZ);
  const Labeller label{rule, threshold};
  std::vector<TileRuns> runs(static_cast<std::size_t>(execution.thread_count()));
  const auto tiles =
      static_cast<std::size_t>(set.tiles_u()) * static_cast<std::size_t>(set.tiles_v());
  parallel_for(execution, tiles, [&](std::size_t index, int worker) {
    const int tu = static_cast<int>(index) % set.tiles_u();
    const int tv = static_cast<int>(index) / set.tiles_u();
    TileRuns& mine = runs[static_cast<std::size_t>(worker)];
    const glm::ivec3 shift = field.shift(), blocks = field.blocks();
    const auto last = [&](int tile, int add) { return ((tile + 1) * kTileSide + add - 1) / kSide; };
    for (int bj = (tv * kTileSide + shift.y) / kSide;
         bj <= std::min(last(tv, shift.y), blocks.y - 1); ++bj) {
      for (int bi = (tu * kTileSide + shift.x) / kSide;
           bi <= std::min(last(tu, shift.x), blocks.x - 1); ++bi) {
        BlockColumn(field, label, bi, bj, mine).walk(tu, tv);
      }
    }
    mine.store(set, tu, tv, rule == SolidRule::kIds);
  });
  return set;
}

}  // namespace strata
