// The walk of vectors of columns against the walk of one column after another: the same intervals
// and counts, on every SIMD target.

#include "voxelize/tile_walk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "strata/hashbuffer/record.h"
#include "strata/raster/raster_target.h"
#include "tests/support/simd_targets.h"

namespace strata {
namespace {

using namespace testkit;  // NOLINT: the tests' own vocabulary

/// Lists of a tile in both forms.
class Lists {
 public:
  explicit Lists(std::vector<std::vector<DepthKey>> columns) {
    columns.resize(kTilePixels);
    offsets_.push_back(0);
    std::size_t longest = 1;
    for (auto& column : columns) {
      std::sort(column.begin(), column.end());
      keys_.insert(keys_.end(), column.begin(), column.end());
      offsets_.push_back(static_cast<std::uint32_t>(keys_.size()));
      const auto exits = static_cast<std::size_t>(
          std::count_if(column.begin(), column.end(), [](DepthKey key) { return (key & 1) != 0; }));
      longest = std::max({longest, exits, column.size() - exits});
    }
    planes_.assign(longest * 2 * kTilePixels, 0);
    for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
      std::uint32_t ages[2] = {0, 0};  // of entering and of leaving
      for (const DepthKey key : columns[pixel]) {
        const std::uint32_t side = key & 1, age = ++ages[side];
        planes_[((age - 1) * 2 + side) * kTilePixels + pixel] = age << 24 | (0xffffffu - key);
      }
    }
    ages_ = static_cast<int>(longest);
  }
  [[nodiscard]] TileLists<DepthKey> rows() const {
    TileLists<DepthKey> lists = both();
    lists.offsets = offsets_.data();
    lists.keys = keys_.data();
    return lists;
  }
  [[nodiscard]] TileLists<DepthKey> planes() const {
    TileLists<DepthKey> lists = both();
    lists.planes32 = planes_.data();
    lists.ages = ages_;
    return lists;
  }

 private:
  [[nodiscard]] TileLists<DepthKey> both() const {
    TileLists<DepthKey> lists;
    lists.row_end = kTileSide;
    lists.fragments = keys_.size();
    return lists;
  }
  std::vector<DepthKey> keys_;
  std::vector<std::uint32_t> offsets_, planes_;
  int ages_ = 0;
};

void expect_same(const Lists& lists) {
  for (const InsideRule rule : {InsideRule::kWinding, InsideRule::kNonzero, InsideRule::kParity}) {
    for (const bool histogram : {false, true}) {
      TileIntervals expected;
      walk_tile(lists.rows(), rule, histogram, expected);
      for_each_simd_target([&](const std::string& name) {
        SCOPED_TRACE(name);
        TileIntervals found;
        walk_tile(lists.planes(), rule, histogram, found);
        EXPECT_EQ(found.offsets, expected.offsets);
        ASSERT_GE(found.items.size(), expected.items.size());
        EXPECT_TRUE(std::equal(expected.items.begin(), expected.items.end(), found.items.begin()));
        EXPECT_EQ(found.counts.unbalanced, expected.counts.unbalanced);
        EXPECT_EQ(found.counts.negative, expected.counts.negative);
        EXPECT_EQ(found.counts.max_depth, expected.counts.max_depth);
        EXPECT_TRUE(std::equal(std::begin(found.counts.histogram), std::end(found.counts.histogram),
                               std::begin(expected.counts.histogram)));
      });
    }
  }
}

TEST(TileWalk, GivesTheIntervalsOfAWalkColumnByColumn) {
  std::mt19937_64 random(1);
  const auto pick = [&](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
  };
  // Columns that a ray enters and leaves up to so many times in turn, with ever more of other
  // lengths and orders, with crossings in one voxel, at one depth, and at both ends.
  for (const int pairs : {1, 2, 3}) {
    for (const int others : {0, 1, 5, 30, 100}) {
      for (const int reach : {200, 3000, (1 << 23) - 1}) {
        for (const int empty : {0, 40, 95}) {
          std::vector<std::vector<DepthKey>> columns(kTilePixels);
          for (auto& column : columns) {
            if (pick(0, 99) < empty) continue;
            const bool other = pick(0, 99) < others;
            const int length = other ? pick(1, 7) : 2 * pick(1, pairs);
            for (int i = 0; i < length; ++i)
              column.push_back(static_cast<DepthKey>(pick(0, reach)));
            std::sort(column.begin(), column.end());
            for (std::size_t i = 0; i < column.size(); ++i) {
              const int exit = other ? pick(0, 1) : static_cast<int>(i % 2);
              column[i] = column[i] << 1 | static_cast<DepthKey>(exit);
            }
          }
          SCOPED_TRACE(std::to_string(pairs) + ", " + std::to_string(others) + ", " +
                       std::to_string(reach));
          expect_same(Lists(std::move(columns)));
          if (HasFailure()) return;
        }
      }
    }
  }
}

TEST(TileWalk, TakesTheDeepestListsOfPlanes) {
  // Every second column begins with a crossing that leaves, so that intervals of a vector of
  // columns end at every crossing.
  std::vector<std::vector<DepthKey>> columns(kTilePixels);
  for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
    for (std::uint32_t i = 0; i < kMaxPlanes; ++i) {
      columns[pixel].push_back((i * 1000 + 300) << 1 | (i + pixel) % 2);
    }
  }
  expect_same(Lists(std::move(columns)));
}

}  // namespace
}  // namespace strata
