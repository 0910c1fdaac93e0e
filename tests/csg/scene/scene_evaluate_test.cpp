#include <cmath>
#include <glm/matrix.hpp>
#include <stop_token>
#include <string>

#include "tests/csg/scene/scene_checks.h"

namespace strata::csg {
namespace {

std::string scaled(double x, double y, double z) {
  return fmt::format("multmatrix([[{},0,0,0],[0,{},0,0],[0,0,{},0],[0,0,0,1]]) ", x, y, z);
}

TEST(Evaluate, SetOperationsHaveTheirVolumes) {
  const std::string two = "cube([2,2,2]); " + moved(1, 1, 1) + "cube([2,2,2]);";
  EXPECT_NEAR(volume_of(two), 15.0, 1e-9);
  EXPECT_NEAR(volume_of("union() {" + two + "}"), 15.0, 1e-9);
  EXPECT_NEAR(volume_of("group() {" + two + "}"), 15.0, 1e-9);
  EXPECT_NEAR(volume_of("difference() {" + two + "}"), 7.0, 1e-9);
  EXPECT_NEAR(volume_of("intersection() {" + two + "}"), 1.0, 1e-9);
  // Groups are one operand: child 0 is both cubes.
  EXPECT_NEAR(volume_of("difference() { group() {" + two + "} cube([1,1,1]); }"), 14.0, 1e-9);
  EXPECT_NEAR(volume_of("intersection() { group() {" + two + "} cube([1,1,1]); }"), 1.0, 1e-9);
}

TEST(Evaluate, TreesHoldNoMoreNodesThanTheyNeed) {
  const Scene one = scene_of("group() { union() { color([1,0,0]) group() { cube(); } } }");
  EXPECT_EQ(one.tree.nodes().size(), 1u);
  EXPECT_EQ(one.tree.nodes()[one.tree.root()].operation, Operation::kSolid);
  const Scene flat = scene_of("group() { cube(); group() { cube(); group() { cube(); } } }");
  EXPECT_EQ(flat.tree.nodes().size(), 4u);
  EXPECT_EQ(flat.tree.operands(flat.tree.root()).size(), 3u);
}

TEST(Evaluate, EmptyOperandsFollowSetAlgebra) {
  const auto count = [](std::string_view text) {
    const Scene scene = scene_of(text);
    EXPECT_EQ(codes_of(scene), "") << text;
    return scene.tree.solids().size();
  };
  EXPECT_EQ(count(""), 0u);
  EXPECT_EQ(count("difference() { group(); cube(); }"), 0u);
  EXPECT_EQ(count("difference() { cube([0,1,1]); cube(); }"), 0u);
  EXPECT_EQ(count("difference() { cube(); group(); sphere(r = 0); }"), 1u);
  EXPECT_EQ(count("intersection() { cube(); group(); }"), 0u);
  EXPECT_EQ(count("intersection() { group(); cube(); }"), 0u);
  EXPECT_EQ(count("union() { group(); cube(); }"), 1u);
  EXPECT_EQ(count("difference(); intersection(); union(); hull(); minkowski();"), 0u);
  // `%` children are gone before the first child is chosen.
  EXPECT_EQ(scene_of("difference() { %cube(); sphere(r = 1); }").tree.root() != Tree::kNone, true);
  EXPECT_NEAR(volume_of("difference() { %sphere(r=9); cube([2,2,2]); cube(); }"), 7.0, 1e-9);
  EXPECT_NEAR(volume_of("intersection() { cube(); *group(); %cube(); }"), 1.0, 1e-9);
}

TEST(Evaluate, EmptyScenesHaveAnEmptyRoot) {
  const Scene scene = scene_of("");
  ASSERT_NE(scene.tree.root(), Tree::kNone);
  EXPECT_TRUE(scene.tree.operands(scene.tree.root()).empty());
  EXPECT_TRUE(bounds(scene.tree, scene.tree.root()).empty());
}

TEST(Evaluate, TransformsMultiplyFromTheOutside) {
  const Scene scene =
      scene_of(moved(10, 0, 0) + "{" + scaled(2, 3, 4) + "{" + moved(1, 1, 1) + "cube(); } }");
  expect_box(box_of(scene), {12, 3, 4}, {14, 6, 8});
  // A quarter turn about z: x goes to y.
  expect_box(
      box_of(scene_of("multmatrix([[0,-1,0,0],[1,0,0,0],[0,0,1,0],[0,0,0,1]]) cube([5,1,1]);")),
      {-1, 0, 0}, {0, 5, 1});
  // Missing rows and numbers are the identity's; w scales.
  expect_box(box_of(scene_of("multmatrix([[1,0,0,7]]) cube();")), {7, 0, 0}, {8, 1, 1});
  expect_box(box_of(scene_of("multmatrix([[2,0,0,4],[0,2,0,0],[0,0,2,0],[0,0,0,2]]) cube();")),
             {2, 0, 0}, {3, 1, 1});
}

TEST(Evaluate, MirroredSolidsKeepTheirVolume) {
  const std::string scene = scaled(-1, 1, 1) +
                            "polyhedron(points = [[0,0,0],[1,0,0],[0,1,0],"
                            "[0,0,1]], faces = [[0,1,2],[0,3,1],[0,2,3],[1,3,2]]);";
  EXPECT_NEAR(volume_of(scene), 1.0 / 6, 1e-12);
  expect_box(box_of(scene_of(scene)), {-1, 0, 0}, {0, 1, 1});
  EXPECT_LT(glm::determinant(glm::dmat3(scene_of(scene).tree.solids()[0].world_from_mesh)), 0.0);
}

TEST(Evaluate, MatricesThatFlattenOrAreNotFiniteLeaveNothing) {
  const Scene flattened = scene_of(scaled(1, 0, 1) + "cube(); " + moved(3, 0, 0) + "cube();");
  EXPECT_EQ(codes_of(flattened), "geometry ");
  EXPECT_EQ(flattened.tree.solids().size(), 1u);
  const Scene broken = scene_of("multmatrix([[nan,0,0,0],[0,inf,0,0]]) { cube(); sphere(); }");
  EXPECT_EQ(codes_of(broken), "geometry ");
  EXPECT_EQ(broken.tree.solids().size(), 0u);
  EXPECT_TRUE(broken.warnings[0].message.starts_with("test.csg:1:1: "));
  // What stands under it is taken as empty by the node around.
  EXPECT_EQ(scene_of("intersection() { cube(); multmatrix([[nan]]) cube(); }").tree.solids().size(),
            0u);
}

TEST(Evaluate, TheOutermostColourThatIsSetWins) {
  const auto colour = [](std::string_view text) {
    const Scene scene = scene_of(text);
    EXPECT_EQ(scene.tree.solids().size(), 1u);
    return scene.tree.solids()[0].colour;
  };
  const glm::vec4 red(1, 0, 0, 1), blue(0, 0, 1, 1);
  EXPECT_EQ(colour("cube();"), std::nullopt);
  EXPECT_EQ(colour("color([1,0,0,1]) cube();"), red);
  EXPECT_EQ(colour("color([1,0,0]) color([0,0,1]) cube();"), red);
  EXPECT_EQ(colour("color([-1,-1,-1,1]) color([0,0,1]) cube();"), blue);
  EXPECT_EQ(colour("color([-1,0,0,1]) cube();"), std::nullopt);
  EXPECT_EQ(colour("color([0,0,1,0.25]) cube();"), glm::vec4(0, 0, 1, 0.25f));
  EXPECT_EQ(colour("color([0,0,7,2]) cube();"), blue);
  // An alpha alone leaves the scheme's colour, or that of a colour inside.
  const glm::vec4 half(kSchemeColour, 0.5f);
  EXPECT_EQ(colour("color([-1,-1,-1,0.5]) cube();"), half);
  EXPECT_EQ(colour("color([-1,-1,-1,0.5]) color([0,0,1]) cube();"), blue);
  EXPECT_EQ(colour("color([0,0,1]) color([-1,-1,-1,0.5]) cube();"), blue);
  EXPECT_EQ(colour("color([-1,-1,-1,0.25]) color([-1,-1,-1,0.5]) cube();"), half);
  EXPECT_EQ(colour("color([1,0,0]) hull() color([0,0,1]) cube();"), red);
  EXPECT_EQ(colour("hull() color([0,0,1]) cube();"), std::nullopt);
  EXPECT_EQ(colour("resize([2,0,0]) color([0,0,1]) cube();"), blue);
  EXPECT_EQ(colour("color([1,0,0]) linear_extrude(height=1) color([0,0,1]) square();"), red);
}

TEST(Evaluate, OperandsKeepTheirOwnColours) {
  const Scene scene = scene_of("difference() { color([1,0,0]) cube(); color([0,0,1]) sphere(); }");
  ASSERT_EQ(scene.tree.solids().size(), 2u);
  EXPECT_EQ(scene.tree.solids()[0].colour, glm::vec4(1, 0, 0, 1));
  EXPECT_EQ(scene.tree.solids()[1].colour, glm::vec4(0, 0, 1, 1));
}

TEST(Evaluate, SolidsAreNamedByTheirPlace) {
  const Scene scene = scene_of("group() {\n  cube();\n\thull() { sphere(); } }");
  ASSERT_EQ(scene.tree.solids().size(), 2u);
  EXPECT_EQ(scene.tree.solids()[0].name, "cube at test.csg:2:3");
  EXPECT_EQ(scene.tree.solids()[1].name, "hull at test.csg:3:2");
}

TEST(Evaluate, EqualPrimitivesShareOneMesh) {
  const Scene scene = scene_of("sphere(r=2); " + moved(5, 0, 0) +
                               "sphere(r=2); sphere(r=2.5); cylinder(h=2,r1=1,r2=1,center=true);"
                               "cylinder(h=2,r1=1,r2=1,center=false);");
  const auto solids = scene.tree.solids();
  ASSERT_EQ(solids.size(), 5u);
  EXPECT_EQ(solids[0].mesh, solids[1].mesh);
  EXPECT_NE(solids[0].mesh, solids[2].mesh);
  EXPECT_NE(solids[3].mesh, solids[4].mesh);
}

TEST(Evaluate, BackgroundsAreShownAndPartOfNothing) {
  const Scene scene = scene_of(moved(1, 0, 0) + "{ cube(); %" + moved(5, 0, 0) +
                               "color([1,0,0]) difference() { cube(); sphere(r = 0.5); } }");
  EXPECT_NEAR(volume_of(scene), 1.0, 1e-9);
  ASSERT_EQ(scene.backgrounds.size(), 1u);
  EXPECT_TRUE(scene.highlights.empty());
  const Tree::NodeId ghost = scene.backgrounds[0];
  EXPECT_EQ(scene.tree.nodes()[ghost].operation, Operation::kDifference);
  expect_box(bounds(result_of(scene.tree, ghost)), {6, 0, 0}, {7, 1, 1});
}

TEST(Evaluate, HighlightsArePartOfTheSceneAndShownAgain) {
  const Scene scene = scene_of("difference() { cube([4,4,4]); #" + moved(1, 1, 1) + "cube(); }");
  EXPECT_NEAR(volume_of(scene), 63.0, 1e-9);
  ASSERT_EQ(scene.highlights.size(), 1u);
  EXPECT_EQ(scene.tree.solids().size(), 3u);
  EXPECT_NEAR(signed_volume(result_of(scene.tree, scene.highlights[0])), 1.0, 1e-9);
  // Within another one it is shown already.
  EXPECT_EQ(scene_of("#group() { #cube(); sphere(); }").highlights.size(), 1u);
  EXPECT_EQ(scene_of("#cube(); #sphere();").highlights.size(), 2u);
}

/// Around what pictures show.
Bounds box_shown(const Scene& scene) {
  Bounds box;
  for (const Tree::NodeId node : scene.shown) box.include(bounds(scene.tree, node));
  return box;
}

// As in OpenSCAD's preview.
TEST(Evaluate, HighlightedPartsBesideOthersAreSeenThrough) {
  const Scene scene = scene_of("#cube([4,4,4]); " + moved(9, 0, 0) + "cube();");
  expect_box(bounds(scene.tree, scene.tree.root()), {0, 0, 0}, {10, 4, 4});
  expect_box(box_shown(scene), {9, 0, 0}, {10, 1, 1});
  ASSERT_EQ(scene.highlights.size(), 1u);
  expect_box(bounds(scene.tree, scene.highlights[0]), {0, 0, 0}, {4, 4, 4});
  // A difference with its first operand; the scene as a whole stays.
  const Scene whole = scene_of("difference() { #cube([4,4,4]); cube([2,4,4]); }");
  EXPECT_TRUE(whole.shown.empty());
  ASSERT_EQ(whole.highlights.size(), 1u);
  EXPECT_NEAR(signed_volume(result_of(whole.tree, whole.highlights[0])), 32.0, 1e-9);
  const Scene part = scene_of("difference() { #cube([4,4,4]); cube([2,4,4]); } " + moved(9, 0, 0) +
                              "group() { cube(); } #" + moved(0, 9, 0) + "square();");
  expect_box(box_shown(part), {9, 0, 0}, {10, 1, 1});
  EXPECT_EQ(part.highlights.size(), 2u);
}

TEST(Evaluate, FlatPartsBesideSolidsAreSlabsOfPicturesOnly) {
  for (const bool first : {false, true}) {
    const std::string flat = moved(0, 0, 8) + "{ " + moved(5, 0, 0) + "square([2, 3]); }";
    const Scene scene = scene_of(first ? flat + "cube();" : "cube();" + flat);
    EXPECT_EQ(codes_of(scene), "ignored ");
    expect_box(box_shown(scene), {0, 0, 0}, {7, 3, 8.5});
    EXPECT_EQ(scene.flat, first);
    if (first) {
      EXPECT_NEAR(volume_of(scene), 6.0, 1e-9);
    } else {
      EXPECT_NEAR(volume_of(scene), 1.0, 1e-9);
    }
  }
  // Where operations take them they are left out.
  const Scene cut = scene_of("difference() { cube([4,4,4]); square(9); }");
  EXPECT_TRUE(cut.shown.empty());
}

TEST(Evaluate, GhostsInsideHullsStandWhereTheyWouldBe) {
  const Scene scene =
      scene_of(moved(10, 0, 0) + "hull() { " + moved(0, 5, 0) + "{ %cube(); #cube(); } cube(); }");
  ASSERT_EQ(scene.backgrounds.size(), 1u);
  ASSERT_EQ(scene.highlights.size(), 1u);
  for (const Tree::NodeId ghost : {scene.backgrounds[0], scene.highlights[0]}) {
    expect_box(bounds(scene.tree, ghost), {10, 5, 0}, {11, 6, 1});
  }
  expect_box(box_of(scene), {10, 0, 0}, {11, 6, 1});
}

TEST(Evaluate, DisabledSubtreesAreGone) {
  EXPECT_EQ(scene_of("*cube(); *group() { cube(); %sphere(); } *nonsense();").tree.solids().size(),
            0u);
  EXPECT_NEAR(volume_of("difference() { cube([2,2,2]); *cube(); cube([1,1,2]); }"), 6.0, 1e-9);
}

TEST(Evaluate, TheRootModifierLeavesTheTransformsAroundIt) {
  const Scene scene = scene_of("sphere(r=50); " + moved(9, 0, 0) + "group() { !" + moved(1, 0, 0) +
                               "cube(); sphere(r=50); } %cube();");
  expect_box(box_of(scene), {1, 0, 0}, {2, 1, 1});
  EXPECT_TRUE(scene.backgrounds.empty());
  EXPECT_EQ(codes_of(scene_of("!cube(); !sphere();")), "ignored ");
  EXPECT_EQ(scene_of("*!cube(); sphere();").tree.solids()[0].name, "sphere at test.csg:1:11");
}

TEST(Evaluate, FlatScenesBecomeSlabs) {
  const Scene scene = scene_of("square(size = [4, 2], center = false);" + moved(2, 0, 9) +
                               "square(size = [4, 2], center = false);");
  EXPECT_TRUE(scene.flat);
  ASSERT_EQ(scene.tree.solids().size(), 1u);
  EXPECT_NEAR(volume_of(scene), 12.0, 1e-6);
  expect_box(box_of(scene), {0, 0, -0.5}, {6, 2, 0.5}, 1e-6);
}

TEST(Evaluate, FlatScenesHaveOneSlabForEachColour) {
  const Scene scene =
      scene_of("color([1,0,0]) { square(1); " + moved(1, 0, 0) + "square(1); }" + moved(5, 0, 0) +
               "square(2); color([1,0,0]) " + moved(9, 0, 0) + "square(1);");
  EXPECT_TRUE(scene.flat);
  ASSERT_EQ(scene.tree.solids().size(), 2u);
  EXPECT_EQ(scene.tree.solids()[0].colour, glm::vec4(1, 0, 0, 1));
  EXPECT_EQ(scene.tree.solids()[1].colour, std::nullopt);
  EXPECT_NEAR(volume_of(scene), 7.0, 1e-6);
}

TEST(Evaluate, FlatSetOperationsKeepColoursOfTheFirstChild) {
  const Scene scene = scene_of(
      "difference() { union() { color([1,0,0]) square([2,2]); color([0,0,1]) " + moved(2, 0, 0) +
      "square([2,2]); } " + moved(1, 0, 0) + "color([0,1,0]) square([2,1]); }");
  ASSERT_EQ(scene.tree.solids().size(), 2u);
  EXPECT_NEAR(volume_of(scene), 6.0, 1e-6);
  EXPECT_NEAR(volume_of("intersection() { square([4,4]); " + moved(1, 1, 0) +
                        "square([4,4]); union() { square([2,9]); square([9,2]); } }"),
              9.0 - 4.0, 1e-6);
}

TEST(Evaluate, OnlyThePlanePartOfATransformMovesFlatThings) {
  // Turned about x by 90 degrees and back, one after the other: each loses y.
  const std::string turn = "multmatrix([[1,0,0,0],[0,0.5,-0.8,3],[0,0.8,0.5,7],[0,0,0,1]]) ";
  const Scene scene = scene_of(turn + turn + "square([1,1]);");
  expect_box(box_of(scene), {0, 4.5, -0.5}, {1, 4.75, 0.5}, 1e-6);
}

TEST(Evaluate, TheFirstThatIsNotEmptyDecidesTheDimension) {
  const Scene solid = scene_of("group(); cube(); square(5); group() { circle(r=3); }");
  EXPECT_EQ(codes_of(solid), "ignored ignored ");
  EXPECT_NEAR(volume_of(solid), 1.0, 1e-9);
  EXPECT_TRUE(solid.warnings[0].message.starts_with("test.csg:1:18: "));
  const Scene flat = scene_of("difference() { square(5); cube(); square(1); }");
  EXPECT_EQ(codes_of(flat), "ignored ");
  EXPECT_NEAR(volume_of(flat), 24.0, 1e-6);
  EXPECT_EQ(flat.tree.solids().size(), 1u);
}

TEST(Evaluate, UnknownModulesAreNamedAndTheirChildrenShown) {
  const Scene scene =
      scene_of("cube();\nfancy(radius = 3) { " + moved(3, 0, 0) + "cube(); }\nodd();");
  ASSERT_EQ(codes_of(scene), "not-done not-done ");
  EXPECT_EQ(scene.warnings[0].message,
            "test.csg:2:1: 'fancy' is not known; the union of its children is shown instead");
  EXPECT_EQ(scene.warnings[1].message, "test.csg:3:1: 'odd' is not known; nothing is shown for it");
  EXPECT_NEAR(volume_of(scene), 2.0, 1e-9);
}

TEST(Evaluate, UnknownArgumentsAreIgnored) {
  const Scene scene = scene_of(
      "cube(size = [1, 2, 3], center = false, timestamp = 5, convexity = \"x\", colour = [[1]]);");
  EXPECT_EQ(codes_of(scene), "");
  EXPECT_NEAR(volume_of(scene), 6.0, 1e-9);
}

TEST(Evaluate, ArgumentsOfTheWrongTypeAreTakenAsNotGiven) {
  for (const char* text :
       {"polyhedron(points = undef, faces = undef, convexity = 1);", "polygon(points = undef);",
        "polygon(points = [[0]], paths = 3);", "text(text = 5);", "import(file = 3);",
        "surface(file = [1]);", "resize(newsize = \"x\") { group(); }"}) {
    const Scene scene = scene_of(text);
    EXPECT_TRUE(scene.tree.solids().empty()) << text;
  }
  EXPECT_NEAR(volume_of("cube(size = \"big\");"), 1.0, 1e-9);
  EXPECT_NEAR(volume_of("multmatrix(\"x\") cube();"), 1.0, 1e-9);
}

TEST(Evaluate, ManyWarningsAreCounted) {
  const Scene scene = scene_of(repeated("odd();", 3000));
  EXPECT_EQ(scene.warnings.size(), 1001u);
  EXPECT_NE(scene.warnings.back().message.find("2000 more"), std::string::npos);
}

TEST(Evaluate, DepthCostsNothingButMemory) {
  constexpr int kLevels = 100'000;
  const Scene groups = scene_of(repeated("group(){", kLevels) + "cube();" + repeated("}", kLevels));
  EXPECT_EQ(groups.tree.nodes().size(), 1u);
  const Scene chain = scene_of(repeated("difference(){", kLevels) + "cube([9,9,9]);" +
                               repeated("cube();}", kLevels));
  EXPECT_EQ(chain.tree.nodes().size(), 2u * kLevels + 1u);
  const Scene marked =
      scene_of(repeated("#group(){", kLevels) + "cube();" + repeated("}", kLevels));
  EXPECT_EQ(marked.highlights.size(), 1u);
  const Scene ghosts =
      scene_of(repeated("%group(){", kLevels) + "cube();" + repeated("}", kLevels));
  EXPECT_EQ(ghosts.backgrounds.size(), 1u);
  const Scene flat =
      scene_of(repeated("intersection(){", kLevels) + "square(3);" + repeated("}", kLevels));
  EXPECT_NEAR(volume_of(flat), 9.0, 1e-6);
}

TEST(Evaluate, PrimitivesOfAbsurdSizeAreRefused) {
  const auto scene = parse_scene("sphere($fn = 1e6, r = 1);", "test.csg");
  ASSERT_FALSE(scene.has_value());
  EXPECT_EQ(scene.error().code, ErrorCode::kLimit);
  EXPECT_TRUE(scene.error().message.starts_with("test.csg:1:1: ")) << scene.error().message;
}

TEST(Evaluate, AStopIsObeyed) {
  std::stop_source source;
  source.request_stop();
  Execution execution;
  execution.stop = source.get_token();
  const auto scene = parse_scene("cube();", "test.csg", {}, execution);
  ASSERT_FALSE(scene.has_value());
  EXPECT_EQ(scene.error().code, ErrorCode::kCancelled);
}

TEST(Evaluate, PrecisionIsThatOfSixDigits) {
  EXPECT_EQ(scene_of("cube();").relative_precision, 5e-6);
}

TEST(Scene, VastCuttersWhoseSlopesAreNotKnownAreNamed) {
  const auto warnings = [](const std::string& size, const std::string& turn) {
    const auto scene = parse_scene("difference() {\n sphere(5);\n multmatrix([" + turn +
                                       "]) multmatrix([[1,0,0,-" + size + "],[0,1,0,0],[0,0,1,-" +
                                       size + "]]) cube(2" + size.substr(1) + "); }",
                                   "s.csg");
    EXPECT_TRUE(scene.has_value());
    return scene ? scene->warnings : std::vector<SceneWarning>{};
  };
  const std::string turned = "[0.866025,-0.5,0,0],[0.5,0.866025,0,0],[0,0,1,0]";
  const std::string straight = "[0,-1,0,0],[1,0,0,0],[0,0,1,0]";
  ASSERT_EQ(warnings("1e20", turned).size(), 1u);
  EXPECT_EQ(warnings("1e20", turned)[0].code, "approximate");
  EXPECT_EQ(warnings("1e20", turned)[0].message.find("s.csg:3:"), 0u);
  EXPECT_TRUE(warnings("1e20", straight).empty());
  EXPECT_TRUE(warnings("1e9", turned).empty());
}

TEST(Scene, CoordinatesBeyondAllUseAreAnErrorThatNamesTheSolid) {
  const auto error = [](const std::string& text) {
    const auto scene = parse_scene(text, "s.csg");
    EXPECT_FALSE(scene.has_value()) << text;
    return scene ? Error() : scene.error();
  };
  const auto scaled = [](const std::string& inner) {
    return "multmatrix([[1e200,0,0,0],[0,1e200,0,0],[0,0,1e200,0],[0,0,0,1]]) {" + inner + "}";
  };
  for (const std::string& text : {scaled(scaled("cube();")), scaled("sphere();"),
                                  scaled("cube(1e120);"), std::string("\ncube(1e101);")}) {
    EXPECT_EQ(error(text).code, ErrorCode::kGeometry) << text;
    EXPECT_NE(error(text).message.find("has coordinates "), std::string::npos);
  }
  EXPECT_NE(error(scaled(scaled("cube();"))).message.find("in a solid they must be below 1e+300"),
            std::string::npos);
  EXPECT_TRUE(parse_scene("difference() { sphere(); cube(1e250); }", "s.csg").has_value());
  EXPECT_EQ(error("sphere(); cube(1e120);").message,
            "s.csg:1:11: 'cube' has coordinates of about 1e+120; in a result they must be below "
            "1e+100");
  EXPECT_EQ(scene_of("cube(1e90); multmatrix([[1,0,0,-1e90]]) cube();").tree.solids().size(), 2u);
}

}  // namespace
}  // namespace strata::csg
