#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <initializer_list>
#include <map>
#include <random>
#include <string>
#include <utility>

#include "csg/scene/hull.h"
#include "mesh/diagnose.h"
#include "mesh/shapes.h"
#include "tests/csg/scene_checks.h"

namespace strata::csg {
namespace {

std::string moved(double x, double y, double z) {
  return fmt::format("multmatrix([[1,0,0,{}],[0,1,0,{}],[0,0,1,{}],[0,0,0,1]]) ", x, y, z);
}

/// A cube with its corner at the origin, cut out of a larger one.
const std::string kFrame = "difference() { cube([10,10,10], true); cube([6,6,6], true); }";

// --- hull
// -----------------------------------------------------------------------------------------

TEST(Hull, OfRandomPointsHoldsThemAllAndNothingMore) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-3, 3);
  for (int round = 0; round < 50; ++round) {
    std::vector<glm::dvec3> points;
    const glm::dvec3 far = round % 2 ? glm::dvec3(1e5, -2e5, 3e4) : glm::dvec3(0);
    for (int i = 0; i < 5 + 4 * round; ++i) {
      points.push_back(far + glm::dvec3(number(random), number(random), number(random)));
    }
    const auto hull = convex_hull(points);
    ASSERT_TRUE(hull.has_value()) << hull.error().message;
    EXPECT_TRUE(is_closed(*hull));
    EXPECT_GT(signed_volume(*hull), 0.0);
    for (const glm::uvec3& t : hull->triangles) {
      const glm::dvec3 a = hull->positions[t.x];
      const glm::dvec3 normal =
          glm::normalize(glm::cross(hull->positions[t.y] - a, hull->positions[t.z] - a));
      for (const glm::dvec3& p : points) EXPECT_LE(glm::dot(p - a, normal), 1e-9) << round;
    }
    for (const glm::dvec3& v : hull->positions) {
      EXPECT_NE(std::find(points.begin(), points.end(), v), points.end());
    }
  }
}

TEST(Hull, OfGridsAndSpheresIsClosed) {
  std::vector<glm::dvec3> grid;
  for (int i = 0; i < 1000; ++i) grid.emplace_back(i % 10, i / 10 % 10, i / 100);
  const auto cube = convex_hull(grid);
  ASSERT_TRUE(cube.has_value());
  EXPECT_EQ(cube->positions.size(), 8u);
  EXPECT_TRUE(is_closed(*cube));
  EXPECT_DOUBLE_EQ(signed_volume(*cube), 729.0);
  const TriangleSoup sphere = make_uv_sphere(5, 64, 32);  // quads, coplanar to rounding
  const auto hull = convex_hull(sphere.positions);
  ASSERT_TRUE(hull.has_value());
  EXPECT_TRUE(is_closed(*hull));
  EXPECT_NEAR(signed_volume(*hull), signed_volume(sphere), 1e-9);
}

TEST(Hull, OfFlatPointsIsAnError) {
  std::vector<glm::dvec3> points;
  for (int i = 0; i < 20; ++i) points.emplace_back(i, i * i, 3);
  for (const std::size_t count : {0u, 1u, 3u, 20u}) {
    const auto hull = convex_hull(std::span(points).first(count));
    ASSERT_FALSE(hull.has_value());
    EXPECT_EQ(hull.error().code, ErrorCode::kGeometry);
  }
}

TEST(Hull, OfUnionsIsTheHullOfAllLeaves) {
  const Scene scene =
      scene_of("hull() { cube([1,1,1]); group() { " + moved(9, 0, 0) + "cube([1,1,1]); } }");
  ASSERT_EQ(scene.tree.solids().size(), 1u);
  EXPECT_NEAR(volume_of(scene), 10.0, 1e-9);
  EXPECT_EQ(codes_of(scene), "");
}

