#include "mesh/clamp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <random>
#include <string>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/shapes.h"

namespace strata {
namespace {

/// How often a mesh winds around a point: the sum of solid angles (van Oosterom, Strackee 1983).
double winding(std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles,
               const glm::dvec3& at) {
  double sum = 0;
  for (const glm::uvec3& t : triangles) {
    const glm::dvec3 a = positions[t.x] - at, b = positions[t.y] - at, c = positions[t.z] - at;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    sum += std::atan2(glm::dot(a, glm::cross(b, c)), la * lb * lc + glm::dot(a, b) * lc +
                                                         glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return sum / (2 * 3.14159265358979323846);
}

TriangleSoup grown(TriangleSoup mesh, double factor, const glm::dvec3& by = glm::dvec3(0.0)) {
  for (glm::dvec3& p : mesh.positions) p = p * factor + by;
  return mesh;
}

TEST(Clamp, ClosedMeshesStayClosedAndWindAsBefore) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> real(-1, 1);
  std::uniform_int_distribution<int> whole(-3, 3);
  int checked = 0, cut_meshes = 0;
  for (int round = 0; round < 200; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    TriangleSoup mesh;
    switch (round % 4) {
      case 0:
        mesh = make_torus(2, 0.8, 12, 7);
        break;
      case 1:
        mesh = make_icosphere(2.5, 1);
        break;
      case 2:
        mesh = make_torus_knot(2, 3, 0.4, 40, 5);
        break;
      default:  // corners on the sides of the box
        mesh = make_box(glm::dvec3(-3, -2, -1), glm::dvec3(1, 2, 3));
    }
    Bounds box;
    if (round % 2 == 0) {
      for (int i = 0; i < 2; ++i)
        box.include(2.0 * glm::dvec3(real(random), real(random), real(random)));
    } else {
      for (int i = 0; i < 2; ++i)
        box.include(glm::dvec3(whole(random), whole(random), whole(random)));
      if (!(box.high.x > box.low.x && box.high.y > box.low.y && box.high.z > box.low.z)) continue;
    }
    const ClampedMesh cut = clamp_to_box(mesh.positions, mesh.triangles, box);
    cut_meshes += cut.triangles.size() > mesh.triangles.size() ? 1 : 0;
    EXPECT_TRUE(is_closed(cut.positions, cut.triangles));
    ASSERT_EQ(cut.sources.size(), cut.triangles.size());
    for (const glm::dvec3& p : cut.positions) {
      ASSERT_EQ(p, glm::clamp(p, box.low, box.high));
    }
    for (int i = 0; i < 8; ++i) {
      const glm::dvec3 part = 0.5 + 0.45 * glm::dvec3(real(random), real(random), real(random));
      const glm::dvec3 at = box.low + part * (box.high - box.low);
      const double before = winding(mesh.positions, mesh.triangles, at);
      if (std::abs(before - std::round(before)) > 1e-6) continue;  // on the mesh
      EXPECT_NEAR(winding(cut.positions, cut.triangles, at), before, 1e-6);
      ++checked;
    }
  }
  EXPECT_GT(checked, 1000);
  EXPECT_GT(cut_meshes, 100);
}

TEST(Clamp, WhatLiesInTheBoxStaysBitForBit) {
  const TriangleSoup mesh = grown(make_icosphere(1, 2), 1.0 / 3.0);
  const ClampedMesh cut =
      clamp_to_box(mesh.positions, mesh.triangles, {glm::dvec3(-1), glm::dvec3(1)});
  EXPECT_EQ(cut.positions, mesh.positions);
  EXPECT_EQ(cut.triangles, mesh.triangles);
}

// The nearest face of each passes through the box: what lies behind it is inside.
TEST(Clamp, AnySizeIsCutExactly) {
  const Bounds box{glm::dvec3(-10), glm::dvec3(10)};
  for (const double size : {1e3, 1e10, 1e20, 1e100, 1e200, 1e299}) {
    SCOPED_TRACE(size);
    for (const TriangleSoup& mesh :
         {make_box(glm::dvec3(-size, -size, 0.3), glm::dvec3(size)),
          make_box(glm::dvec3(-size / 3, -size, 0.3), glm::dvec3(size))}) {
      const ClampedMesh cut = clamp_to_box(mesh.positions, mesh.triangles, box);
      EXPECT_TRUE(is_closed(cut.positions, cut.triangles));
      for (const glm::dvec3& p : cut.positions) {
        EXPECT_TRUE(p.z == 0.3 || p.z == 10) << p.z;
      }
      EXPECT_NEAR(winding(cut.positions, cut.triangles, {1, 2, 0.31}), 1, 1e-9);
      EXPECT_NEAR(winding(cut.positions, cut.triangles, {1, 2, 0.29}), 0, 1e-9);
    }
    const TriangleSoup ball = grown(make_uv_sphere(1, 30, 15), size);
    const ClampedMesh inside = clamp_to_box(ball.positions, ball.triangles, box);
    EXPECT_TRUE(is_closed(inside.positions, inside.triangles));
    EXPECT_NEAR(winding(inside.positions, inside.triangles, {9, -9, 9}), 1, 1e-6);
    const TriangleSoup beside = grown(make_uv_sphere(1, 30, 15), size, glm::dvec3(2 * size, 0, 0));
    const ClampedMesh outside = clamp_to_box(beside.positions, beside.triangles, box);
    EXPECT_TRUE(is_closed(outside.positions, outside.triangles));
    EXPECT_NEAR(winding(outside.positions, outside.triangles, {9, -9, 9}), 0, 1e-6);
  }
}

TEST(Clamp, OpenMeshesKeepTheirBorder) {
  TriangleSoup mesh = make_box(glm::dvec3(-1e10), glm::dvec3(1e10));
  mesh.triangles.pop_back();
  const ClampedMesh cut =
      clamp_to_box(mesh.positions, mesh.triangles, {glm::dvec3(-1), glm::dvec3(1)});
  EXPECT_FALSE(is_closed(cut.positions, cut.triangles));
}

}  // namespace
}  // namespace strata
