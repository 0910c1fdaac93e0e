#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "csg/solids/primitives.h"
#include "strata/mesh/diagnose.h"
#include "tests/csg/scene/scene_checks.h"

namespace strata::csg {
namespace {

constexpr double kPi = std::numbers::pi;

using Points = std::vector<glm::dvec3>;

/// Each point of one set is within `tolerance` of one of the other, both ways, and none is twice.
void expect_same_points(const Points& mesh, const Points& wanted, double tolerance) {
  ASSERT_EQ(mesh.size(), wanted.size());
  for (const auto& [some, others] : {std::pair(&mesh, &wanted), std::pair(&wanted, &mesh)}) {
    for (const glm::dvec3& p : *some) {
      int near = 0;
      for (const glm::dvec3& q : *others) near += glm::distance(p, q) <= tolerance;
      EXPECT_EQ(near, 1) << p.x << " " << p.y << " " << p.z;
    }
  }
}

void expect_solid(const TriangleSoup& mesh) {
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_GT(signed_volume(mesh), 0.0);
  const MeshDiagnosis found = diagnose(mesh);
  EXPECT_EQ(found.non_manifold_edges, 0u);
  EXPECT_EQ(found.welded_vertices, found.vertices);
}

/// N of csg_format, section 4, with radians.
int segments_of(double r, double fn, double fa, double fs) {
  if (fn > 0) return std::max(3, static_cast<int>(fn));
  return static_cast<int>(std::ceil(std::max(std::min(360.0 / fa, 2 * kPi * r / fs), 5.0)));
}

TEST(Primitives, CubesHaveTheirEightCorners) {
  for (const bool centre : {false, true}) {
    const glm::dvec3 size(1.5, 20, 0.25), low = centre ? -0.5 * size : glm::dvec3(0);
    Points wanted;
    for (int i = 0; i < 8; ++i)
      wanted.push_back(low + size * glm::dvec3(i & 1, i >> 1 & 1, i >> 2));
    const TriangleSoup mesh = make_cube(size, centre);
    expect_same_points(mesh.positions, wanted, 0.0);
    expect_solid(mesh);
    EXPECT_DOUBLE_EQ(signed_volume(mesh), 7.5);
  }
}

TEST(Primitives, SpheresAreRingsWithoutPoles) {
  for (const auto& [r, fn, fa, fs] :
       {std::array{10.0, 0.0, 12.0, 2.0}, std::array{1.0, 0.0, 12.0, 2.0},
        std::array{5.0, 7.0, 12.0, 2.0}, std::array{3.0, 3.0, 12.0, 2.0},
        std::array{2.0, 30.9, 12.0, 2.0}, std::array{25.0, 0.0, 30.0, 2.0}}) {
    const int n = segments_of(r, fn, fa, fs), rings = (n + 1) / 2;
    Points wanted;
    for (int k = 0; k < rings; ++k) {
      const double theta = kPi * (k + 0.5) / rings;
      for (int i = 0; i < n; ++i) {
        const double phi = 2 * kPi * i / n;
        wanted.emplace_back(r * std::sin(theta) * std::cos(phi),
                            r * std::sin(theta) * std::sin(phi), r * std::cos(theta));
      }
    }
    const TriangleSoup mesh = make_sphere(r, {fn, fa, fs, false});
    expect_same_points(mesh.positions, wanted, 1e-14 * r * 10);
    expect_solid(mesh);
  }
}

TEST(Primitives, CylindersHaveFlatEndsOrTips) {
  for (const auto& [h, r1, r2] : {std::array{5.0, 2.0, 2.0}, std::array{1.0, 0.5, 20.0},
                                  std::array{3.0, 0.0, 4.0}, std::array{3.0, 4.0, 0.0}}) {
    for (const bool centre : {false, true}) {
      for (const double fn : {0.0, 4.0, 9.0}) {
        const int n = segments_of(std::max(r1, r2), fn, 12, 2);
        const double low = centre ? -h / 2 : 0;
        Points wanted;
        for (const auto& [r, z] : {std::pair(r1, low), std::pair(r2, low + h)}) {
          for (int i = 0; i < (r > 0 ? n : 1); ++i) {
            wanted.emplace_back(r * std::cos(2 * kPi * i / n), r * std::sin(2 * kPi * i / n), z);
          }
        }
        const TriangleSoup mesh = make_cylinder(h, r1, r2, centre, {fn, 12, 2, false});
        expect_same_points(mesh.positions, wanted, 1e-13 * 20);
        expect_solid(mesh);
        const double area = n * std::sin(2 * kPi / n) / 2;  // of the unit polygon
        EXPECT_NEAR(signed_volume(mesh), area * h * (r1 * r1 + r1 * r2 + r2 * r2) / 3, 1e-9);
      }
    }
  }
}

TEST(Primitives, CirclesAreExactWhereDegreesAre) {
  const TriangleSoup mesh = make_cylinder(1, 2, 2, false, {12, 12, 2, false});
  const Points& p = mesh.positions;
  EXPECT_EQ(p[0], glm::dvec3(2, 0, 0));
  EXPECT_EQ(p[3], glm::dvec3(0, 2, 0));
  EXPECT_EQ(p[2].x, 1.0);  // 60 degrees
  EXPECT_EQ(p[1].y, 1.0);  // 30
  EXPECT_EQ(p[6], glm::dvec3(-2, 0, 0));
  EXPECT_EQ(p[9], glm::dvec3(0, -2, 0));
}

TEST(Primitives, WhatHasNoSizeIsEmpty) {
  const double inf = INFINITY, nan = NAN;
  for (const double bad : {0.0, -1.0, inf, -inf, nan}) {
    EXPECT_TRUE(make_cube({1, bad, 1}, false).triangles.empty());
    EXPECT_TRUE(make_sphere(bad, {}).triangles.empty());
    EXPECT_TRUE(make_cylinder(bad, 1, 1, false, {}).triangles.empty());
  }
  EXPECT_TRUE(make_cylinder(1, 0, 0, false, {}).triangles.empty());
  EXPECT_TRUE(make_cylinder(1, -1, 2, false, {}).triangles.empty());
  EXPECT_TRUE(make_cylinder(1, 1, nan, false, {}).triangles.empty());
}

TEST(Primitives, StrangeFnNeverMakesStrangeMeshes) {
  for (const double fn : {double{INFINITY}, double{NAN}, -5.0, 0.5, 2.0, 3.9}) {
    const TriangleSoup mesh = make_cylinder(1, 1, 1, false, {fn, 12, 2, false});
    EXPECT_EQ(mesh.positions.size(), fn == -5.0 ? 10u : 6u) << fn;
    expect_solid(mesh);
  }
  EXPECT_EQ(make_cylinder(1, 1, 1, false, {3.1, 12, 2, true}).positions.size(), 8u);
}

TEST(Primitives, ConcaveFacesAreCutInsideThemselves) {
  // A U seen from above, 3 x 3 with a notch of 1 x 2; area 7.
  const Points points = {{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {2, 3, 0},
                         {2, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}};
  for (std::uint32_t first = 0; first < 8; ++first) {
    std::vector<std::uint32_t> face;
    for (std::uint32_t i = 0; i < 8; ++i) face.push_back((first + i) % 8);
    const TriangleSoup mesh = make_faces(points, std::span(&face, 1));
    ASSERT_EQ(mesh.triangles.size(), 6u);
    double area = 0;
    for (const glm::uvec3& t : mesh.triangles) {
      const glm::dvec3 a = points[t.x], b = points[t.y], c = points[t.z];
      const double twice = glm::cross(b - a, c - a).z;
      EXPECT_GT(twice, 0.0);
      area += twice / 2;
      EXPECT_FALSE(std::abs(((a + b + c) / 3.0).x - 1.5) < 0.5 && ((a + b + c) / 3.0).y > 1);
    }
    EXPECT_DOUBLE_EQ(area, 7.0);
  }
}

TEST(Primitives, FacesMayLookAnyWayAndRepeatCorners) {
  // An L-shaped prism whose L faces +x, with a corner named twice.
  const std::string text =
      "polyhedron(points = [[0,0,0],[0,2,0],[0,2,1],[0,1,1],[0,1,2],[0,0,2],"
      "[1,0,0],[1,2,0],[1,2,1],[1,1,1],[1,1,2],[1,0,2]], faces = [[0,1,2,3,4,5],"
      "[11,10,9,8,8,7,6],[0,6,7,1],[1,7,8,2],[2,8,9,3],[3,9,10,4],[4,10,11,5],[5,11,6,0]]);";
  const Scene scene = scene_of(text);
  EXPECT_EQ(codes_of(scene), "");
  EXPECT_NEAR(volume_of(scene), 3.0, 1e-9);
  EXPECT_TRUE(is_closed(*scene.tree.solids()[0].mesh));
}

TEST(Primitives, FacesThatAreNotFlatAreCutAsInOpenScadWhereverTheyBegin) {
  // A block of 6 x 6 whose top rises by 3 at two opposite corners: OpenSCAD joins these two, since
  // both ways are equally long, and the mean height is 9 + (3 + 3 + 0) / 3. Turned by a quarter,
  // the others are joined.
  const auto block = [](const char* top, int first, int second) {
    return volume_of(scene_of(
        fmt::format("polyhedron(points = "
                    "[[0,0,0],[6,0,0],[6,6,0],[0,6,0],[0,0,{0}],[6,0,{1}],[6,6,{0}],[0,6,{1}]], "
                    "faces = [[0,1,2,3],{2},[0,4,5,1],[1,5,6,2],[2,6,7,3],[3,7,4,0]]);",
                    first, second, top)));
  };
  for (const char* top : {"[7,6,5,4]", "[6,5,4,7]", "[5,4,7,6]", "[4,7,6,5]"}) {
    EXPECT_NEAR(block(top, 9, 12), 36 * 11.0, 1e-9) << top;
    EXPECT_NEAR(block(top, 12, 9), 36 * 10.0, 1e-9) << top;
  }
  // A hexagonal prism turned by 20 degrees from bottom to top: the shorter cuts bulge.
  std::string points, faces = "[0,1,2,3,4,5],[11,10,9,8,7,6]";
  double volume = 0;
  std::vector<glm::dvec3> p;
  for (int i = 0; i < 12; ++i) {
    const double angle = (60.0 * (i % 6) + (i < 6 ? 0 : 20)) * 0.017453292519943295;
    p.emplace_back(8 * std::cos(angle), 8 * std::sin(angle), i < 6 ? 0 : 12);
    points += fmt::format("{}[{},{},{}]", i == 0 ? "" : ",", p.back().x, p.back().y, p.back().z);
  }
  for (int i = 0; i < 6; ++i) {
    const int j = (i + 1) % 6;
    faces += fmt::format(",[{},{},{},{}]", i, i + 6, j + 6, j);
    // Cones from the middle of the bottom: over the two triangles of each side.
    const auto cone = [&](int a, int b, int c) {
      const auto n = static_cast<std::size_t>(a);
      return glm::dot(p[n],
                      glm::cross(p[static_cast<std::size_t>(b)], p[static_cast<std::size_t>(c)])) /
             6;
    };
    volume += cone(i, j, i + 6) + cone(j, j + 6, i + 6);
  }
  volume += 12 * 6 * 0.5 * 64 * std::sin(1.0471975511965976) / 3;  // and over the top
  const Scene twisted =
      scene_of(fmt::format("polyhedron(points = [{}], faces = [{}]);", points, faces));
  EXPECT_NEAR(volume_of(twisted), volume, 1e-3);
  EXPECT_GT(volume, 2086.0);  // 12 * 6 * 16 * sqrt(3) = 1995 without the bulges
  ASSERT_EQ(codes_of(twisted), "non-planar ");
  EXPECT_NE(twisted.warnings[0].message.find("face 2 of the polyhedron is not flat"),
            std::string::npos);
  EXPECT_NE(twisted.warnings[0].message.find("(6 in all)"), std::string::npos);
}

TEST(Primitives, PolyhedraInsideOutAreTurnedAndOpenOnesReported) {
  const std::string points = "polyhedron(points = [[0,0,0],[1,0,0],[0,1,0],[0,0,1]], faces = ";
  const Scene right = scene_of(points + "[[0,1,2],[0,3,1],[0,2,3],[1,3,2]]);");
  EXPECT_EQ(codes_of(right), "");
  EXPECT_NEAR(volume_of(right), 1.0 / 6, 1e-12);
  const Scene turned = scene_of(points + "[[2,1,0],[1,3,0],[3,2,0],[2,3,1]]);");
  EXPECT_EQ(codes_of(turned), "geometry ");
  EXPECT_NEAR(volume_of(turned), 1.0 / 6, 1e-12);
  const Scene mixed = scene_of(points + "[[2,1,0],[0,3,1],[0,2,3],[1,3,2]]);");
  ASSERT_EQ(codes_of(mixed), "geometry ");
  EXPECT_EQ(mixed.tree.solids()[0].rule, InsideRule::kWinding);
  EXPECT_NEAR(volume_of(mixed), 1.0 / 6, 1e-12);
  EXPECT_NE(mixed.warnings[0].message.find("1 triangle faced against"), std::string::npos)
      << mixed.warnings[0].message;
  // Two of them, one inside out.
  const std::string two =
      "polyhedron(points = [[0,0,0],[1,0,0],[0,1,0],[0,0,1],[5,0,0],[6,0,0],[5,1,0],[5,0,1]], "
      "faces = [[0,1,2],[0,3,1],[0,2,3],[1,3,2],[6,5,4],[5,7,4],[7,6,4],[6,7,5]]);";
  const Scene one_turned = scene_of(two);
  ASSERT_EQ(codes_of(one_turned), "geometry ");
  EXPECT_NEAR(volume_of(one_turned), 2.0 / 6, 1e-12);
  EXPECT_NE(one_turned.warnings[0].message.find("1 of 2 parts were inside out and were reversed"),
            std::string::npos)
      << one_turned.warnings[0].message;
  const Scene open = scene_of(points + "[[0,1,2],[0,3,1],[0,2,3]]);");
  ASSERT_EQ(codes_of(open), "geometry ");
  EXPECT_EQ(open.tree.solids()[0].rule, InsideRule::kParity);
  EXPECT_NE(open.warnings[0].message.find("3 border a hole"), std::string::npos);
}

}  // namespace
}  // namespace strata::csg