TEST(Hull, OfDifferencesIsTheHullOfWhatIsLeft) {
  // A cube without its upper half, and a corner cut at points that no operand has.
  EXPECT_NEAR(
      volume_of("hull() difference() { cube([2,2,2]); " + moved(-1, -1, 1) + "cube([9,9,9]); }"),
      4.0, 1e-6);
  EXPECT_NEAR(
      volume_of("hull() intersection() { cube([2,2,2]); " + moved(1, 1, 1) + "cube([9,9,9]); }"),
      1.0, 1e-6);
  const double tip = volume_of("hull() difference() { cylinder($fn=4,h=4,r1=2,r2=0); " +
                               moved(-5, -5, -1) + "cube([10,10,3]); }");
  EXPECT_NEAR(tip, 2.0 * 1 * 1 * 2 / 3, 1e-6);  // the upper half of the pyramid
  EXPECT_NEAR(volume_of("hull() { " + kFrame + "}"), 1000.0, 1e-5);
}

TEST(Hull, TakesFlattenedSolidsAndDropsFlatResults) {
  const std::string flat = "multmatrix([[1,0,0,0],[0,1,0,0],[0,0,0,0],[0,0,0,1]]) ";
  EXPECT_NEAR(volume_of("hull() { " + flat + "cube([2,2,2]); " + moved(0, 0, 3) + flat +
                        "cube([2,2,2]); }"),
              12.0, 1e-9);
  const Scene nothing = scene_of("hull() { " + flat + "cube(); }");
  EXPECT_EQ(codes_of(nothing), "geometry ");
  EXPECT_TRUE(nothing.tree.solids().empty());
}

TEST(Hull, OfFlatThingsIsFlat) {
  EXPECT_NEAR(volume_of("hull() { square(1); " + moved(4, 0, 5) + "square(1); }"), 5.0, 1e-6);
}

// --- minkowski
// ------------------------------------------------------------------------------------

TEST(Minkowski, OfBoxesIsABox) {
  const Scene scene =
      scene_of("minkowski() { cube([1,2,3]); " + moved(5, 0, 0) + "cube([4,4,4]); }");
  ASSERT_EQ(scene.tree.solids().size(), 1u);
  EXPECT_NEAR(volume_of(scene), 5.0 * 6 * 7, 1e-9);
  expect_box(box_of(scene), {5, 0, 0}, {10, 6, 7});
  EXPECT_EQ(scene.tree.solids()[0].mesh->triangles.size(), 12u);
}

TEST(Minkowski, OfThreeOrOneOrEmptyOperands) {
  EXPECT_NEAR(volume_of("minkowski() { cube([1,1,1]); cube([2,2,2]); cube([3,3,3]); }"), 216.0,
              1e-9);
  EXPECT_NEAR(volume_of("minkowski() { cube([2,1,1]); }"), 2.0, 1e-9);
  EXPECT_NEAR(volume_of("minkowski() { group(); cube([2,1,1]); difference(); }"), 2.0, 1e-9);
  EXPECT_TRUE(scene_of("minkowski() { group(); }").tree.solids().empty());
}

TEST(Minkowski, OfRoundAndSharpAddsWhatSteinerSays) {
  // V(K + rB) for a box and the polyhedral ball: the hull of sums, against qhull on its own sums.
  const Scene scene = scene_of("minkowski() { cube([10,20,30]); sphere($fn = 24, r = 1); }");
  const Scene ball = scene_of("sphere($fn = 24, r = 1);");
  std::vector<glm::dvec3> sums;
  for (const glm::dvec3& p : ball.tree.solids()[0].mesh->positions) {
    for (int i = 0; i < 8; ++i) {
      sums.push_back(p + glm::dvec3(i & 1 ? 10 : 0, i & 2 ? 20 : 0, i & 4 ? 30 : 0));
    }
  }
  EXPECT_NEAR(volume_of(scene), signed_volume(*convex_hull(sums)), 1e-6);
  EXPECT_GT(volume_of(scene), 6000 + 2 * (200 + 300 + 600) * 0.98);
}

