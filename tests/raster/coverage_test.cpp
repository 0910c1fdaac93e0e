// A planar region cut into triangles covers each pixel once, whatever the cuts.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "raster/triangle_setup.h"
#include "tests/support/voxel_set.h"

namespace strata {
namespace {

using testkit::kAllAxes;

constexpr int kWidth = 40, kHeight = 33;

/// Signed coverage of each pixel: +1 for a triangle counter-clockwise in the frame, else -1.
using Cover = std::vector<int>;

struct Corner {
  int u, v, w;
};

glm::ivec3 in_space(const Corner& c, const AxisFrame& frame) {
  glm::ivec3 p{};
  p[frame.u] = c.u, p[frame.v] = c.v, p[frame.w] = c.w;
  return p;
}

void add_triangle(Cover& cover, const Corner& a, const Corner& b, const Corner& c,
                  const AxisFrame& frame) {
  TriangleSetup t;
  if (!setup_triangle(in_space(a, frame), in_space(b, frame), in_space(c, frame), frame, t)) return;
  const bool counter_clockwise = t.exit != (frame.w == 1);
  rasterize_exact(t, {0, 0, kWidth, kHeight}, 1 << 24, [&](int u, int v, std::uint32_t) {
    cover[static_cast<std::size_t>(v * kWidth + u)] += counter_clockwise ? 1 : -1;
  });
}

Cover cover_of_fan(const std::vector<Corner>& polygon, std::size_t apex, const AxisFrame& frame) {
  Cover cover(kWidth * kHeight);
  const std::size_t n = polygon.size();
  for (std::size_t i = 1; i + 1 < n; ++i) {
    add_triangle(cover, polygon[apex], polygon[(apex + i) % n], polygon[(apex + i + 1) % n], frame);
  }
  return cover;
}

// I4
TEST(Coverage, OfAPolygonDoesNotDependOnItsDiagonals) {
  std::mt19937_64 random(4);
  for (int round = 0; round < 300; ++round) {
    const int step = std::vector{1, 8, 64, 128, 256}[random() % 5];
    const int shift = random() % 2 == 0 ? 128 : 0;
    std::vector<Corner> polygon(3 + random() % 9);
    for (auto& c : polygon) {
      const auto pick = [&](int pixels) {
        return static_cast<int>(random() % static_cast<unsigned>(pixels * 256 / step)) * step +
               shift;
      };
      c = {pick(kWidth), pick(kHeight), 0};
    }
    for (const Axis axis : kAllAxes) {
      const AxisFrame frame(axis);
      const Cover first = cover_of_fan(polygon, 0, frame);
      for (std::size_t apex = 1; apex < polygon.size(); ++apex) {
        ASSERT_EQ(cover_of_fan(polygon, apex, frame), first) << "round " << round;
      }
    }
  }
}

TEST(Coverage, OfAPlaneCutAtRandomIsOneEverywhere) {
  // A rectangle of points, moved about, on pixel centres more often than not; each cell is cut
  // along either diagonal. Points stay in order, so no triangle turns around.
  std::mt19937_64 random(5);
  for (int round = 0; round < 60; ++round) {
    constexpr int kCells = 9;
    Corner grid[kCells + 1][kCells + 1];
    const bool centres = round % 3 != 0;
    for (int j = 0; j <= kCells; ++j) {
      for (int i = 0; i <= kCells; ++i) {
        const bool rim = i == 0 || j == 0 || i == kCells || j == kCells;
        const int reach = rim ? 0 : centres ? 2 : 500;
        const auto away = [&] {
          return reach == 0 ? 0
                            : static_cast<int>(random() % static_cast<unsigned>(reach)) - reach / 2;
        };
        const int unit = centres ? 256 : 1, off = centres ? 128 : 0;
        grid[j][i] = {(i * 6 - 7) * 256 + off + away() * unit,
                      (j * 6 - 9) * 256 + off + away() * unit, static_cast<int>(random() % 9999)};
      }
    }
    for (const Axis axis : kAllAxes) {
      const AxisFrame frame(axis);
      Cover cover(kWidth * kHeight);
      for (int j = 0; j < kCells; ++j) {
        for (int i = 0; i < kCells; ++i) {
          const Corner &a = grid[j][i], &b = grid[j][i + 1], &c = grid[j + 1][i + 1],
                       &d = grid[j + 1][i];
          if (random() % 2 == 0) {
            add_triangle(cover, a, b, c, frame), add_triangle(cover, a, c, d, frame);
          } else {
            add_triangle(cover, b, c, d, frame), add_triangle(cover, b, d, a, frame);
          }
        }
      }
      ASSERT_EQ(std::count(cover.begin(), cover.end(), 1), kWidth * kHeight) << "round " << round;
    }
  }
}

TEST(Coverage, FanAroundAPixelCentreHitsItOnce) {
  std::mt19937_64 random(6);
  int checked = 0;
  const Corner hub{7 * 256 + 128, 9 * 256 + 128, 50};
  for (int round = 0; round < 500; ++round) {
    // Corners in turn around the hub, some on the axes through it.
    std::vector<Corner> rim;
    const Corner directions[] = {{3, 0, 0},  {2, 1, 0},   {0, 2, 0},  {-1, 3, 0},
                                 {-2, 0, 0}, {-3, -2, 0}, {0, -1, 0}, {4, -3, 0}};
    for (const auto& d : directions) {
      if (random() % 4 == 0 && rim.size() + 4 < 8) continue;
      const int length = 1 + static_cast<int>(random() % 300);
      rim.push_back({hub.u + d.u * length, hub.v + d.v * length, static_cast<int>(random() % 999)});
    }
    for (const Axis axis : kAllAxes) {
      const AxisFrame frame(axis);
      Cover cover(kWidth * kHeight);
      int turned = 0;
      for (std::size_t i = 0; i < rim.size(); ++i) {
        const Corner &a = rim[i], &b = rim[(i + 1) % rim.size()];
        const std::int64_t area =
            std::int64_t{a.u - hub.u} * (b.v - hub.v) - std::int64_t{b.u - hub.u} * (a.v - hub.v);
        turned += area <= 0;
        add_triangle(cover, hub, a, b, frame);
      }
      if (turned > 0) continue;  // a gap of half a turn: the fan would overlap itself
      ++checked;
      EXPECT_EQ(cover[9 * kWidth + 7], 1) << "round " << round;
      EXPECT_EQ(*std::max_element(cover.begin(), cover.end()), 1);
      EXPECT_EQ(*std::min_element(cover.begin(), cover.end()), 0);
    }
  }
  EXPECT_GT(checked, 500);
}

TEST(Coverage, OfASquareOnPixelCentresIsHalfOpen) {
  // The sample is moved towards +u, and less towards +v: edges on centres belong to the square on
  // their low sides. This is the top-left rule of a picture whose first row is the lowest v.
  for (const Axis axis : kAllAxes) {
    const AxisFrame frame(axis);
    const auto at = [](int u, int v) { return Corner{u * 256 + 128, v * 256 + 128, 77}; };
    Cover cover(kWidth * kHeight);
    add_triangle(cover, at(3, 4), at(8, 4), at(8, 10), frame);
    add_triangle(cover, at(3, 4), at(8, 10), at(3, 10), frame);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const bool inside = u >= 3 && u < 8 && v >= 4 && v < 10;
        EXPECT_EQ(cover[static_cast<std::size_t>(v * kWidth + u)], inside ? 1 : 0)
            << u << ", " << v;
      }
    }
  }
}

TEST(Coverage, OfATriangleSeenEdgeOnIsNothing) {
  const AxisFrame frame(Axis::kZ);
  Cover cover(kWidth * kHeight);
  add_triangle(cover, {128, 128, 0}, {5000, 128, 0}, {2000, 128, 900}, frame);  // along u
  add_triangle(cover, {128, 128, 0}, {128, 5000, 0}, {128, 700, 900}, frame);   // along v
  add_triangle(cover, {128, 128, 0}, {128, 128, 0}, {128, 128, 900}, frame);    // a line
  add_triangle(cover, {128, 128, 5}, {128, 128, 5}, {128, 128, 5}, frame);      // a point
  add_triangle(cover, {128, 128, 0}, {128 * 21, 128 * 21, 0}, {128 * 9, 128 * 9, 9}, frame);
  EXPECT_EQ(std::count(cover.begin(), cover.end(), 0), kWidth * kHeight);
}

}  // namespace
}  // namespace strata
