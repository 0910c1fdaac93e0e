#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stop_token>
#include <string>
#include <vector>

#include "csg/outline/extrude.h"
#include "csg/outline/text.h"
#include "mesh/polygons/plane_predicates.h"
#include "tests/csg/outline/outline_checks.h"

namespace strata::csg {
namespace {

using testing::area;

TEST(Outline, SquareHasItsCornersAndItsArea) {
  const Outline square = make_square({3, 2}, false);
  ASSERT_EQ(square.contours.size(), 1u);
  EXPECT_EQ(square.contours[0], (std::vector<glm::dvec2>{{0, 0}, {3, 0}, {3, 2}, {0, 2}}));
  EXPECT_EQ(make_square({3, 2}, true).contours[0][0], glm::dvec2(-1.5, -1));
}

TEST(Outline, ShapesWithoutAreaAreEmpty) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = 1 / 0.0;
  for (const double bad : {0.0, -1.0, nan, inf}) {
    EXPECT_TRUE(make_square({bad, 1}, false).empty()) << bad;
    EXPECT_TRUE(make_circle(bad, {}).empty()) << bad;
  }
}

TEST(Outline, CircleIsTheInscribedPolygonThatStartsOnX) {
  Segments segments;
  segments.fn = 12;
  const Outline circle = make_circle(2, segments);
  ASSERT_EQ(circle.contours[0].size(), 12u);
  EXPECT_EQ(circle.contours[0][0], glm::dvec2(2, 0));
  EXPECT_EQ(circle.contours[0][1].y, 1.0);  // sine of 30 degrees, exactly
  EXPECT_EQ(circle.contours[0][3], glm::dvec2(0, 2));
  EXPECT_NEAR(area(circle), 12 * 0.5 * 4 * std::sin(std::numbers::pi / 6), 1e-12);
}

TEST(Outline, PolygonPathsAreOutlineAndHoles) {
  const std::vector<glm::dvec2> points{{0, 0}, {10, 0}, {10, 10}, {0, 10},
                                       {2, 2}, {8, 2},  {8, 8},   {2, 8}};
  const std::vector<std::vector<std::uint32_t>> paths{{0, 1, 2, 3}, {4, 5, 6, 7}};
  const auto ring = make_polygon(points, paths);
  ASSERT_TRUE(ring);
  EXPECT_EQ(ring->contours.size(), 2u);
  EXPECT_DOUBLE_EQ(area(*ring), 64);
  for (const auto& contour : ring->contours) {
    EXPECT_EQ(signed_area(contour) > 0, std::abs(signed_area(contour)) > 50);
  }
}

TEST(Outline, PolygonThatCrossesItselfIsEvenOdd) {
  const std::vector<glm::dvec2> bow{{0, 0}, {2, 2}, {2, 0}, {0, 2}};
  const auto outline = make_polygon(bow, {});
  ASSERT_TRUE(outline);
  EXPECT_EQ(outline->contours.size(), 2u);
  EXPECT_NEAR(area(*outline), 2, 1e-12);
}

TEST(Outline, PolygonNamesTheIndexThatIsOutOfRange) {
  const std::vector<glm::dvec2> points{{0, 0}, {1, 0}, {0, 1}};
  const std::vector<std::vector<std::uint32_t>> paths{{0, 1, 7}};
  const auto outline = make_polygon(points, paths);
  ASSERT_FALSE(outline);
  EXPECT_EQ(outline.error().code, ErrorCode::kInput);
  EXPECT_NE(outline.error().message.find("point 7, but there are 3"), std::string::npos);
  const std::vector<glm::dvec2> bad{{0, 0}, {1, std::nan("")}, {0, 1}};
  EXPECT_NE(make_polygon(bad, {}).error().message.find("point 1"), std::string::npos);
}

TEST(Outline, OperationsKeepInputPointsToTheLastBit) {
  Segments segments;
  segments.fn = 7;
  const std::array operands{
      make_circle(1.0 / 3, segments),
      transform(make_circle(0.7, segments), glm::dmat3({1, 0, 0}, {0, 1, 0}, {1000.1, 0.3, 1}))};
  const Outline both = unite(operands);
  ASSERT_EQ(both.contours.size(), 2u);
  for (const Outline& operand : operands) {
    for (const glm::dvec2& p : operand.contours[0]) {
      bool found = false;
      for (const auto& contour : both.contours) {
        found = found || std::find(contour.begin(), contour.end(), p) != contour.end();
      }
      EXPECT_TRUE(found) << p.x << ' ' << p.y;
    }
  }
}

TEST(Outline, SetOperationsHaveTheAreasOfSets) {
  const std::array squares{
      make_square({4, 4}, false),
      transform(make_square({4, 4}, false), glm::dmat3({1, 0, 0}, {0, 1, 0}, {1, 1, 1}))};
  EXPECT_DOUBLE_EQ(area(unite(squares)), 23);
  EXPECT_DOUBLE_EQ(area(intersect(squares)), 9);
  EXPECT_DOUBLE_EQ(area(subtract(squares)), 7);
  EXPECT_DOUBLE_EQ(area(convex_hull(squares)), 24);
  EXPECT_EQ(convex_hull(squares).contours[0].size(), 6u);
  const std::array none{squares[0], Outline{}};
  EXPECT_TRUE(intersect(none).empty());
  EXPECT_DOUBLE_EQ(area(unite(none)), 16);
  EXPECT_DOUBLE_EQ(area(subtract(none)), 16);
}

TEST(Outline, ManySmallSquaresUniteToOne) {
  std::vector<Outline> tiles;
  for (int i = 0; i < 60; ++i) {
    for (int j = 0; j < 60; ++j) {
      tiles.push_back(
          transform(make_square({1, 1}, false), glm::dmat3({1, 0, 0}, {0, 1, 0}, {i, j, 1})));
    }
  }
  const Outline whole = unite(tiles);
  ASSERT_EQ(whole.contours.size(), 1u);
  EXPECT_EQ(whole.contours[0].size(), 4u);
  EXPECT_DOUBLE_EQ(area(whole), 3600);
}

TEST(Outline, HolesAreFilled) {
  const std::array nested{make_square({10, 10}, true), make_square({6, 6}, true)};
  const Outline ring = subtract(nested);
  EXPECT_DOUBLE_EQ(area(ring), 64);
  EXPECT_DOUBLE_EQ(area(without_holes(ring)), 100);
}

TEST(Outline, OffsetsGrowAndShrink) {
  const Outline square = make_square({10, 10}, true);
  EXPECT_NEAR(area(offset_delta(square, 1, false)), 144, 1e-6);
  EXPECT_NEAR(area(offset_delta(square, -1, false)), 64, 1e-6);
  const Outline chamfered = offset_delta(square, 1, true);
  EXPECT_EQ(chamfered.contours[0].size(), 8u);
  Segments segments;
  segments.fn = 64;
  const Outline round = offset_round(square, 1, segments);
  const double corners = 64 * 0.5 * std::sin(2 * std::numbers::pi / 64);
  EXPECT_NEAR(area(round), 100 + 40 + corners, 1e-3);
  EXPECT_EQ(round.contours[0].size(), 4u * 17u);
  EXPECT_TRUE(offset_round(square, -6, segments).empty());
  EXPECT_TRUE(offset_delta(square, std::nan(""), false).empty());
}

TEST(Outline, MirroredContoursStayCounterClockwise) {
  const Outline mirrored =
      transform(make_square({2, 3}, false), glm::dmat3({-1, 0, 0}, {0, 1, 0}, {0, 0, 1}));
  EXPECT_DOUBLE_EQ(signed_area(mirrored.contours[0]), 6);
  EXPECT_TRUE(transform(make_square({2, 3}, false), glm::dmat3(0)).empty());
}

TEST(Outline, ResizeFollowsTheLargestGivenAxis) {
  const Outline box = make_square({2, 3}, false);
  EXPECT_DOUBLE_EQ(area(resize(box, {4, 0}, {false, false})), 12);
  EXPECT_DOUBLE_EQ(area(resize(box, {4, 0}, {false, true})), 24);
  EXPECT_DOUBLE_EQ(area(resize(box, {4, 12}, {false, false})), 48);
}

TEST(Outline, MinkowskiSumOfConvexShapesHasTheMixedArea) {
  Segments segments;
  segments.fn = 36;
  const Outline circle = make_circle(1, segments), box = make_square({10, 6}, true);
  const std::array operands{box, circle};
  // area(A + B) = area(A) + area(B) + the box's edges moved out by the circle's reach.
  EXPECT_NEAR(area(minkowski_sum(operands)), 60 + area(circle) + 2 * (10 + 6), 1e-9);
  const std::array none{box, Outline{}};
  EXPECT_TRUE(minkowski_sum(none).empty());
  const std::array swapped{circle, box};
  EXPECT_NEAR(area(minkowski_sum(swapped)), area(minkowski_sum(operands)), 1e-9);
}

TEST(Outline, MinkowskiSumOfRingsKeepsOrFillsTheHole) {
  const std::array nested{make_square({10, 10}, true), make_square({6, 6}, true)};
  const Outline ring = subtract(nested);
  const std::array small{ring, make_square({2, 2}, true)};
  EXPECT_NEAR(area(minkowski_sum(small)), 144 - 16, 1e-9);
  const std::array large{ring, make_square({8, 8}, true)};
  EXPECT_NEAR(area(minkowski_sum(large)), 324, 1e-9);
  const std::array rings{ring, ring};
  EXPECT_NEAR(area(minkowski_sum(rings)), 400, 1e-9);
}

TEST(Outline, OrientationIsExactWhereRoundingHidesIt) {
  const glm::dvec2 a(0.5, 0.5), b(12, 12);
  for (int i = -8; i <= 8; ++i) {
    const double y = 24 + i * 0x1p-48;
    EXPECT_EQ(orient(a, b, {24, y}), i > 0 ? 1 : i < 0 ? -1 : 0) << i;
  }
  EXPECT_EQ(orient({0.1, 0.1}, {0.2, 0.2}, {0.3, 0.3}), 0);
  EXPECT_EQ(orient({0.1, 0.1}, {0.2, 0.2}, {0.3, std::nextafter(0.3, 1)}), 1);
}

/// A comb with teeth of different heights, lying or standing.
Outline comb(int teeth, bool standing) {
  Outline outline;
  auto& contour = outline.contours.emplace_back();
  std::mt19937 random(7);
  for (int i = 0; i < teeth; ++i) {
    contour.emplace_back(i, 5 + static_cast<double>(random() % 1000) / 1000);
    contour.emplace_back(i + 0.5, static_cast<double>(random() % 1000) / 1000);
  }
  contour.emplace_back(teeth, -5);
  contour.emplace_back(0, -5);
  if (standing) {
    for (glm::dvec2& p : contour) p = {-p.y, p.x};
  }
  return outline;
}

TEST(Outline, SweepsAlongEitherAxisGiveTheSame) {
  const Outline lying = clean(comb(1000, false), Fill::kEvenOdd);
  const Outline standing = clean(comb(1000, true), Fill::kEvenOdd);
  EXPECT_EQ(lying.contours.size(), standing.contours.size());
  EXPECT_GT(area(lying), 0);
  EXPECT_NEAR(area(lying), area(standing), 1e-9 * area(lying));
  const Outline bar = {{{{-1, 1}, {2000, 1}, {2000, 3}, {-1, 3}}}};
  const std::vector<Outline> both{lying, bar};
  const double crossed = area(intersect(both));
  EXPECT_NEAR(area(unite(both)), area(lying) + area(bar) - crossed, 1e-6);
  EXPECT_NEAR(area(subtract(both)), area(lying) - crossed, 1e-6);
  for (const double by : {0.1, -0.1}) {
    EXPECT_NEAR(area(offset_delta(lying, by, false)), area(offset_delta(standing, by, false)),
                1e-6 * area(lying));
  }
}

TEST(Outline, JobsEndWithAStopOrALimit) {
  std::mt19937 random(9);
  Outline tangle;
  auto& contour = tangle.contours.emplace_back();
  for (int i = 0; i < 6000; ++i) {
    contour.emplace_back(static_cast<double>(random() % 10000),
                         static_cast<double>(random() % 10000));
  }
  Execution execution;
  OutlineJob limited(execution);
  EXPECT_TRUE(clean(tangle, Fill::kEvenOdd, &limited).empty());
  ASSERT_TRUE(limited.error);
  EXPECT_EQ(limited.error->code, ErrorCode::kLimit);
  EXPECT_NE(limited.error->message.find("have about"), std::string::npos);
  execution.memory_limit = 1 << 20;
  OutlineJob small(execution);
  const std::vector<Outline> combs{comb(3000, false), comb(3000, true)};
  EXPECT_TRUE(minkowski_sum(combs, &small).empty());
  ASSERT_TRUE(small.error);
  EXPECT_EQ(small.error->code, ErrorCode::kLimit);
  execution.memory_limit = 0;
  std::stop_source source;
  execution.stop = source.get_token();
  OutlineJob job(execution);
  const Outline lying = clean(comb(10000, false), Fill::kEvenOdd, &job);
  EXPECT_EQ(area(lying), area(clean(comb(10000, false), Fill::kEvenOdd)));
  EXPECT_FALSE(job.error);
  source.request_stop();
  EXPECT_TRUE(clean(lying, Fill::kEvenOdd, &job).empty());
  ASSERT_TRUE(job.error);
  EXPECT_EQ(job.error->code, ErrorCode::kCancelled);
  std::string missing;
  TextOptions text;
  text.text = "stop";
  EXPECT_FALSE(make_text(text, missing, &job));
  EXPECT_TRUE(linear_extrude(lying, {}, &job).triangles.empty());
  EXPECT_FALSE(rotate_extrude(make_circle(1, {}), {}, &job));
}

}  // namespace
}  // namespace strata::csg
