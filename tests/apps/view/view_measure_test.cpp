#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "apps/view/measure/guides.h"
#include "apps/view/measure/measurements.h"
#include "apps/view/measure/value_range.h"
#include "strata/mesh/shapes.h"

namespace strata::view {
namespace {

View view_of(Projection projection, const glm::dvec3& rotation = {55, 0, 25}) {
  Camera camera;
  camera.projection = projection;
  camera.rotation = rotation;
  camera.distance = 100;
  return *make_view(camera, {400, 300}, {glm::dvec3(-10), glm::dvec3(10)});
}

TEST(Guides, StepsAreOneTwoOrFiveTimesAPowerOfTen) {
  EXPECT_DOUBLE_EQ(round_step(1), 1);
  EXPECT_DOUBLE_EQ(round_step(1.01), 2);
  EXPECT_DOUBLE_EQ(round_step(2.5), 5);
  EXPECT_DOUBLE_EQ(round_step(51), 100);
  EXPECT_DOUBLE_EQ(round_step(0.0021), 0.005);
}

TEST(Guides, TheScaleBarIsTheLongestRoundLengthThatFits) {
  for (const double pixel : {0.0123, 0.05, 0.07, 0.1, 0.3, 1.0, 17.0, 3e5}) {
    const ScaleBar bar = scale_bar(pixel, 180);
    EXPECT_LE(bar.pixels, 180);
    EXPECT_GT(bar.pixels, 180 / 2.51);
    EXPECT_NEAR(bar.pixels * pixel, bar.length, 1e-9 * bar.length);
    EXPECT_NEAR(round_step(bar.length), bar.length, 1e-9 * bar.length);
  }
  EXPECT_DOUBLE_EQ(scale_bar(22.96 / 180, 180).length, 20);
}

TEST(Guides, ALineIsHiddenWhereAFaceIsNearer) {
  for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
    const View view = view_of(projection, {0, 0, 0});  // from above
    DepthImage depth{400, 300, {}};
    // A wall at the distance 100, over the left half of the picture.
    for (int i = 0; i < 400 * 300; ++i) {
      depth.distance.push_back(i % 400 < 200 ? 100.0f : std::numeric_limits<float>::infinity());
    }
    for (const double z : {5.0, -5.0}) {
      const auto parts = stretches(view, depth, {-8, 0, z}, {8, 0, z});
      ASSERT_EQ(parts.size(), z > 0 ? 1u : 2u);
      EXPECT_EQ(parts.front().hidden, z < 0);
      EXPECT_FALSE(parts.back().hidden);
      EXPECT_NEAR(parts.back().from.x, z > 0 ? parts.front().from.x : 200, 4);
      EXPECT_NEAR(parts.front().from.x + parts.back().to.x, 400, 1e-6);
    }
    // A line that goes through the wall is hidden behind it.
    const auto through = stretches(view, depth, {-8, 0, 6}, {-1, 0, -6});
    ASSERT_EQ(through.size(), 2u);
    EXPECT_FALSE(through[0].hidden);
    EXPECT_TRUE(through[1].hidden);
    const auto at_wall = pixel_of(view, {-4.5, 0, 0});
    ASSERT_TRUE(at_wall);
    EXPECT_NEAR(through[0].to.x, at_wall->x, 4);
    EXPECT_EQ(stretches(view, {}, {-8, 0, -5}, {8, 0, -5}).size(), 1u);  // nothing is known
  }
}

TEST(Guides, LinesEndAtThePictureAndBeforeTheEye) {
  const View view = view_of(Projection::kPerspective, {90, 0, 0});  // along +y, the eye at y = -100
  const auto parts = stretches(view, {}, {-1, 50, 0}, {-1, -500, 0});
  ASSERT_EQ(parts.size(), 1u);
  for (const glm::dvec2& end : {parts[0].from, parts[0].to}) {
    EXPECT_GE(end.x, -1e-6);
    EXPECT_LE(end.x, 400 + 1e-6);
  }
  EXPECT_TRUE(stretches(view, {}, {0, -200, 0}, {5, -300, 0}).empty());
  EXPECT_TRUE(stretches(view, {}, {900, 0, 0}, {900, 0, 9}).empty());
}

TEST(Guides, ABoxHasTwelveEdgesAndItsThreeSizes) {
  const BoxGuide box = box_guide(view_of(Projection::kOrthographic), {{0, 0, 0}, {10, 20, 30}});
  EXPECT_EQ(box.edges.size(), 12u);
  double length = 0;
  for (const Guide& edge : box.edges) length += glm::distance(edge.from, edge.to);
  EXPECT_DOUBLE_EQ(length, 4 * 60);
  EXPECT_EQ(box.sizes[0].text, "10");
  EXPECT_EQ(box.sizes[1].text, "20");
  EXPECT_EQ(box.sizes[2].text, "30");
}

TEST(Guides, GridAndTicksStandAtMultiplesOfTheirSpacingAroundTheBox) {
  const Bounds box{{3, 4, 7}, {58, 33, 9}};
  const GridGuide grid = grid_guide(box, 0.1);
  EXPECT_DOUBLE_EQ(grid.spacing, 5);
  double low = 1e9, high = -1e9;
  for (const auto* lines : {&grid.lines, &grid.strong}) {
    for (const Guide& one : *lines) {
      EXPECT_EQ(one.from.z, 0);
      EXPECT_NEAR(std::remainder(one.from.x, 5), 0, 1e-9);
      low = std::min(low, one.from.x), high = std::max(high, one.to.x);
    }
  }
  EXPECT_LE(low, 3);
  EXPECT_GE(high, 58);
  EXPECT_LT(grid_guide(box, 1e-9).lines.size(), 200u);  // however near one is
  const TicksGuide ticks = ticks_guide(box, 0.1);
  EXPECT_DOUBLE_EQ(ticks.spacing, 10);
  EXPECT_EQ(ticks.marks[0].back().text, "70");
  EXPECT_EQ(ticks.marks[2].front().text, "-10");
}

TEST(ValueRange, GoesOverPercentilesToRoundEnds) {
  std::vector<float> values(1000, 0.0f);  // half of the picture shows nothing
  for (int i = 0; i < 500; ++i)
    values[static_cast<std::size_t>(i)] = 2.0f + 0.01f * static_cast<float>(i);
  values[0] = 100.0f, values[1] = 0.001f;
  const ValueRange range = percentile_range(values);
  EXPECT_NEAR(range.low, 2, 1e-9);
  EXPECT_NEAR(range.high, 7, 1e-9);
  EXPECT_TRUE(range.above);
  EXPECT_TRUE(range.below);
  const ValueRange even = percentile_range(std::vector<float>(100, 2.0f));
  EXPECT_EQ(even.low, 0);
  EXPECT_EQ(even.high, 2);
  EXPECT_FALSE(even.above);
  EXPECT_EQ(percentile_range(std::vector<float>(10, 0.0f)).high, 0);
  values.assign(10, std::numeric_limits<float>::infinity());
  EXPECT_EQ(percentile_range(values).high, 0);
}

Probe at(const glm::dvec3& where, const glm::dvec3& normal = {0, 0, 1}) {
  Probe probe;
  probe.hit = true;
  probe.where = probe.point.where = where;
  probe.point.normal = normal;
  return probe;
}

TEST(Measurements, SayNumbersInOneLine) {
  EXPECT_EQ(measured(Tool::kDistance, {at({0, 0, 0}), at({3, 4, 0})}).text,
            "5, dx 3 dy 4 dz 0, from 0 0 0 to 3 4 0");
  Probe corner = at({1e-14, 2, 3});
  corner.snap = csg::Snap::kVertex;
  EXPECT_EQ(measured(Tool::kDistance, {corner, at({0, 2, 7})}).text,
            "4, dx 0 dy 0 dz 4, from vertex 0 2 3 to 0 2 7");
  // A wedge of 30 degrees: its normals are 150 apart.
  const double angle = 150 * 3.14159265358979323846 / 180;
  EXPECT_EQ(measured(Tool::kAngle, {at({0, 0, 0}, {1, 0, 0}),
                                    at({0, 0, 0}, {std::cos(angle), std::sin(angle), 0})})
                .text,
            "30 degrees between the faces, 150 between their normals");
  EXPECT_EQ(measured(Tool::kAngle, {at({0, 0, 0}, {0, 0, -1}), at({4, 5, 3}, {0, 0, 1})}).text,
            "parallel faces, 3 apart");
  Probe wall = at({0, 0, 0});
  wall.along_normal = 2;
  wall.along_ray = std::numeric_limits<double>::infinity();
  EXPECT_EQ(measured(Tool::kThickness, {wall}).text, "2 along the normal, endless along the ray");
}

TEST(Measurements, ABoardTakesPicksUntilAMeasurementIsComplete) {
  MeasureBoard board;
  EXPECT_EQ(board.take(at({0, 0, 0})), nullptr);  // no tool
  board.take_up(Tool::kDistance);
  EXPECT_EQ(board.advice(), "click on the first point; esc ends");
  EXPECT_EQ(board.take({}), nullptr);
  EXPECT_TRUE(board.missed());
  EXPECT_EQ(board.take(at({0, 0, 0})), nullptr);
  EXPECT_FALSE(board.missed());
  EXPECT_EQ(board.advice(), "click on the second point; esc ends");
  ASSERT_NE(board.take(at({0, 0, 2})), nullptr);
  EXPECT_EQ(board.done().back().label, "2");
  EXPECT_TRUE(board.pending().empty());
  for (int i = 0; i < 100; ++i) board.take(at({0, 0, 0}));
  EXPECT_EQ(board.done().size(), 20u);
  EXPECT_EQ(board.completed(), 51u);
  board.clear();
  EXPECT_FALSE(board.shows());
}

/// A probe at a pixel of a tree seen by a camera.
Probe probed(const csg::Tree& tree, const Camera& camera, const glm::dvec3& world,
             const ProbeWish& wish) {
  csg::Preview preview(tree);
  const csg::TreeRays rays(tree, tree.root(), 0.0);
  const View view = *preview.view(camera, {400, 300});
  const auto pixel = pixel_of(view, world);
  EXPECT_TRUE(pixel);
  const auto result = probe(preview, rays, view, glm::ivec2(glm::floor(*pixel)), wish, {});
  EXPECT_TRUE(result);
  return result ? *result : Probe{};
}

csg::Tree solid(TriangleSoup mesh) { return csg::Tree(std::move(mesh)); }

TEST(Probe, AWallSeenAtASlantIsTwoAlongItsNormalAlsoOnACap) {
  csg::Tree plate = solid(make_box({-20, -20, 0}, {20, 20, 2}));
  for (const bool cut : {false, true}) {
    // The section leaves a cap at y = -3.
    if (cut) plate -= solid(make_box({-50, -50, -50}, {50, -3, 50}));
    for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
      Camera camera;
      camera.projection = projection;
      camera.rotation = {40, 0, 20};
      const Probe top = probed(plate, camera, {3, 2, 2}, {.thickness = true});
      ASSERT_TRUE(top.hit);
      EXPECT_NEAR(top.along_normal, 2, 1e-9);
      EXPECT_GT(top.along_ray, 2.3);
      EXPECT_NEAR(top.where.z, 2, 1e-9);
      if (!cut) continue;
      const Probe cap = probed(plate, camera, {3, -3, 1}, {.thickness = true});
      ASSERT_TRUE(cap.hit);
      EXPECT_TRUE(cap.point.cut);
      EXPECT_NEAR(cap.where.y, -3, 1e-9);
      EXPECT_NEAR(cap.along_normal, 23, 1e-9);
      EXPECT_NEAR(glm::distance(cap.point.normal, glm::dvec3(0, -1, 0)), 0, 1e-12);
    }
  }
}

