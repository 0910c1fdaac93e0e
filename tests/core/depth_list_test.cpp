#include "strata/core/depth_list.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <tuple>
#include <vector>

#include "strata/core/grid.h"

namespace strata {
namespace {

TEST(DepthItem, HoldsItsPartsExactly) {
  for (const std::uint32_t depth : {0u, 1u, 0xffffffu, 0xffffffffu}) {
    for (const bool exit : {false, true}) {
      for (const std::uint32_t triangle : {0u, 1u, 0x7fffffffu}) {
        const DepthItem item(depth, exit, triangle);
        EXPECT_EQ(item.depth(), depth);
        EXPECT_EQ(item.exit(), exit);
        EXPECT_EQ(item.triangle(), triangle);
        EXPECT_EQ(item.payload(), (exit ? 0x80000000u : 0u) | triangle);
        EXPECT_EQ(DepthItem(item.bits), item);
      }
    }
  }
}

TEST(DepthItem, SortsByDepthThenEnteringThenTriangle) {
  std::mt19937 random(1);
  std::uniform_int_distribution<std::uint32_t> small(0, 3);
  std::vector<DepthItem> items;
  for (int i = 0; i < 1000; ++i) {
    items.emplace_back(small(random), small(random) % 2 != 0, small(random));
  }
  std::sort(items.begin(), items.end());
  const auto key = [](DepthItem item) {
    return std::tuple(item.depth(), item.exit(), item.triangle());
  };
  EXPECT_TRUE(std::is_sorted(items.begin(), items.end(),
                             [&](DepthItem a, DepthItem b) { return key(a) < key(b); }));
}

TEST(LayeredDepthImage, AListIsAPieceOfTheItems) {
  LayeredDepthImage image;
  image.width = 2;
  image.height = 2;
  image.offsets = {0, 1, 1, 3, 4};
  image.items = {DepthItem(1, false, 0), DepthItem(2, false, 0), DepthItem(3, true, 0),
                 DepthItem(4, false, 0)};
  EXPECT_EQ(image.list(0, 0).size(), 1u);
  EXPECT_TRUE(image.list(1, 0).empty());
  ASSERT_EQ(image.list(0, 1).size(), 2u);
  EXPECT_EQ(image.list(0, 1)[1].depth(), 3u);
  EXPECT_EQ(image.list(1, 1)[0].depth(), 4u);
}

TEST(AxisFrame, NamesEachAxisOnce) {
  const struct {
    Axis axis;
    int u, v, w;
  } cases[] = {{Axis::kX, 1, 2, 0}, {Axis::kY, 0, 2, 1}, {Axis::kZ, 0, 1, 2}};
  for (const auto& c : cases) {
    const AxisFrame frame(c.axis);
    EXPECT_EQ(std::tuple(frame.u, frame.v, frame.w), std::tuple(c.u, c.v, c.w));
  }
}

}  // namespace
}  // namespace strata
