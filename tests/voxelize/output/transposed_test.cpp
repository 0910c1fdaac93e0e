#include "voxelize/output/transposed.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/voxelize/voxel_samples.h"

namespace strata::testing {
namespace {

TEST(Transposed, HoldsTheSameIntervalsAsThoseMadeAlongTheAxis) {
  for (const Sample& sample : small_samples()) {
    for (const Axis from : {Axis::kX, Axis::kY, Axis::kZ}) {
      for (const Axis to : {Axis::kX, Axis::kY, Axis::kZ}) {
        const VoxelIntervals expected = intervals_of(sample, to);
        const VoxelIntervals turned = transposed(intervals_of(sample, from), to);
        ASSERT_EQ(turned.axis(), to);
        int wrong = 0;
        for (int v = 0; v < expected.v_end(); ++v) {
          for (int u = 0; u < expected.columns(); ++u) {
            wrong += std::ranges::equal(expected.column(u, v), turned.column(u, v)) ? 0 : 1;
          }
        }
        EXPECT_EQ(wrong, 0) << sample.name;
      }
    }
  }
}

// By voxels this would take hours, by the faces of the surface it takes less than a second.
TEST(Transposed, WorkGrowsWithTheSurface) {
  const VoxelGrid grid = make_grid(glm::ivec3(4096));
  VoxelIntervals set(grid, Axis::kZ);
  std::vector<std::uint32_t> offsets(VoxelIntervals::kTileColumns + 1);
  for (std::uint32_t i = 0; i < offsets.size(); ++i) offsets[i] = i;
  const std::vector<Interval> items(VoxelIntervals::kTileColumns, Interval{1, 4095});
  for (int tv = 0; tv < set.tiles_v(); ++tv) {
    for (int tu = 0; tu < set.tiles_u(); ++tu) set.set_tile(tu, tv, offsets, items);
  }
  const VoxelIntervals turned = transposed(set, Axis::kX);
  EXPECT_EQ(turned.solid_voxels(), set.solid_voxels());
  EXPECT_EQ(turned.interval_count(), std::uint64_t{4096} * 4095);
}

}  // namespace
}  // namespace strata::testing