TEST(Probe, PicksMoveToCornersThatCanBeSeen) {
  const csg::Tree box = solid(make_box({0, 0, 0}, {10, 20, 30}));
  for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
    Camera camera;
    camera.projection = projection;
    camera.target = {5, 10, 15};
    const auto snapped = [&](const glm::dvec3& near) {
      return probed(box, camera, near, {.snap = true});
    };
    EXPECT_EQ(snapped({0.5, 0.5, 30}).where, glm::dvec3(0, 0, 30));
    EXPECT_EQ(snapped({9.5, 0.5, 30}).where, glm::dvec3(10, 0, 30));
    EXPECT_EQ(snapped({5.2, 0.1, 30}).where, glm::dvec3(5, 0, 30));
    EXPECT_EQ(snapped({5.2, 0.1, 30}).snap, csg::Snap::kMidpoint);
    const Probe edge = snapped({2.5, 0.1, 30});
    EXPECT_EQ(edge.snap, csg::Snap::kEdge);
    EXPECT_EQ(edge.where.y, 0);
    EXPECT_EQ(edge.where.z, 30);
    EXPECT_EQ(snapped({5, 10, 30}).snap, csg::Snap::kFace);
  }
  // The corner of the box at the origin is cut away: what is left has others.
  const csg::Tree cut = box - solid(make_box({-5, -5, 28}, {2, 2, 40}));
  Camera camera;
  camera.target = {1, 1, 29};
  camera.distance = 40;
  EXPECT_EQ(probed(cut, camera, {2.1, 2.1, 30}, {.snap = true}).where, glm::dvec3(2, 2, 30));
  EXPECT_EQ(probed(cut, camera, {2.1, 0.1, 30}, {.snap = true}).where, glm::dvec3(2, 0, 30));
}

