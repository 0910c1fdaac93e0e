#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>
#include <string>
#include <utility>

#include "strata/mesh/shapes.h"
#include "tests/csg/scene/scene_checks.h"

namespace strata::csg {
namespace {

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
  EXPECT_EQ(
      scene.warnings[0].message,
      "test.csg:1:1: 'resize': newsize is [nan, 4, 0], not finite numbers; axes without a finite "
      "number keep their size");
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
  EXPECT_EQ(mesh.error().message, "2400 triangles and 1140 planes are too many to be cut");
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
