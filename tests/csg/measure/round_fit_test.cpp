#include "csg/measure/round_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"

namespace strata::csg {
namespace {

using Kind = RoundFit::Kind;

/// The facet whose middle is nearest to a point.
std::uint32_t facet_at(const TriangleSoup& mesh, const glm::dvec3& p) {
  std::uint32_t best = 0;
  double nearest = 1e300;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    glm::dvec3 middle(0.0);
    for (int k = 0; k < 3; ++k) middle += mesh.positions[mesh.triangles[t][k]] / 3.0;
    if (glm::distance(middle, p) < nearest) nearest = glm::distance(middle, p), best = t;
  }
  return best;
}

RoundFit fit(const TriangleSoup& mesh, const glm::dvec3& p) {
  return fit_round(mesh.positions, mesh.triangles, facet_at(mesh, p), p);
}

/// Rounds as a text file of six digits does.
TriangleSoup rounded(TriangleSoup mesh) {
  for (glm::dvec3& p : mesh.positions) {
    for (int k = 0; k < 3; ++k) p[k] = std::stod(std::to_string(p[k]).substr(0, 8));
  }
  return mesh;
}

TEST(RoundFit, SaysTheRadiusOfTheVerticesOfACylinder) {
  for (const int segments : {8, 12, 64, 65, 360, 2000}) {
    const TriangleSoup mesh = make_cylinder(4, 10, segments);
    const RoundFit found = fit(mesh, {4, 0.1, 5});
    ASSERT_EQ(found.kind, Kind::kCylinder) << segments;
    EXPECT_NEAR(found.radius, 4, 1e-9) << segments;
    EXPECT_NEAR(found.length, 10, 1e-9);
    EXPECT_NEAR(found.span, 360, 1e-9);
    EXPECT_NEAR(std::abs(found.axis.z), 1, 1e-12);
    EXPECT_NEAR(glm::length(found.centre - glm::dvec3(0, 0, 5)), 0, 1e-9);
    EXPECT_EQ(found.facets, 2u * static_cast<unsigned>(segments));
    EXPECT_FALSE(found.hollow);
    const RoundFit text = fit(rounded(mesh), {4, 0.1, 5});
    ASSERT_EQ(text.kind, Kind::kCylinder) << segments;
    EXPECT_NEAR(text.radius, 4, 1e-5) << segments;
    EXPECT_EQ(text.facets, found.facets) << segments;
  }
}

TEST(RoundFit, WhereACylinderStandsAndHowItLiesDoesNotMatter) {
  glm::dmat4 place = glm::translate(glm::dmat4(1), glm::dvec3(100, -70, 30));
  place = glm::rotate(place, 1.1, glm::normalize(glm::dvec3(1, 2, 3)));
  const TriangleSoup mesh = transform(make_cylinder(2.5, 7, 48), place);
  const glm::dvec3 on(place * glm::dvec4(2.5, 0, 3, 1)), axis(place * glm::dvec4(0, 0, 1, 0));
  const RoundFit found = fit(mesh, on);
  ASSERT_EQ(found.kind, Kind::kCylinder);
  EXPECT_NEAR(found.radius, 2.5, 1e-9);
  EXPECT_NEAR(std::abs(glm::dot(found.axis, axis)), 1, 1e-12);
  EXPECT_NEAR(glm::distance(found.centre, glm::dvec3(place * glm::dvec4(0, 0, 3.5, 1))), 0, 1e-9);
}

TEST(RoundFit, TheInsideOfAHoleIsHollow) {
  TriangleSoup mesh = make_cylinder(4, 10, 64);
  reverse_orientation(mesh);
  const RoundFit found = fit(mesh, {4, 0, 5});
  ASSERT_EQ(found.kind, Kind::kCylinder);
  EXPECT_TRUE(found.hollow);
}

/// A prism over a closed line.
TriangleSoup prism(const std::vector<glm::dvec2>& line, double height) {
  TriangleSoup mesh;
  const auto n = static_cast<std::uint32_t>(line.size());
  for (const double z : {0.0, height}) {
    for (const glm::dvec2& p : line) mesh.positions.emplace_back(p, z);
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, j, j + n});
    mesh.triangles.push_back({i, j + n, i + n});
  }
  for (std::uint32_t i = 2; i < n; ++i) {
    mesh.triangles.push_back({0, i, i - 1});
    mesh.triangles.push_back({n, n + i - 1, n + i});
  }
  return mesh;
}

/// A square of 20 whose corners are rounded by a radius.
std::vector<glm::dvec2> rounded_square(double radius, int facets) {
  std::vector<glm::dvec2> line;
  for (int corner = 0; corner < 4; ++corner) {
    for (int i = 0; i <= facets; ++i) {
      const double angle = (corner + static_cast<double>(i) / facets) * std::numbers::pi / 2;
      const glm::dvec2 middle(corner == 0 || corner == 3 ? 10 - radius : radius - 10,
                              corner < 2 ? 10 - radius : radius - 10);
      line.push_back(middle + radius * glm::dvec2(std::cos(angle), std::sin(angle)));
    }
  }
  return line;
}