TEST(Minkowski, OfAFrameKeepsItsHole) {
  const Scene scene = scene_of("minkowski() { " + kFrame + " cube([2,2,2], true); }");
  EXPECT_EQ(codes_of(scene), "");
  EXPECT_NEAR(volume_of(scene), 12.0 * 12 * 12 - 4 * 4 * 4, 1e-4);
  expect_box(box_of(scene), {-6, -6, -6}, {6, 6, 6}, 1e-6);
}

TEST(Minkowski, ClosesAHoleThatIsSmall) {
  EXPECT_NEAR(volume_of("minkowski() { " + kFrame + " cube([7,7,7], true); }"), 17.0 * 17 * 17,
              1e-3);
}

TEST(Minkowski, OfAnImportedConcaveSolidIsExact) {
  // An L of two boxes, as one polyhedron: (L + box) is the union of two boxes.
  const std::string prism =
      "polyhedron(points = [[0,0,0],[4,0,0],[4,1,0],[1,1,0],[1,4,0],[0,4,0],[0,0,1],[4,0,1],"
      "[4,1,1],[1,1,1],[1,4,1],[0,4,1]], faces = [[0,1,2,3,4,5],[11,10,9,8,7,6],[0,6,7,1],"
      "[1,7,8,2],[2,8,9,3],[3,9,10,4],[4,10,11,5],[5,11,6,0]]);";
  EXPECT_NEAR(volume_of(prism), 7.0, 1e-9);
  EXPECT_NEAR(volume_of("minkowski() { " + prism + " cube([1,1,1]); }"), 2.0 * (5 * 2 + 5 * 2 - 4),
              1e-4);
  EXPECT_NEAR(volume_of("minkowski() { cube([1,1,1]); " + prism + " }"), 2.0 * (5 * 2 + 5 * 2 - 4),
              1e-4);
}

TEST(Minkowski, OfTwoConcaveOperandsIsExact) {
  // Two frames in the plane, one unit high: a hole of 8 and bars of 1; a hole of 1 and bars of 1.
  const std::string big = "difference() { cube([10,10,1], true); cube([8,8,3], true); }";
  const std::string small = "difference() { cube([3,3,1], true); cube([1,1,3], true); }";
  EXPECT_NEAR(volume_of("minkowski() { " + big + small + " }"), 2.0 * (13 * 13 - 5 * 5), 1e-3);
}

TEST(Minkowski, OfSeparatePiecesTakesEach) {
  const std::string pair = "cube([1,1,1]); " + moved(10, 0, 0) + "cube([1,1,1]);";
  EXPECT_NEAR(volume_of("minkowski() { group() { " + pair + " } cube([1,1,1]); }"), 16.0, 1e-6);
  const std::string far = "difference() { cube([11,1,1]); " + moved(1, -1, -1) + "cube([9,3,3]); }";
  EXPECT_NEAR(volume_of("minkowski() { " + far + far + " }"), 8.0 * 3, 1e-3);
}

/// Whether every edge has two faces, vertices being the same where their positions are.
bool is_manifold(const TriangleSoup& mesh) {
  using Point = std::array<double, 3>;
  std::map<std::pair<Point, Point>, int> faces;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      const glm::dvec3 p = mesh.positions[t[i]], q = mesh.positions[t[(i + 1) % 3]];
      ++faces[std::minmax(Point{p.x, p.y, p.z}, Point{q.x, q.y, q.z})];
    }
  }
  return std::all_of(faces.begin(), faces.end(), [](const auto& edge) { return edge.second == 2; });
}

