#include "strata/voxelize/intervals.h"

#include <gtest/gtest.h>

#include "tests/voxelize/voxel_samples.h"

namespace strata::testing {
namespace {

constexpr Axis kAxes[] = {Axis::kX, Axis::kY, Axis::kZ};

/// Position in a dense array: x fastest.
std::size_t place(const VoxelGrid& grid, int i, int j, int k) {
  return static_cast<std::size_t>(i) +
         static_cast<std::size_t>(grid.dims.x) *
             (static_cast<std::size_t>(j) +
              static_cast<std::size_t>(grid.dims.y) * static_cast<std::size_t>(k));
}

TEST(VoxelIntervals, ContainsWhatThePredicateSays) {
  for (const Sample& sample : small_samples()) {
    SCOPED_TRACE(sample.name);
    const glm::ivec3 dims = sample.grid.dims;
    for (const Axis axis : kAxes) {
      const VoxelIntervals set = intervals_of(sample, axis);
      int wrong = 0;
      for (int i = -1; i <= dims.x; ++i) {
        for (int j = -1; j <= dims.y; ++j) {
          for (int k = -1; k <= dims.z; ++k) {
            const bool inside =
                i >= 0 && j >= 0 && k >= 0 && i < dims.x && j < dims.y && k < dims.z;
            wrong += set.contains(i, j, k) != (inside && sample.solid(i, j, k)) ? 1 : 0;
          }
        }
      }
      EXPECT_EQ(wrong, 0);
    }
  }
}

TEST(VoxelIntervals, ASlabContainsItsRowsOnly) {
  const VoxelGrid grid = make_grid({5, 200, 5});
  const VoxelIntervals whole =
      intervals_from_predicate(grid, Axis::kZ, [](int, int, int) { return true; });
  const VoxelIntervals slab = std::move(cut(whole, 1).at(1));
  for (int j = 0; j < 200; ++j) EXPECT_EQ(slab.contains(2, j, 2), j >= 64 && j < 128) << j;
}

TEST(VoxelIntervals, RunsAndDenseArraysHoldTheSet) {
  for (const Sample& sample : small_samples()) {
    SCOPED_TRACE(sample.name);
    const glm::ivec3 dims = sample.grid.dims;
    std::vector<std::uint8_t> expected(place(sample.grid, 0, 0, dims.z));
    for (int i = 0; i < dims.x; ++i) {
      for (int j = 0; j < dims.y; ++j) {
        for (int k = 0; k < dims.z; ++k) {
          expected[place(sample.grid, i, j, k)] = sample.solid(i, j, k) ? 1 : 0;
        }
      }
    }
    for (const Axis axis : kAxes) {
      const VoxelIntervals set = intervals_of(sample, axis);
      const auto dense = to_dense(set);
      ASSERT_TRUE(dense) << dense.error().message;
      EXPECT_TRUE(*dense == expected);
      std::vector<std::uint8_t> by_runs(expected.size());
      std::uint64_t runs = 0;
      for_each_run(set, [&](const glm::ivec3& first, const glm::ivec3& last, std::uint32_t label) {
        EXPECT_EQ(label, 1u);
        ++runs;
        for (int i = first.x; i <= last.x; ++i) {
          for (int j = first.y; j <= last.y; ++j) {
            for (int k = first.z; k <= last.z; ++k) ++by_runs[place(sample.grid, i, j, k)];
          }
        }
      });
      EXPECT_TRUE(by_runs == expected);
      EXPECT_EQ(runs, set.interval_count());
    }
  }
}

TEST(VoxelIntervals, DenseLabelsAreTheLabels) {
  const VoxelGrid grid = make_grid({30, 70, 40});
  const IdOf id = some_ids(3'000'000'000);
  for (const Axis axis : kAxes) {
    const VoxelIntervals set = labelled(grid, axis, id);
    EXPECT_TRUE(set.has_labels());
    const auto dense = to_dense_labels(set);
    ASSERT_TRUE(dense);
    int wrong = 0;
    for (int i = 0; i < 30; ++i) {
      for (int j = 0; j < 70; ++j) {
        for (int k = 0; k < 40; ++k) {
          wrong += (*dense)[place(grid, i, j, k)] != id(i, j, k) ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(wrong, 0);
  }
}

TEST(VoxelIntervals, ATileHoldsTheOffsetsThatItIsGiven) {
  constexpr std::size_t kColumns = VoxelIntervals::kTileColumns;
  const VoxelGrid grid = make_grid({64, 64, 9});
  std::vector<Interval> items(kColumns);
  for (std::size_t i = 0; i < kColumns; ++i) items[i].last = static_cast<std::uint16_t>(i % 9);
  std::vector<std::uint32_t> one_each(kColumns + 1);
  for (std::size_t i = 0; i <= kColumns; ++i) one_each[i] = static_cast<std::uint32_t>(i);
  // As many intervals, but none in one column and two in another.
  std::vector<std::uint32_t> others = one_each;
  for (std::size_t i = 7; i < kColumns; ++i) ++others[i];
  std::uint64_t bytes[2];
  for (const auto* offsets : {&one_each, &others}) {
    VoxelIntervals set(grid, Axis::kZ);
    set.set_tile(0, 0, *offsets, items);
    const VoxelIntervals::TileView tile = set.tile(0, 0);
    EXPECT_TRUE(
        std::equal(tile.offsets.begin(), tile.offsets.end(), offsets->begin(), offsets->end()));
    for (std::size_t i = 0; i < kColumns; ++i) {
      const auto column = set.column(static_cast<int>(i % 64), static_cast<int>(i / 64));
      ASSERT_EQ(column.size(), (*offsets)[i + 1] - (*offsets)[i]) << i;
      if (column.empty()) continue;
      ASSERT_EQ(column.data(), tile.items.data() + (*offsets)[i]) << i;
    }
    EXPECT_EQ(set.interval_count(), kColumns);
    bytes[offsets == &others] = set.memory_bytes();
  }
  EXPECT_EQ(bytes[1] - bytes[0], (kColumns + 1) * sizeof(std::uint32_t));  // shared by such tiles
}

TEST(VoxelIntervals, ADenseArrayKeepsTheMemoryLimit) {
  const VoxelIntervals set(make_grid({100, 100, 100}), Axis::kY);
  EXPECT_TRUE(to_dense(set, {.memory_limit = 1'000'000}));
  EXPECT_FALSE(to_dense_labels(set, {.memory_limit = 3'999'999}));
  const auto refused = to_dense(set, {.memory_limit = 999'999});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
  EXPECT_EQ(to_dense(VoxelIntervals(make_grid(glm::ivec3(kMaxGridSide)), Axis::kZ)).error().code,
            ErrorCode::kLimit);
}

}  // namespace
}  // namespace strata::testing
