#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "csg/outline/outline.h"
#include "csg/outline/roof.h"
#include "strata/mesh/diagnose.h"
#include "tests/csg/outline/outline_checks.h"

namespace strata::csg {
namespace {

using testing::area;
using testing::moved;
using testing::with_fn;

double roof_volume(const Outline& outline, const char* method = "straight") {
  const auto roof = make_roof(outline, method, {});
  EXPECT_TRUE(roof) << (roof ? "" : roof.error().message);
  if (!roof) return -1;
  EXPECT_TRUE(is_closed(*roof));
  return signed_volume(*roof);
}

TEST(Roof, SquareIsAPyramid) {
  const auto roof = make_roof(make_square({6, 6}, true), "straight", {});
  ASSERT_TRUE(roof);
  EXPECT_NEAR(signed_volume(*roof), 36, 1e-12);
  EXPECT_NEAR(bounds(*roof).high.z, 3, 1e-12);
}

TEST(Roof, RectangleHasARidge) {
  // A wedge of length 10 - 4 and the two halves of a pyramid.
  EXPECT_NEAR(roof_volume(make_square({10, 4}, false)), 6 * 4 + 16 * 2 / 3.0, 1e-12);
}

TEST(Roof, RegularPolygonsAreCones) {
  for (const int n : {3, 5, 8, 30, 101}) {
    const double inradius = 2 * std::cos(std::numbers::pi / n);
    const Outline circle = make_circle(2, with_fn(n));
    EXPECT_NEAR(roof_volume(circle), area(circle) * inradius / 3, 1e-9) << n;
  }
}

TEST(Roof, LHasAValleyAndTHasArms) {
  // A ridge of length 10 along the middle, mitred once: sections of area 1; the two hipped ends,
  // each 1 long, have a third less than a section.
  EXPECT_NEAR(roof_volume({{{{0, 0}, {6, 0}, {6, 2}, {2, 2}, {2, 6}, {0, 6}}}}),
              10 - 2 * (1 - 2 / 3.0), 1e-9);
  const Outline tee{{{{-6, 0}, {-6, -2}, {6, -2}, {6, 0}, {1, 0}, {1, 5}, {-1, 5}, {-1, 0}}}};
  EXPECT_GT(roof_volume(tee), 0);
}

TEST(Roof, RingHasTheVolumeOfItsTwoSlopes) {
  const std::array squares{make_square({10, 10}, true), make_square({6, 6}, true)};
  // Each side is a wedge of width 2 and height 1, mitred: base 2 * 1 / 2 times the mean length 8.
  EXPECT_NEAR(roof_volume(subtract(squares)), 4 * 8, 1e-9);
}

TEST(Roof, PlusAndCombHaveManyEventsAtOnce) {
  const std::array bars{make_square({12, 4}, true), make_square({4, 12}, true)};
  EXPECT_GT(roof_volume(unite(bars)), 0);
  std::vector<Outline> comb{make_square({20, 2}, false)};
  for (int i = 0; i < 10; ++i) comb.push_back(moved(make_square({1, 5}, false), 2 * i, 1));
  EXPECT_GT(roof_volume(unite(comb)), 0);
}

TEST(Roof, RandomStarsAreClosedAndBelowTheirInradius) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int round = 0; round < 200; ++round) {
    std::vector<glm::dvec2> star;
    const int n = 5 + static_cast<int>(40 * unit(random));
    for (int i = 0; i < n; ++i) {
      const double a = 2 * std::numbers::pi * i / n, r = 2 + 8 * unit(random);
      star.emplace_back(r * std::cos(a), r * std::sin(a));
    }
    EXPECT_GT(roof_volume({{star}}), 0) << round;
  }
}

TEST(Roof, LatticeRegionsAreClosed) {
  std::mt19937 random(6);
  for (int round = 0; round < 2000; ++round) {
    std::vector<Outline> cells;
    for (int x = 0; x < 6; ++x) {
      for (int y = 0; y < 6; ++y) {
        if (random() % 3) cells.push_back(moved(make_square({1.001, 1.001}, false), x, y));
      }
    }
    EXPECT_GT(roof_volume(unite(cells)), 0) << round;
  }
}

TEST(Roof, VoronoiIsRoundAboutReflexCorners) {
  const Outline ell{{{{0, 0}, {6, 0}, {6, 3}, {3, 3}, {3, 6}, {0, 6}}}};
  // Around the corner the distance to it is more than to the nearer of the lines on through it.
  const double straight = roof_volume(ell), round = roof_volume(ell, "voronoi");
  EXPECT_GT(round, straight);
  EXPECT_LT(round, 1.1 * straight);
  const Outline convex = make_square({5, 3}, true);
  EXPECT_NEAR(roof_volume(convex, "voronoi"), roof_volume(convex), 1e-9);
}

TEST(Roof, NamesAMethodItDoesNotKnow) {
  const auto roof = make_roof(make_square({1, 1}, false), "thatched", {});
  ASSERT_FALSE(roof);
  EXPECT_EQ(roof.error().code, ErrorCode::kGeometry);
}

}  // namespace
}  // namespace strata::csg