TEST(Minkowski, OfConcaveOperandsIsAUnionOfClosedSolids) {
  for (const std::string& text :
       std::initializer_list<std::string>{"minkowski() { difference() { cube([6,6,6]); "
                                          "cube([2,2,20],center=true); } cube([1,1,1]); }",
                                          "minkowski() { difference() { cube(6); " +
                                              moved(2, 2, 2) + "cube(6); } sphere(r=1,$fn=6); }"}) {
    const Scene scene = scene_of(text);
    EXPECT_GT(scene.tree.solids().size(), 2u);
    for (const Solid& solid : scene.tree.solids()) {
      EXPECT_TRUE(is_manifold(*solid.mesh)) << solid.mesh->triangles.size();
    }
  }
  // As OpenSCAD has it.
  EXPECT_NEAR(volume_of("minkowski() { difference() { cube(6); " + moved(2, 2, 2) +
                        "cube(6); } sphere(r=1,$fn=6); }"),
              393.5425, 1e-3);
}

TEST(Minkowski, ResultsAreMovedAndColouredAsWhole) {
  const Scene scene = scene_of("color([1,0,0]) " + moved(100, 0, 0) + "minkowski() { " + kFrame +
                               " color([0,0,1]) cube([2,2,2], true); }");
  for (const Solid& solid : scene.tree.solids()) {
    EXPECT_EQ(solid.colour, glm::vec4(1, 0, 0, 1));
    EXPECT_EQ(solid.name.substr(0, 9), "minkowski");
  }
  expect_box(box_of(scene), {94, -6, -6}, {106, 6, 6}, 1e-6);
}

TEST(Minkowski, ThatWouldTakeTooLongIsNamed) {
  const std::string many = "difference() { sphere($fn=90, r=5); cube([1,1,99], true); }";
  const Scene scene = scene_of("minkowski() { " + many + many + " }");
  EXPECT_EQ(codes_of(scene), "not-done ");
  EXPECT_NE(scene.warnings[0].message.find("convex hulls"), std::string::npos);
  EXPECT_FALSE(scene.tree.solids().empty());
}

// --- resize
// ---------------------------------------------------------------------------------------

TEST(Resize, ScalesGivenAxesAndFollowsTheLargest) {
  const auto box = [](const std::string& arguments) {
    return box_of(scene_of("resize(" + arguments + ") " + moved(1, 1, 1) + "cube([2,4,8]);"));
  };
  expect_box(box("newsize = [4,0,0]"), {2, 1, 1}, {6, 5, 9});
  expect_box(box("newsize = [4,0,0], auto = [0,1,0]"), {2, 2, 1}, {6, 10, 9});
  expect_box(box("newsize = [4,0,0], auto = [1,1,1]"), {2, 2, 2}, {6, 10, 18});
  expect_box(box("newsize = [4,4,0], auto = [0,0,1]"), {2, 1, 2}, {6, 5, 18});
  expect_box(box("newsize = [0,0,0], auto = [1,1,1]"), {1, 1, 1}, {3, 5, 9});
  expect_box(box("newsize = [4,0,0], auto = true"), {2, 2, 2}, {6, 10, 18});
}

/// As OpenSCAD 2021.01: less than 0 is as 0, and does not mirror.
TEST(Resize, KeepsWhereNoSizeIsGiven) {
  const auto box = [](const std::string& arguments) {
    return box_of(scene_of("resize(" + arguments + ") cube([1,2,3]);"));
  };
  expect_box(box("[-5,0,0]"), {0, 0, 0}, {1, 2, 3});
  expect_box(box("[-5,4,0], true"), {0, 0, 0}, {2, 4, 6});
  expect_box(box("[0,-4,0], true"), {0, 0, 0}, {1, 2, 3});
  expect_box(box_of(scene_of("resize([-5,4],true) square([1,2]);")), {0, 0, -0.5}, {2, 4, 0.5},
             1e-6);
  const Scene scene = scene_of("resize([nan,4,0]) cube([1,2,3]);");
  expect_box(box_of(scene), {0, 0, 0}, {1, 4, 3});
  ASSERT_EQ(codes_of(scene), "geometry ");
  EXPECT_EQ(scene.warnings[0].message,
            "test.csg:1:1: 'resize': newsize is [nan, 4, 0], not finite numbers; the size is kept "
            "where it is none");
}