TEST(Probe, AHoleHasTheRadiusOfItsCutterAndASolidItsOwnSize) {
  const csg::Tree plate =
      solid(make_box({-20, -20, 0}, {20, 20, 2})) - solid(make_cylinder(4, 9, 64));
  Camera camera;
  camera.rotation = {40, 0, 0};
  const Probe wall = probed(plate, camera, {0, 4, 1}, {.round = true});
  ASSERT_TRUE(wall.hit);
  EXPECT_EQ(wall.round.kind, csg::RoundFit::Kind::kCylinder);
  EXPECT_NEAR(wall.round.radius, 4, 1e-9);
  EXPECT_TRUE(wall.round.hollow);
  EXPECT_EQ(
      measured(Tool::kRadius, {wall}).text.find("4, diameter 8, hole along 0 0 1 through 0 0"), 0u);
  // A vast cutter too, though it is cut off around what it cuts.
  const csg::Tree half = solid(make_box({-20, -20, 0}, {20, 20, 2})) -
                         solid(make_box({-1e6, -1e6, -1e6}, {1e6, 0, 1e6}));
  const Probe cutter = probed(half, camera, {1, 0, 1}, {.size = true});
  EXPECT_TRUE(cutter.point.cut);
  EXPECT_EQ(measured(Tool::kSize, {cutter}).text,
            "2e+06 x 1e+06 x 2e+06, volume 4e+18, area 1.6e+13");
  const Probe body = probed(plate, camera, {10, 10, 2}, {.size = true});
  EXPECT_EQ(measured(Tool::kSize, {body}).text, "40 x 40 x 2, volume 3200, area 3520");
}

}  // namespace
}  // namespace strata::view
