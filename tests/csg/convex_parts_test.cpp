// Which solids count as convex.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "csg/geometry.h"
#include "strata/csg/tree.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"

namespace strata::csg {
namespace {

bool counts_as_convex(const TriangleSoup& mesh) {
  Tree tree;
  tree.set_root(tree.add_solid({.mesh = std::make_shared<const TriangleSoup>(mesh)}));
  return Geometry(tree).parts().front().convex;
}

/// The largest height of a vertex above a face, for closed meshes.
double largest_height(const TriangleSoup& mesh) {
  double largest = -1;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a = mesh.positions[t.x];
    const glm::dvec3 normal =
        glm::normalize(glm::cross(mesh.positions[t.y] - a, mesh.positions[t.z] - a));
    for (const glm::dvec3& p : mesh.positions) {
      largest = std::max(largest, glm::dot(normal, p - a));
    }
  }
  return largest;
}

TEST(ConvexParts, AreThoseWithoutAVertexAboveAFace) {
  std::mt19937 random(1);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution(low, high)(random);
  };
  int convex = 0, concave = 0;
  for (int round = 0; round < 400; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    const int segments = std::uniform_int_distribution(3, 20)(random);
    TriangleSoup mesh;
    switch (round % 4) {
      case 0:
        mesh = make_uv_sphere(1, segments, 2 + segments / 2);
        break;
      case 1:
        mesh = make_icosphere(1, segments % 3);
        break;
      case 2:
        mesh = make_cylinder(1, uniform(0.1, 3), segments);
        break;
      default:
        mesh = make_cone(1, uniform(0.1, 3), segments);
    }
    if (round % 3 != 0) {  // a little further out, or in: by more than rounding
      const std::size_t moved =
          std::uniform_int_distribution<std::size_t>(0, mesh.positions.size() - 1)(random);
      const double by = (round % 3 == 1 ? 1 : -1) * std::exp(uniform(-15, -2));
      mesh.positions[moved] *= 1 + by;
    }
    if (round % 7 == 0) std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
    const double height = largest_height(mesh);
    if (height > 1e-10 && height < 1e-7) continue;  // either
    const bool expected = height <= 1e-10;
    EXPECT_EQ(counts_as_convex(mesh), expected) << "height " << height;
    (expected ? convex : concave) += 1;
  }
  EXPECT_GT(convex, 100);
  EXPECT_GT(concave, 100);
}

TEST(ConvexParts, MayHaveThousandsOfTriangles) {
  TriangleSoup sphere = make_uv_sphere(1, 96, 48);
  EXPECT_TRUE(counts_as_convex(sphere));
  sphere.positions[sphere.positions.size() / 2] *= 1 - 1e-3;
  EXPECT_FALSE(counts_as_convex(sphere));
}

TEST(ConvexParts, AreClosedAndHaveAVolume) {
  TriangleSoup open = make_uv_sphere(1, 12, 6);
  open.triangles.pop_back();
  EXPECT_FALSE(counts_as_convex(open));
  TriangleSoup flat = make_box(glm::dvec3(0), glm::dvec3(1));
  for (glm::dvec3& p : flat.positions) p.z = 0;
  EXPECT_FALSE(counts_as_convex(flat));
  EXPECT_FALSE(counts_as_convex(make_torus(3, 1, 12, 12)));
}

TEST(ConvexParts, AreNotNestedNorSideBySide) {
  TriangleSoup both = make_icosphere(1, 2);
  const auto with = [&](const glm::dvec3& shift, double size) {
    TriangleSoup result = both;
    const auto first = static_cast<std::uint32_t>(both.positions.size());
    for (const glm::dvec3& p : both.positions) result.positions.push_back(size * p + shift);
    for (const glm::uvec3& t : both.triangles) result.triangles.push_back(t + first);
    return result;
  };
  EXPECT_FALSE(counts_as_convex(with({}, 0.5)));
  EXPECT_FALSE(counts_as_convex(with({3, 0, 0}, 1)));
  reverse_orientation(both);
  EXPECT_FALSE(counts_as_convex(both));
}

TEST(ConvexParts, MayHaveVerticesThatNoTriangleNames) {
  for (const double odd : {0.0, 7.0, std::nan(""), HUGE_VAL}) {
    TriangleSoup sphere = make_icosphere(1, 2);
    sphere.positions.emplace_back(odd, odd, -odd);
    EXPECT_TRUE(counts_as_convex(sphere)) << odd;
    sphere.triangles.front().x = static_cast<std::uint32_t>(sphere.positions.size() - 1);
    EXPECT_FALSE(counts_as_convex(sphere)) << odd;
  }
}

}  // namespace
}  // namespace strata::csg
