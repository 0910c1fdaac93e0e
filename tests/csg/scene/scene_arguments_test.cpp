// Arguments by position, and arguments that are not what they should be.
#include <cmath>
#include <string>

#include "tests/csg/scene/scene_checks.h"

namespace strata::csg {
namespace {

/// The warning that a scene has, one in all, without `test.csg:`.
std::string warning_of(std::string_view text) {
  const Scene scene = scene_of(text);
  EXPECT_EQ(codes_of(scene), "geometry ") << text;
  constexpr std::size_t kPlace = sizeof "test.csg:" - 1;
  return scene.warnings.empty() ? "" : scene.warnings[0].message.substr(kPlace);
}

/// What OpenSCAD 2021.01 makes of each: the sizes are those of its dumps.
TEST(Arguments, PositionsAreThoseOfOpenscad) {
  EXPECT_NEAR(volume_of("cylinder(10,2,2,$fn=4);"), 80.0, 1e-9);
  EXPECT_NEAR(volume_of("cylinder(10,2,$fn=4);"), 20.0 / 3.0 * (4 + 2 + 1), 1e-9);
  EXPECT_NEAR(volume_of("cylinder(10,r=2,$fn=4);"), 80.0, 1e-9);
  EXPECT_NEAR(volume_of("cylinder(10,2,r=2,$fn=4);"), 80.0, 1e-9);
  EXPECT_NEAR(volume_of("cylinder(h=10,2,3,$fn=4);"), 4.0 / 3.0 * (9 + 3 + 1), 1e-9);
  EXPECT_NEAR(volume_of("cylinder(2,3,h=10,$fn=4);"), 20.0 / 3.0 * (9 + 3 + 1), 1e-9);
  expect_box(box_of(scene_of("cylinder(10,2,3,true,$fn=4);")), {-3, -3, -5}, {3, 3, 5});
  expect_box(box_of(scene_of("cube(4,true);")), {-2, -2, -2}, {2, 2, 2});
  expect_box(box_of(scene_of("square([2,3],true);")), {-1, -1.5, -0.5}, {1, 1.5, 0.5}, 1e-6);
  expect_box(box_of(scene_of("circle(5,10,$fn=4);")), {-5, -5, -0.5}, {5, 5, 0.5}, 1e-6);
  EXPECT_EQ(box_of(scene_of("sphere(5,10,$fn=4);")).high.x,
            box_of(scene_of("sphere(5,$fn=4);")).high.x);
  EXPECT_NEAR(volume_of("polyhedron([[0,0,0],[1,0,0],[0,1,0],[0,0,1]],"
                        "[[0,1,2],[0,3,1],[1,3,2],[0,2,3]],7);"),
              1.0 / 6.0, 1e-9);
  EXPECT_NEAR(volume_of("polygon([[0,0],[2,0],[0,2],[9,9]],[[0,1,2]],3);"), 2.0, 1e-6);
  EXPECT_NEAR(volume_of("linear_extrude(5) square(2);"), 20.0, 1e-9);
}

TEST(Arguments, WhatIsNoSizeIsNamed) {
  EXPECT_EQ(warning_of("cube([1,1,1]);\n sphere(r=nan);"),
            "2:2: 'sphere': the radius is nan, not finite; it is left out");
  EXPECT_EQ(warning_of("sphere(d=-3);"),
            "1:1: 'sphere': the radius is -1.5, less than 0; it is left out");
  EXPECT_EQ(warning_of("cube([-nan,5,5]);"),
            "1:1: 'cube': a size is nan, not finite; it is left out");
  EXPECT_EQ(warning_of("cube([5,inf,5]);"),
            "1:1: 'cube': a size is inf, not finite; it is left out");
  EXPECT_EQ(warning_of("cylinder(h=-5,r=2);"),
            "1:1: 'cylinder': the height is -5, less than 0; it is left out");
  EXPECT_EQ(warning_of("cylinder(h=5,r1=2,r2=-0.5);"),
            "1:1: 'cylinder': the radius r2 is -0.5, less than 0; it is left out");
  EXPECT_EQ(warning_of("square([-1,1]);"),
            "1:1: 'square': a size is -1, less than 0; it is left out");
  EXPECT_EQ(warning_of("circle(-2);"),
            "1:1: 'circle': the radius is -2, less than 0; it is left out");
  EXPECT_EQ(warning_of("linear_extrude(height=nan,scale=[1,1],center=false) square(1);"),
            "1:1: 'linear_extrude': the height is nan, not finite; it is left out");
  EXPECT_EQ(warning_of("linear_extrude(height=-5) square(2);"),
            "1:1: 'linear_extrude': the height is -5, less than 0; it is left out");
  EXPECT_EQ(warning_of("linear_extrude(height=1,twist=inf) square(1);"),
            "1:1: 'linear_extrude' with twist inf, scale [1, 1], which must be finite; it is left "
            "out");
  EXPECT_EQ(warning_of("offset(r=inf) square(1);"),
            "1:1: 'offset' by inf, which must be less than 1e+150; it is left out");
  EXPECT_EQ(warning_of("offset(delta=-1e300) square(1);"),
            "1:1: 'offset' by -1e+300, which must be less than 1e+150; it is left out");
  EXPECT_EQ(warning_of("polygon([[0,0],[1e300,0],[0,1]]);"),
            "1:1: point 1 of the polygon is [1e+300, 0], not two numbers below 1e+150; the polygon "
            "is left out");
  // A wall of no thickness is nothing, and means it.
  for (const char* nothing : {"cube([3,3,0]);", "sphere(0);", "cylinder(h=0,r=1);",
                              "cylinder(h=1,r=0);", "square([0,1]);", "circle(r=0);", "cube(0);"}) {
    const Scene scene = scene_of(nothing);
    EXPECT_EQ(codes_of(scene), "") << nothing;
    EXPECT_TRUE(scene.tree.solids().empty()) << nothing;
  }
}

TEST(Arguments, WhatIsNoNumberIsNamed) {
  EXPECT_EQ(warning_of("sphere(r=\"5\");"), "1:1: 'sphere': r is \"5\", not a number; 1 is used");
  EXPECT_EQ(warning_of("circle(d=true);"), "1:1: 'circle': d is true, not a number; 2 is used");
  EXPECT_EQ(warning_of("cylinder(\"5\",2);"),
            "1:1: 'cylinder': h is \"5\", not a number; 1 is used");
  EXPECT_EQ(warning_of("cube(\"a\");"),
            "1:1: 'cube': size is \"a\", not a number or 3 numbers; 1 is used");
  // OpenSCAD takes 1 for all of them too.
  EXPECT_NEAR(volume_of("cube([2,3]);"), 1.0, 1e-9);
  EXPECT_EQ(warning_of("cube([2,[\"b\",[]],false]);"),
            "1:1: 'cube': size is [2, [\"b\", []], false], not a number or 3 numbers; 1 is used");
  EXPECT_EQ(warning_of("square([1,2,3]);"),
            "1:1: 'square': size is [1, 2, 3], not a number or 2 numbers; 1 is used");
  EXPECT_EQ(warning_of("linear_extrude(height=1,scale=\"x\") square(1);"),
            "1:1: 'linear_extrude': scale is \"x\", not a number; 1 is used");
  EXPECT_EQ(warning_of("sphere(1,$fn=\"a\");"),
            "1:1: 'sphere': $fn is \"a\", not a number; its default is used");
  EXPECT_EQ(warning_of("rotate_extrude(angle=\"x\") square(1);"),
            "1:1: 'rotate_extrude': angle is \"x\", not a number; 360 is used");
  const std::string long_one = warning_of("sphere(\"" + std::string(5000, 'x') + "\");");
  EXPECT_LT(long_one.size(), 160u);
  EXPECT_EQ(codes_of(scene_of("sphere(r=undef); cube(undef); cylinder(h=undef);")), "");
}

TEST(Arguments, AbsurdNumbersOfPiecesAreNamed) {
  const auto warning = [](std::string_view text) {
    const Scene scene = scene_of(text);
    EXPECT_EQ(codes_of(scene), "approximate ") << text;
    return scene.warnings.empty() ? "" : scene.warnings[0].message;
  };
  EXPECT_EQ(warning("cylinder(h=1,r1=1,r2=0,$fn=1e7);"),
            "test.csg:1:1: 'cylinder': $fn is 1e+07; 1e+06 is used");
}

/// The message with which a scene is beyond a limit.
std::string limit_of(const std::string& text, std::uint64_t memory_limit = 0) {
  Execution execution;
  execution.memory_limit = memory_limit;
  const auto scene = parse_scene("cube();\n " + text, "test.csg", {}, execution);
  EXPECT_FALSE(scene.has_value()) << text;
  if (scene) return {};
  EXPECT_EQ(scene.error().code, ErrorCode::kLimit) << text << scene.error().message;
  return scene.error().message;
}

TEST(Arguments, WhatWouldBeTooLargeIsRefusedBeforeItIsMade) {
  const std::string triangle = " polygon([[0,0],[1,0],[0,1]]);";
  EXPECT_EQ(
      limit_of("linear_extrude(height=1,center=false,scale=[1,1],twist=9,slices=1e9)" + triangle),
      "test.csg:2:2: 'linear_extrude' of 1e+09 slices (twist 9, $fn 0) would have 6e+09 triangles; "
      "the limit is 1e+08");
  EXPECT_EQ(
      limit_of("linear_extrude(height=1,center=false,scale=[1,1],twist=1e9,$fn=8)" + triangle),
      "test.csg:2:2: 'linear_extrude' of 2.22222e+07 slices (twist 1e+09, $fn 8) would have "
      "1.33e+08 triangles; the limit is 1e+08");
  EXPECT_EQ(limit_of("sphere($fn=20000);"),
            "test.csg:2:2: 'sphere' of 20000 segments would have 4e+08 triangles; the limit is "
            "1e+08");
  EXPECT_EQ(limit_of("rotate_extrude($fn=1e5) multmatrix([[1,0,0,5],[0,1,0,0],[0,0,1,0],"
                     "[0,0,0,1]]) circle($fn=1000);"),
            "test.csg:2:2: 'rotate_extrude' of 100000 steps would have 2e+08 triangles; the limit "
            "is 1e+08");
  const std::uint64_t megabyte = 1'000'000;
  EXPECT_EQ(limit_of("sphere($fn=1000);", 40 * megabyte),
            "test.csg:2:2: 'sphere' of 1000 segments would have 1e+06 triangles; with the scene so "
            "far they need about 0.0641 GB, but the memory limit is 0.04 GB");
  for (const std::string& made : std::initializer_list<std::string>{
           "cylinder($fn=1e6);", "linear_extrude(height=1,twist=360,slices=1e6)" + triangle,
           "rotate_extrude($fn=1e6)" + triangle, "hull() { sphere($fn=300); sphere($fn=500); }",
           "circle($fn=1e6);", "offset(r=1,$fn=1e6) square(1);", "text(\"Strata\",$fn=100000);",
           "minkowski() { difference() { sphere($fn=50); "
           "cube([1,1,9],true); } sphere($fn=50); }"}) {
    EXPECT_EQ(limit_of(made, 40 * megabyte).find("test.csg:2:2: '"), 0u) << made;
  }
  // What exists twice is one mesh.
  Execution execution;
  execution.memory_limit = 15 * megabyte;
  EXPECT_TRUE(parse_scene("sphere($fn=400); sphere($fn=400);", "a", {}, execution).has_value());
  EXPECT_FALSE(parse_scene("sphere($fn=400); sphere($fn=402);", "a", {}, execution).has_value());
}

TEST(Arguments, MatricesThatAreNoneAreNamed) {
  EXPECT_EQ(warning_of("multmatrix([[1,0,0,0],[0,1,0,nan]]) cube();"),
            "1:1: the matrix has nan in row 2, column 4; its children are left out");
  EXPECT_EQ(warning_of("multmatrix([[1],[],[],[0,0,0,inf]]) cube();"),
            "1:1: the matrix has inf in row 4, column 4; its children are left out");
  const char* text = "multmatrix([[2,\"x\",0,1]]) cube();";
  EXPECT_EQ(warning_of(text),
            "1:1: the matrix has \"x\" in row 1, column 2; using the identity's entry there");
  expect_box(box_of(scene_of(text)), {1, 0, 0}, {3, 1, 1});
}

TEST(Arguments, IndicesThatAreNoneAreNamed) {
  const std::string points = "points=[[0,0,0],[1,0,0],[0,1,0],[0,0,1]],";
  const std::string text = "polyhedron(" + points + "faces=[[0,1.5,2],[0,3,1],[1,3,2],[0,2,3]]);";
  EXPECT_EQ(warning_of(text),
            "1:1: 1 corners of faces are not whole numbers, the first is 1.5 in face 0; they are "
            "rounded down");
  EXPECT_NEAR(volume_of(text), 1.0 / 6.0, 1e-9);
  const Scene scene =
      scene_of("polyhedron(" + points + "faces=[[0,1,2],[0,3,-1,1],[1,3,2,4],[0,2,3]]);");
  EXPECT_EQ(scene.warnings.at(0).message,
            "test.csg:1:1: 2 corners of faces are not indices of the 4 points, the first is -1 in "
            "face 1; they are left out");
  EXPECT_EQ(
      warning_of("polygon([[0,0],[1,0],[0,1]],[[0,1,2,\"a\"]]);"),
      "1:1: 1 corners of paths are not indices of the 3 points, the first is \"a\" in path 0; "
      "they are left out");
  EXPECT_EQ(warning_of("polyhedron([[0,0,0],[1,0]],[[0,1,2]]);"),
            "1:1: point 1 of the polyhedron is [1, 0], not three finite numbers; the polyhedron is "
            "left out");
}

}  // namespace
}  // namespace strata::csg