TEST(Resize, MeasuresWhatIsLeftOfADifference) {
  const Scene scene = scene_of("resize([10,10,10]) difference() { cube([4,2,2]); " +
                               moved(2, -1, -1) + "cube([9,9,9]); }");
  expect_box(box_of(scene), {0, 0, 0}, {10, 10, 10}, 1e-6);
}

TEST(Resize, OfFlatThingsIsFlat) {
  EXPECT_NEAR(volume_of("resize([6,0,0], auto = [0,1,0]) square([2,1]);"), 18.0, 1e-5);
}

// --- projection
// -----------------------------------------------------------------------------------

TEST(Projection, ShadowsAndSectionsHaveTheirAreas) {
  const std::string hollow = moved(1, 2, 1) + "{ " + kFrame + "}";
  EXPECT_NEAR(volume_of("projection() { " + hollow + " }"), 100.0, 1e-5);
  EXPECT_NEAR(volume_of("projection(cut = true) { " + hollow + " }"), 64.0, 1e-5);
  EXPECT_NEAR(volume_of("projection(cut = true) " + moved(0, 0, 4.5) + "{ " + kFrame + "}"), 100.0,
              1e-5);
  EXPECT_TRUE(scene_of("projection(cut = true) " + moved(0, 0, 9) + "{ " + kFrame + "}")
                  .tree.solids()
                  .empty());
}

TEST(Projection, OfADifferenceShowsItsHoles) {
  const std::string plate =
      "difference() { cube([10,10,2]); " + moved(3, 3, -1) + "cube([2,2,9]); }";
  EXPECT_NEAR(volume_of("projection() { " + plate + " }"), 96.0, 1e-5);
  // A pit does not go through.
  EXPECT_NEAR(volume_of("projection() difference() { cube([10,10,2]); " + moved(3, 3, 1) +
                        "cube([2,2,9]); }"),
              100.0, 1e-5);
}

TEST(Projection, SectionsIncludeFacesInThePlane) {
  EXPECT_NEAR(volume_of("projection(cut = true) cube([3,3,1]);"), 9.0, 1e-5);
  EXPECT_NEAR(volume_of("projection(cut = true) " + moved(0, 0, -1) + "cube([3,3,1]);"), 9.0, 1e-5);
}

TEST(Projection, TurnedSolidsAreCutInTheTurnedPlace) {
  const Scene scene = scene_of(
      "projection(cut = true) multmatrix([[0,0,1,0],[0,1,0,0],[-1,0,0,0],"
      "[0,0,0,1]]) cube([2,3,4], true);");
  expect_box(box_of(scene), {-2, -1.5, -0.5}, {2, 1.5, 0.5}, 1e-6);
}

// --- the boundary of Boolean trees
// ------------------------------------------------------------------

TEST(Boundary, VolumesObeyInclusionAndExclusion) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int round = 0; round < 20; ++round) {
    Tree tree;
    std::vector<Solid> solids;
    for (int i = 0; i < 2; ++i) {
      Solid solid;
      solid.mesh = std::make_shared<TriangleSoup>(i == round % 2 ? make_uv_sphere(1, 9, 5)
                                                                 : make_torus(1, 0.4, 9, 6));
      glm::dmat4 m(1.0);
      for (int c = 0; c < 4; ++c) {
        for (int r = 0; r < 3; ++r) m[c][r] += 0.3 * number(random);
      }
      solid.world_from_mesh = m;
      solids.push_back(solid);
    }
    const auto volume = [&](Operation operation) {
      const Tree::NodeId a = tree.add_solid(solids[0]), b = tree.add_solid(solids[1]);
      return signed_volume(result_of(tree, tree.add(operation, {a, b})));
    };
    double alone[2];
    for (std::size_t i = 0; i < 2; ++i) alone[i] = signed_volume(world_mesh(solids[i]));
    const double both = volume(Operation::kIntersection);
    EXPECT_GT(both, 0.0);
    EXPECT_NEAR(volume(Operation::kUnion), alone[0] + alone[1] - both, 1e-6) << round;
    EXPECT_NEAR(volume(Operation::kDifference), alone[0] - both, 1e-6) << round;
  }
}