TEST(RoundFit, ARoundedEdgeIsAnArcAndTheFlatSideBesideItIsFlat) {
  const TriangleSoup mesh = prism(rounded_square(3, 8), 5);
  for (const glm::dvec2 on : {glm::dvec2(10, 7.3), glm::dvec2(9.1, 9.1)}) {
    const RoundFit found = fit(mesh, {on, 2.5});
    ASSERT_EQ(found.kind, Kind::kCylinder) << on.y;
    EXPECT_NEAR(found.radius, 3, 1e-9);
    EXPECT_NEAR(found.span, 90, 1e-6);
    EXPECT_NEAR(found.centre.x, 7, 1e-9);
    EXPECT_NEAR(found.centre.y, 7, 1e-9);
  }
  EXPECT_NE(fit(mesh, {10, 0, 2.5}).kind, Kind::kCylinder);
}

TEST(RoundFit, WhatIsNoCylinderIsNone) {
  EXPECT_EQ(fit(make_box(glm::dvec3(0), glm::dvec3(1, 2, 3)), {1, 1, 1}).kind, Kind::kFlat);
  EXPECT_EQ(fit(make_cone(4, 10, 64), {2, 0, 5}).kind, Kind::kNone);
  EXPECT_EQ(fit(make_cylinder(4, 10, 6), {3, 2, 5}).kind, Kind::kFlat);
  const TriangleSoup torus = make_torus(5, 2, 64, 32);
  EXPECT_EQ(fit(torus, {7, 0, 0}).kind, Kind::kNone);
  EXPECT_EQ(fit(torus, {5, 0, 2}).kind, Kind::kNone);
  const TriangleSoup knot = make_torus_knot(2, 3, 0.5, 300, 24);
  for (const glm::dvec3 on : {glm::dvec3(3, 0, 0), glm::dvec3(1, 1, 1), glm::dvec3(-2, 2, 0)}) {
    EXPECT_EQ(fit(knot, on).kind, Kind::kNone);
  }
  for (const double wide : {1.25, 1.05, 2.0}) {
    TriangleSoup oval = make_cylinder(4, 10, 64);
    for (glm::dvec3& p : oval.positions) p.x *= wide;
    for (int i = 0; i < 16; ++i) {
      const double angle = i * 0.4;
      const glm::dvec3 on(4 * wide * std::cos(angle), 4 * std::sin(angle), 5);
      EXPECT_NE(fit(oval, on).kind, Kind::kCylinder) << wide << " " << i;
    }
  }
}

TEST(RoundFit, SpheresHaveARadiusWhereverTheyArePicked) {
  for (const TriangleSoup& mesh : {make_uv_sphere(3, 48, 24), make_icosphere(3, 4)}) {
    for (const glm::dvec3 on :
         {glm::dvec3(3, 0, 0), glm::dvec3(0, 0, 3), glm::dvec3(1, 2, 2), glm::dvec3(0, -3, 0.1)}) {
      const RoundFit found = fit(mesh, on);
      ASSERT_EQ(found.kind, Kind::kSphere);
      EXPECT_NEAR(found.radius, 3, 1e-9);
      EXPECT_NEAR(glm::length(found.centre), 0, 1e-9);
    }
  }
}

TEST(RoundFit, TheRimOfAFlatEndIsACircle) {
  const TriangleSoup mesh = make_cylinder(4, 10, 64);
  const RoundFit found = fit(mesh, {1, 1, 10});
  ASSERT_EQ(found.kind, Kind::kCircle);
  EXPECT_NEAR(found.radius, 4, 1e-9);
  EXPECT_NEAR(glm::length(found.centre - glm::dvec3(0, 0, 10)), 0, 1e-9);
  EXPECT_NEAR(std::abs(found.axis.z), 1, 1e-12);
}

TEST(RoundFit, AScannedCylinderHasTheRadiusThatItsPointsMean) {
  TriangleSoup mesh = prism(
      [] {
        std::vector<glm::dvec2> line;
        for (int i = 0; i < 200; ++i) {
          const double angle = 2 * std::numbers::pi * i / 200;
          line.emplace_back(10 * std::cos(angle), 10 * std::sin(angle));
        }
        return line;
      }(),
      20);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> noise(-0.003, 0.003);
  for (glm::dvec3& p : mesh.positions) {
    for (int k = 0; k < 3; ++k) p[k] += noise(random);
  }
  const RoundFit found = fit(mesh, {10, 0, 10});
  ASSERT_EQ(found.kind, Kind::kCylinder);
  EXPECT_NEAR(found.radius, 10, 0.003);
  EXPECT_GT(found.deviation, 0.001);
}

}  // namespace
}  // namespace strata::csg
