#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numbers>

#include "csg/outline/extrude.h"
#include "csg/outline/outline.h"
#include "csg/outline/shadow.h"
#include "strata/mesh/diagnose.h"
#include "tests/csg/outline/outline_checks.h"

namespace strata::csg {
namespace {

using testing::area;
using testing::moved;
using testing::with_fn;

Outline ring() {
  const std::array nested{make_square({10, 10}, true), make_square({6, 6}, true)};
  return subtract(nested);
}

/// V - E + F of a mesh whose edges are all shared by two triangles.
long euler(const TriangleSoup& mesh) {
  const auto d = diagnose(mesh);
  return static_cast<long>(d.welded_vertices) - static_cast<long>(d.edges) +
         static_cast<long>(d.triangles);
}

bool has_vertex(const TriangleSoup& mesh, const glm::dvec3& p, double tolerance = 1e-12) {
  return std::any_of(mesh.positions.begin(), mesh.positions.end(),
                     [&](const glm::dvec3& q) { return glm::distance(p, q) <= tolerance; });
}

TEST(LinearExtrude, PrismHasTwoLayersAndItsVolume) {
  LinearExtrude options;
  options.height = 5;
  const TriangleSoup prism = linear_extrude(ring(), options);
  EXPECT_EQ(prism.positions.size(), 16u);
  EXPECT_TRUE(is_closed(prism));
  EXPECT_DOUBLE_EQ(signed_volume(prism), 64 * 5);
  EXPECT_EQ(euler(prism), 0);  // a ring: genus 1
  options.centre = true;
  const Bounds b = bounds(linear_extrude(ring(), options));
  EXPECT_EQ(b.low.z, -2.5);
  EXPECT_EQ(b.high.z, 2.5);
}

TEST(LinearExtrude, TwistTurnsClockwiseAndIsExactAtQuarters) {
  LinearExtrude options;
  options.height = 10;
  options.twist = 90;
  options.slices = 2;
  const TriangleSoup mesh = linear_extrude(moved(make_square({1, 1}, false), 2, 0), options);
  EXPECT_EQ(mesh.positions.size(), 12u);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_TRUE(has_vertex(mesh, {0, -2, 10}, 0));  // (2, 0) turned by -90 degrees
  EXPECT_TRUE(has_vertex(mesh, {1, -3, 10}, 0));  // (3, 1)
  const double half = 2 * std::numbers::sqrt2 / 2;
  EXPECT_TRUE(has_vertex(mesh, {half, -half, 5}));
}

TEST(LinearExtrude, SlicesFollowFnFaAndFs) {
  const Outline square = make_square({10, 10}, true);
  const auto layers = [&](LinearExtrude options) {
    return linear_extrude(square, options).positions.size() / 4;
  };
  LinearExtrude options;
  options.height = 20;
  EXPECT_EQ(layers(options), 2u);
  options.twist = 90;
  options.segments = with_fn(20);
  EXPECT_EQ(layers(options), 5u + 1);  // ceil(90 * 20 / 360)
  options.segments = Segments{};
  // min(ceil(90 / 12), ceil(L / 2)), L = sqrt((pi/2 * sqrt(50))^2 + 20^2) = 22.87
  EXPECT_EQ(layers(options), 8u + 1);
  options.segments.fs = 6;
  EXPECT_EQ(layers(options), 4u + 1);
  options.segments = with_fn(1);
  options.twist = 500;
  EXPECT_EQ(layers(options), 5u + 1);  // at least one for each 120 degrees
  options.twist = 0;
  options.scale = {2, 1};
  options.segments = Segments{};
  EXPECT_EQ(layers(options), 11u + 1);  // ceil(sqrt(5^2 + 20^2) / 2)
  options.segments = with_fn(7);
  EXPECT_EQ(layers(options), 7u + 1);
  options.scale = {2, 2};
  EXPECT_EQ(layers(options), 2u);
}

TEST(LinearExtrude, ScaleOfZeroMakesAnApexOrAnEdge) {
  LinearExtrude options;
  options.height = 6;
  options.scale = {0, 0};
  const TriangleSoup pyramid = linear_extrude(make_square({4, 4}, true), options);
  EXPECT_EQ(pyramid.positions.size(), 5u);
  EXPECT_TRUE(is_closed(pyramid));
  EXPECT_DOUBLE_EQ(signed_volume(pyramid), 32);
  EXPECT_EQ(diagnose(pyramid).degenerate_faces, 0u);
  options.scale = {0, 1};
  options.slices = 1;
  const TriangleSoup wedge = linear_extrude(make_square({4, 4}, true), options);
  EXPECT_TRUE(is_closed(wedge));
  EXPECT_DOUBLE_EQ(signed_volume(wedge), 48);
}

TEST(LinearExtrude, FollowsADirection) {
  LinearExtrude options;
  options.direction = glm::normalize(glm::dvec3(1, 0, 1));
  options.height = std::numbers::sqrt2;
  const TriangleSoup leaning = linear_extrude(make_square({1, 1}, false), options);
  EXPECT_TRUE(has_vertex(leaning, {1, 0, 1}, 1e-15));
  EXPECT_NEAR(signed_volume(leaning), 1, 1e-15);
  options.direction.z = -options.direction.z;
  EXPECT_NEAR(signed_volume(linear_extrude(make_square({1, 1}, false), options)), 1, 1e-15);
}

TEST(LinearExtrude, NewerDialectDividesTheEdges) {
  LinearExtrude options;
  options.height = 10;
  options.twist = 90;
  options.slices = 3;
  options.outline_segments = 12;
  const TriangleSoup mesh = linear_extrude(make_square({4, 4}, true), options);
  EXPECT_EQ(mesh.positions.size(), 12u * 4);
  EXPECT_TRUE(is_closed(mesh));
  options.outline_segments = 0;
  options.divide_outline = true;
  options.segments = with_fn(10);  // 12 would be the next step: not reached
  EXPECT_EQ(linear_extrude(make_square({4, 4}, true), options).positions.size(), 8u * 4);
  options.twist = 0;
  EXPECT_EQ(linear_extrude(make_square({4, 4}, true), options).positions.size(), 4u * 4);
}

TEST(LinearExtrude, TwistedRingsStayClosed) {
  for (const double twist : {-720.0, -100.0, 33.0, 400.0}) {
    for (const double scale : {0.0, 0.3, 1.0, 2.5}) {
      LinearExtrude options;
      options.height = 30;
      options.twist = twist;
      options.scale = {scale, scale};
      const TriangleSoup mesh = linear_extrude(ring(), options);
      EXPECT_TRUE(is_closed(mesh)) << twist << ' ' << scale;
      EXPECT_GT(signed_volume(mesh), 0) << twist << ' ' << scale;
    }
  }
}

TEST(LinearExtrude, NonsenseIsEmpty) {
  LinearExtrude options;
  options.height = 0;
  EXPECT_TRUE(linear_extrude(ring(), options).triangles.empty());
  options.height = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(linear_extrude(ring(), options).triangles.empty());
  options.height = 1;
  options.twist = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(linear_extrude(ring(), options).triangles.empty());
  options.twist = 0;
  EXPECT_TRUE(linear_extrude({}, options).triangles.empty());
}

TEST(LinearExtrude, DividedEdgesAreClosedAtBothEnds) {
  // Edges divided into parts whose points are a rounding off the line; holes as well.
  Outline outline = make_square({3, 2}, true);
  outline.contours.push_back({{-0.7, -0.3}, {-0.1, 0.7}, {0.9, 0.1}});
  for (const int segments : {5, 7, 64, 1000, 20000}) {
    LinearExtrude options;
    options.height = 2;
    options.outline_segments = segments;
    options.twist = 0;
    const TriangleSoup mesh = linear_extrude(outline, options);
    EXPECT_TRUE(is_closed(mesh));
    EXPECT_NEAR(signed_volume(mesh), 2 * testing::area(outline), 1e-9) << segments;
    const auto expected = [&](std::size_t corners) {
      return std::max(corners, static_cast<std::size_t>(segments));
    };
    EXPECT_NEAR(static_cast<double>(mesh.positions.size()) / 2,
                static_cast<double>(expected(4) + expected(3)), 8)
        << segments;
  }
}

TEST(RotateExtrude, FullTurnIsATorusOfTheFormula) {
  RotateExtrude options;
  options.start = 180;
  options.segments = with_fn(24);
  const Outline profile = moved(make_circle(1, with_fn(8)), 5, 0);
  const auto torus = rotate_extrude(profile, options);
  ASSERT_TRUE(torus);
  EXPECT_EQ(torus->positions.size(), 24u * 8);
  EXPECT_TRUE(is_closed(*torus));
  EXPECT_EQ(euler(*torus), 0);
  EXPECT_TRUE(has_vertex(*torus, {-6, 0, 0}, 0));
  // Pappus for a polygon of 24 sides instead of a circle.
  EXPECT_NEAR(signed_volume(*torus), area(profile) * 5 * 24 * std::sin(2 * std::numbers::pi / 24),
              1.0);
}

TEST(RotateExtrude, PartOfATurnHasCaps) {
  RotateExtrude options;
  options.angle = 90;
  options.segments = with_fn(16);
  const auto part = rotate_extrude(moved(ring(), 10, 0), options);
  ASSERT_TRUE(part);
  EXPECT_EQ(part->positions.size(), 5u * 8);
  EXPECT_TRUE(is_closed(*part));
  EXPECT_GT(signed_volume(*part), 0);
  EXPECT_TRUE(has_vertex(*part, {15, 5, 5}, 1e30));
  EXPECT_TRUE(has_vertex(*part, {15, 0, 5}, 0));
  EXPECT_TRUE(has_vertex(*part, {0, 15, 5}, 0));
  options.angle = -90;
  const auto back = rotate_extrude(moved(ring(), 10, 0), options);
  EXPECT_NEAR(signed_volume(*back), signed_volume(*part), 1e-9);
  const auto left = rotate_extrude(moved(ring(), -10, 0), options);
  EXPECT_NEAR(signed_volume(*left), signed_volume(*part), 1e-9);
}

TEST(RotateExtrude, PointsOnTheAxisAreOneVertex) {
  RotateExtrude options;
  options.segments = with_fn(12);
  const Outline triangle{{{{0, 0}, {2, 0}, {0, 3}}}};
  const auto cone = rotate_extrude(triangle, options);
  ASSERT_TRUE(cone);
  EXPECT_EQ(cone->positions.size(), 12u + 2);
  EXPECT_EQ(cone->triangles.size(), 24u);
  EXPECT_TRUE(is_closed(*cone));
  EXPECT_EQ(euler(*cone), 2);
  options.angle = 100;
  EXPECT_TRUE(is_closed(*rotate_extrude(triangle, options)));
}

TEST(RotateExtrude, FragmentsAreRoundedAsTheDialectDoes) {
  RotateExtrude options;
  options.angle = 100;
  options.segments = with_fn(16);  // 4.44 fragments
  const Outline square = moved(make_square({1, 1}, false), 1, 0);
  EXPECT_EQ(rotate_extrude(square, options)->positions.size(), 4u * 5);
  options.round_up = true;
  EXPECT_EQ(rotate_extrude(square, options)->positions.size(), 4u * 6);
}

TEST(RotateExtrude, RefusesAnOutlineOnBothSides) {
  const auto refused = rotate_extrude(make_square({2, 2}, true), {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kGeometry);
  EXPECT_TRUE(rotate_extrude({}, {})->triangles.empty());
}

TEST(Slab, LiesExactlyBetweenItsHeights) {
  const TriangleSoup slab = make_slab(ring(), -0.5, 0.5);
  EXPECT_TRUE(is_closed(slab));
  EXPECT_DOUBLE_EQ(signed_volume(slab), 64);
  EXPECT_EQ(bounds(slab).low.z, -0.5);
  EXPECT_EQ(bounds(slab).high.z, 0.5);
}

TEST(Shadow, OfAPrismIsItsOutline) {
  LinearExtrude options;
  options.height = 5;
  const Outline shade = shadow(linear_extrude(ring(), options));
  EXPECT_EQ(shade.contours.size(), 2u);
  EXPECT_DOUBLE_EQ(area(shade), 64);
  options.twist = 180;
  options.segments = with_fn(120);
  EXPECT_NEAR(area(shadow(linear_extrude(make_square({10, 10}, true), options))),
              std::numbers::pi * 50, 1);
}

TEST(Shadow, OfAnOpenMeshCoversAllItsTriangles) {
  TriangleSoup sheet;
  sheet.positions = {{0, 0, 0}, {1, 0, 1}, {1, 1, 2}, {0, 1, 3}, {5, 5, std::nan("")}};
  sheet.triangles = {{0, 1, 2}, {0, 3, 2}, {0, 1, 4}};  // the second faces down
  EXPECT_DOUBLE_EQ(area(shadow(sheet)), 1);
}

TEST(Shadow, OfAMillionTrianglesComesFromTheSilhouette) {
  RotateExtrude options;
  options.segments = with_fn(1000);
  const auto torus = rotate_extrude(moved(make_circle(1, with_fn(300)), 5, 0), options);
  const Outline shade = shadow(*torus);
  EXPECT_EQ(shade.contours.size(), 2u);
  EXPECT_NEAR(area(shade), std::numbers::pi * (36 - 16), 0.01);
}

TEST(CrossSection, CutsThroughAtZero) {
  RotateExtrude options;
  options.segments = with_fn(60);
  auto torus = rotate_extrude(moved(make_circle(1, with_fn(60)), 5, 0.25), options);
  const Outline cut = cross_section(*torus);
  EXPECT_EQ(cut.contours.size(), 2u);
  const double half = std::sqrt(1 - 0.0625);
  EXPECT_NEAR(area(cut), std::numbers::pi * ((5 + half) * (5 + half) - (5 - half) * (5 - half)),
              0.2);
}

TEST(CrossSection, CountsFacesThatLieInThePlaneOnce) {
  for (const double low : {0.0, -1.0, -2.0}) {
    const TriangleSoup slab = make_slab(ring(), low, low + 2);
    EXPECT_DOUBLE_EQ(area(cross_section(slab)), 64) << low;
  }
  EXPECT_TRUE(cross_section(make_slab(ring(), 1, 2)).empty());
}

TEST(CrossSection, SolidsThatOverlapAreOneRegion) {
  TriangleSoup both = make_slab(make_square({4, 4}, false), -1, 1);
  append(both, make_slab(moved(make_square({4, 4}, false), 2, 2), -1, 1));
  EXPECT_DOUBLE_EQ(area(cross_section(both)), 28);
}

}  // namespace
}  // namespace strata::csg
