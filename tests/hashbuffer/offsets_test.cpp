#include "strata/hashbuffer/offsets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "hashbuffer/random.h"

namespace strata {
namespace {

constexpr OffsetKind kKinds[] = {OffsetKind::kRandom, OffsetKind::kFarthestPoint,
                                 OffsetKind::kPlaneFirst};

TEST(Random, GivesTheSameNumbersOnEveryPlatform) {
  // From the reference implementations: SplitMix64 seeds xoshiro256**.
  Random random(0);
  EXPECT_EQ(random.next(), 0x99ec5f36cb75f2b4u);
  EXPECT_EQ(random.next(), 0xbf6e1f784956452au);
  EXPECT_EQ(random.next(), 0x1a5f849d4933e6e0u);
}

TEST(Random, BelowStaysBelowAndReachesEveryNumber) {
  Random random(3);
  for (const std::uint64_t count : {1u, 2u, 3u, 7u, 8u, 9u}) {
    std::set<std::uint64_t> seen;
    for (int i = 0; i < 500; ++i) seen.insert(random.below(count));
    EXPECT_EQ(seen.size(), count);
    EXPECT_LT(*seen.rbegin(), count);
  }
}

TEST(Offsets, AreDistinctAndInsideTheTable) {
  const struct {
    std::uint64_t pixels, cells, width;
  } tables[] = {{1, 1, 1},         {1, 2, 1},
                {21, 21, 7},       {21, 50, 7},
                {64, 300, 8},      {4000, 4097, 40},
                {1000, 255, 1000}, {4096, 4096, 64},
                {4000, 9999, 50},  {1 << 20, 1638400, 1024}};
  for (const auto& table : tables) {
    for (const OffsetKind kind : kKinds) {
      for (const unsigned ages : {1u, 7u, 255u, 1023u}) {
        const std::uint64_t cells = std::max(table.cells, table.pixels);
        const auto offsets = make_offsets(kind, {.pixels = table.pixels,
                                                 .cells = cells,
                                                 .width = table.width,
                                                 .ages = ages,
                                                 .seed = 5});
        ASSERT_EQ(offsets.size(), std::min<std::uint64_t>(ages, cells) + 1);
        const std::set<std::uint64_t> distinct(offsets.begin() + 1, offsets.end());
        EXPECT_EQ(distinct.size(), offsets.size() - 1);
        EXPECT_LT(*distinct.rbegin(), cells);
      }
    }
  }
}

TEST(Offsets, DependOnNothingButTheRequest) {
  for (const OffsetKind kind : kKinds) {
    OffsetRequest request{.pixels = 5000, .cells = 7001, .width = 50, .ages = 255, .seed = 9};
    const auto first = make_offsets(kind, request);
    EXPECT_EQ(make_offsets(kind, request), first);
    request.seed = 10;
    EXPECT_NE(make_offsets(kind, request), first);
  }
}

TEST(Offsets, AreTheSameOnEveryPlatform) {
  const OffsetRequest request{.pixels = 4096, .cells = 10000, .width = 64, .ages = 5, .seed = 1};
  EXPECT_EQ(make_offsets(OffsetKind::kRandom, request),
            (std::vector<std::uint64_t>{0, 8526, 9406, 6411, 2352, 1164}));
}

TEST(Offsets, ManyMoreCellsThan32BitsCanCount) {
  const std::uint64_t cells = 1ull << 40;
  for (const OffsetKind kind : kKinds) {
    const auto offsets = make_offsets(
        kind, {.pixels = 1ull << 36, .cells = cells, .width = 1 << 18, .ages = 255, .seed = 1});
    EXPECT_GT(*std::max_element(offsets.begin(), offsets.end()), 1ull << 33);
    EXPECT_LT(*std::max_element(offsets.begin(), offsets.end()), cells);
  }
}

TEST(PlaneFirstOffsets, VisitWholePlanesFirst) {
  const auto offsets = make_offsets(
      OffsetKind::kPlaneFirst, {.pixels = 100, .cells = 350, .width = 10, .ages = 20, .seed = 1});
  EXPECT_EQ(offsets[1], 0u);
  EXPECT_EQ(offsets[2], 100u);
  EXPECT_EQ(offsets[3], 200u);
  EXPECT_NE(offsets[4], 300u);  // that plane would not be whole
}

TEST(FarthestPointOffsets, FirstOffsetsAreFartherApartThanRandomOnes) {
  const OffsetRequest request{
      .pixels = 1 << 16, .cells = 1 << 17, .width = 256, .ages = 64, .seed = 4};
  const auto least_distance = [&](OffsetKind kind) {
    const auto offsets = make_offsets(kind, request);
    double least = 1e9;
    for (std::size_t i = 1; i < offsets.size(); ++i) {
      for (std::size_t j = 1; j < i; ++j) {
        const auto turn = [](std::uint64_t a, std::uint64_t b, double period) {
          const double d = std::abs(static_cast<double>(a) - static_cast<double>(b));
          return std::min(d, period - d);
        };
        least = std::min(least, std::hypot(turn(offsets[i] % 256, offsets[j] % 256, 256),
                                           turn(offsets[i] / 256, offsets[j] / 256, 512)));
      }
    }
    return least;
  };
  // 64 points on 256 x 512 cells: the best lattice has 48.6; random points come within a few.
  EXPECT_GT(least_distance(OffsetKind::kFarthestPoint), 28.0);
  EXPECT_LT(least_distance(OffsetKind::kRandom), 14.0);
}

}  // namespace
}  // namespace strata