TEST(Boundary, CoincidentFacesLeaveNothingBetween) {
  EXPECT_NEAR(volume_of("cube(); " + moved(1, 0, 0) + "cube();"), 2.0, 1e-9);
  const TriangleSoup none = result_of(
      [] {
        const Scene scene = scene_of("difference() { cube([2,2,2]); cube([2,2,2]); }");
        return scene.tree;
      }(),
      2);
  EXPECT_TRUE(none.triangles.empty());
  EXPECT_NEAR(volume_of("difference() { cube([3,3,3]); cube([3,3,1]); " + moved(0, 0, 2) +
                        "cube([3,1,1]); }"),
              15.0, 1e-9);
}

TEST(Boundary, TooMuchWorkIsALimit) {
  Tree tree;
  Solid solid;
  solid.mesh = std::make_shared<TriangleSoup>(make_torus(2, 1, 30, 20));
  const Tree::NodeId a = tree.add_solid(solid);
  solid.world_from_mesh[3].x = 0.5;
  const Tree::NodeId difference = tree.add(Operation::kDifference, {a, tree.add_solid(solid)});
  EXPECT_TRUE(boundary(tree, difference).has_value());
  const auto mesh = boundary(tree, difference, {}, 1000);
  ASSERT_FALSE(mesh.has_value());
  EXPECT_EQ(mesh.error().code, ErrorCode::kLimit);
  EXPECT_EQ(mesh.error().message, "2400 triangles would have to be cut by 1140 planes");
}

// --- extrusions and other nodes: that arguments reach them
// --------------------------------------------

TEST(Extrude, ArgumentsOfBothDialectsAreRead) {
  expect_box(
      box_of(scene_of("linear_extrude(height = 5, center = true, convexity = 1, scale = [1, 1]) "
                      "square([2,3]);")),
      {0, 0, -2.5}, {2, 3, 2.5}, 1e-6);
  EXPECT_NEAR(
      volume_of("linear_extrude(height = 6, center = false, scale = [0, 0]) square([2,3], true);"),
      12.0, 1e-5);
  expect_box(box_of(scene_of("linear_extrude(height = 5, v = [0.6, 0, 0.8]) square([2,3]);")),
             {0, 0, 0}, {5, 3, 4}, 1e-6);
  EXPECT_NEAR(
      volume_of("rotate_extrude(angle = 360, $fn = 4) " + moved(1, 0, 0) + "square([1,1]);"),
      2.0 * 4 - 2.0, 1e-5);
}

TEST(Extrude, OfSolidsOrTwoOfTheAxisIsReported) {
  EXPECT_EQ(codes_of(scene_of("linear_extrude(height = 1) cube();")), "ignored ");
  EXPECT_EQ(codes_of(scene_of("projection() square();")), "ignored ");
  EXPECT_EQ(codes_of(scene_of("rotate_extrude() square([2,2], true);")), "geometry ");
}

TEST(Flat, OffsetFillAndMinkowskiAreDone) {
  EXPECT_NEAR(volume_of("offset(delta = 1, chamfer = false) square([2,2]);"), 16.0, 1e-5);
  EXPECT_NEAR(volume_of("fill() difference() { square([4,4], true); square([2,2], true); }"), 16.0,
              1e-5);
  EXPECT_NEAR(volume_of("minkowski() { square([4,4]); square([1,2]); }"), 30.0, 1e-5);
  const double round = volume_of("offset(r = 1, $fn = 200) square([2,2]);");
  EXPECT_NEAR(round, 12 + 3.14159, 0.01);
}

}  // namespace
}  // namespace strata::csg
