#include "strata/hashbuffer/resize_policy.h"

#include <gtest/gtest.h>

namespace strata {
namespace {

TEST(ResizePolicy, GrowsAt80PercentAndShrinksBelow30By25PercentASide) {
  EXPECT_EQ(next_frame_cells(1024 * 1024, 1000, 838861), 1280u * 1280u);  // 80.0001 %
  EXPECT_EQ(next_frame_cells(1024 * 1024, 1000, 838860), 1024u * 1024u);  // 79.9999 %
  EXPECT_EQ(next_frame_cells(1280 * 1280, 1000, 1310720), 1600u * 1600u);
  EXPECT_EQ(next_frame_cells(1600, 10, 480), 1600u);  // 30 %
  EXPECT_EQ(next_frame_cells(1600, 10, 479), 900u);
}

// Erratum E16: the printed rule may shrink the table below the screen, where ages stop to tell
// pixels apart.
TEST(ResizePolicy, E16NeverBelowTheScreen) {
  for (std::uint64_t pixels = 1; pixels < 200; ++pixels) {
    for (std::uint64_t cells = 1; cells < 400; cells += 7) {
      for (std::uint64_t fragments = 0; fragments < 60; ++fragments) {
        EXPECT_GE(next_frame_cells(cells, pixels, fragments), pixels);
      }
    }
  }
}

TEST(ResizePolicy, ConstantFragmentsChangeTheTableOnceAtMost) {
  for (std::uint64_t cells = 1; cells < 300; ++cells) {
    for (std::uint64_t fragments = 0; fragments < 600; ++fragments) {
      const std::uint64_t once = next_frame_cells(cells, 3, fragments);
      EXPECT_EQ(next_frame_cells(once, 3, fragments), once) << cells << " " << fragments;
      EXPECT_LT(fragments * 10, once * 8);
      if (once > 3) {
        EXPECT_GE(fragments * 10, once * 3) << cells << " " << fragments;
      }
    }
  }
}

TEST(ResizePolicy, ASlowlyBreathingSceneDoesNotFlap) {
  // 10 % up and down around any load: at most one change after the first.
  for (std::uint64_t fragments = 100000; fragments < 1000000; fragments += 12345) {
    std::uint64_t cells = next_frame_cells(65536, 65536, fragments);
    int changes = 0;
    for (int frame = 0; frame < 20; ++frame) {
      const std::uint64_t next =
          next_frame_cells(cells, 65536, frame % 2 == 0 ? fragments : fragments / 10 * 9);
      changes += next != cells;
      cells = next;
    }
    EXPECT_LE(changes, 1) << fragments;
  }
}

TEST(ResizePolicy, CountsBeyond32Bits) {
  const std::uint64_t cells = 1ull << 40;
  EXPECT_EQ(next_frame_cells(cells, 1, cells), cells / 16 * 25);
  EXPECT_EQ(next_frame_cells(cells, 1, cells / 4), cells / 16 * 9);
}

}  // namespace
}  // namespace strata
