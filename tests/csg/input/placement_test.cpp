// Unit, up, scale and translation of meshes and scenes.

#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "strata/csg/input/scene_input.h"
#include "strata/csg/input/solid_input.h"
#include "strata/csg/measure/measure.h"
#include "strata/mesh/soup_tools.h"
#include "tests/support/temporary_folder.h"

namespace strata::csg {
namespace {

/// A tetrahedron with a corner at (1, 2, 3) and edges of 4, 6 and 9 along x, y and z: volume 36.
constexpr const char* kTetrahedron =
    "OFF\n4 4 0\n1 2 3\n5 2 3\n1 8 3\n1 2 12\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

class Placement : public testing::Test {
 protected:
  void SetUp() override { input_.files = {folder_.write("part.off", kTetrahedron)}; }
  Result<SolidInput> load() const { return load_solids(input_); }
  void expect_box(const glm::dvec3& low, const glm::dvec3& high) const {
    const auto loaded = load();
    ASSERT_TRUE(loaded.has_value()) << loaded.error().message;
    EXPECT_EQ(loaded->bounds.low, low);
    EXPECT_EQ(loaded->bounds.high, high);
  }

  testkit::TemporaryFolder folder_;
  SceneInput input_;
};

TEST_F(Placement, WithoutOptionsNothingChanges) {
  TriangleSoup soup;
  soup.positions = {{0.1, -0.0, 1e300}, {1e-320, 3, 4}, {5, 6, 7}};
  soup.triangles = {{0, 1, 2}};
  const TriangleSoup before = soup;
  MeshReadStats stats;
  ASSERT_TRUE(place_mesh("a", stats, input_, soup).has_value());
  EXPECT_EQ(std::memcmp(soup.positions.data(), before.positions.data(), 3 * sizeof(glm::dvec3)), 0);
  EXPECT_EQ(soup.triangles, before.triangles);
  expect_box({1, 2, 3}, {5, 8, 12});
}

TEST_F(Placement, TheOrderIsUnitUpScaleTranslate) {
  input_.placement.up = MeshPlacement::Up::kY;
  expect_box({1, -12, 2}, {5, -3, 8});  // (x, y, z) becomes (x, -z, y), exactly
  input_.placement.scale = {2, 4, 0.5};
  expect_box({2, -48, 1}, {10, -12, 4});
  input_.placement.translate = {-2, 48, 100};
  expect_box({0, 0, 101}, {8, 36, 104});
  const auto loaded = load();
  EXPECT_NEAR(loaded->volume, 36 * 4, 1e-9);
}

TEST_F(Placement, AMirrorKeepsTheOutsideOutside) {
  for (const glm::dvec3& scale : {glm::dvec3(-1, 1, 1), glm::dvec3(1, -2, 1),
                                  glm::dvec3(-1, -1, -1), glm::dvec3(-1, -1, 1)}) {
    input_.placement.scale = scale;
    std::vector<std::string> warnings;
    InputMessages messages;
    messages.warn = [&](const std::string& code, const std::string&) { warnings.push_back(code); };
    const auto loaded = load_solids(input_, false, messages);
    ASSERT_TRUE(loaded.has_value());
    EXPECT_TRUE(warnings.empty()) << warnings.front();
    EXPECT_FALSE(loaded->files.front().turned_around);
    EXPECT_NEAR(loaded->volume, 36 * std::abs(scale.x * scale.y * scale.z), 1e-9);
  }
}

TEST_F(Placement, AFileThatSaysItsUnitIsConvertedToTheWorlds) {
  const auto placed = [&](double file, double world, double x) {
    MeshReadStats stats;
    stats.unit_metres = file;
    TriangleSoup soup;
    soup.positions = {{x, 0, 0}};
    input_.placement.unit_metres = world;
    EXPECT_TRUE(place_mesh("a", stats, input_, soup).has_value());
    return soup.positions.front().x;
  };
  EXPECT_EQ(placed(0.0254, 1e-3, 1), 25.4);
  EXPECT_EQ(placed(0.0254, 1e-3, 3), 3 * 25.4);
  EXPECT_EQ(placed(1e-3, 1.0, 7), 0.007);  // a division, rounded once
  EXPECT_EQ(placed(1e-3, 1e-6, 7), 7000);
  EXPECT_EQ(placed(0.3048, 0.0254, 2), 24);
  EXPECT_EQ(placed(1e-2, 1e-3, 0.1), 1);
  EXPECT_EQ(placed(0, 1e-3, 7), 7);  // the file does not say
  EXPECT_EQ(placed(1e-3, 0, 7), 7);  // the world is not known
}

TEST_F(Placement, TheWorldIsInMillimetresBesideA3mf) {
  EXPECT_EQ(world_unit(input_), 0);
  input_.files.push_back("b.3mf");
  EXPECT_EQ(world_unit(input_), 1e-3);
  input_.placement.unit_metres = 0.0254;
  EXPECT_EQ(world_unit(input_), 0.0254);
  input_.placement.unit_metres = 0;
  input_.files = {"a.obj", "b.amf"};
  EXPECT_EQ(world_unit(input_), 1e-3);
  input_.files = {"a.obj"};
  input_.format = MeshFormat::k3mf;
  EXPECT_EQ(world_unit(input_), 1e-3);
}

TEST_F(Placement, AFormatWithYUpIsTurnedUnlessTheUserSaysOtherwise) {
  const auto turned = [&](bool y_up, MeshPlacement::Up up) {
    MeshReadStats stats;
    stats.y_up = y_up;
    TriangleSoup soup;
    soup.positions = {{1, 2, 3}};
    input_.placement.up = up;
    EXPECT_TRUE(place_mesh("a", stats, input_, soup).has_value());
    return soup.positions.front() == glm::dvec3(1, -3, 2);
  };
  using Up = MeshPlacement::Up;
  EXPECT_TRUE(turned(true, Up::kFile));
  EXPECT_FALSE(turned(false, Up::kFile));
  EXPECT_TRUE(turned(false, Up::kY));
  EXPECT_FALSE(turned(true, Up::kZ));
}

TEST_F(Placement, AScenesTreeIsMoved) {
  folder_.write("s.csg", "cube(size = [1, 2, 3], center = false);\n");
  input_.files = {folder_.file("s.csg")};
  input_.placement.up = MeshPlacement::Up::kY;
  input_.placement.scale = {2, 2, -4};
  input_.placement.translate = {10, 20, 30};
  input_.placement.unit_metres = 1.0;  // scenes are in the world's unit
  const auto scene = load_scene(input_);
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  const Bounds box = bounds(scene->tree);
  EXPECT_EQ(box.low, glm::dvec3(10, 20 - 6, 30 - 8));
  EXPECT_EQ(box.high, glm::dvec3(12, 20, 30));
  const auto measured = measure(scene->tree, scene->tree.root(), {.resolution = 64});
  ASSERT_TRUE(measured.has_value());
  EXPECT_NEAR(measured->volume, 6 * 16, 1e-6);
}

TEST_F(Placement, MeshesOfAnExpressionAreMovedEach) {
  folder_.write("big.off",
                "OFF\n4 4 0\n0 0 0\n40 0 0\n0 40 0\n0 0 40\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
  input_.files.push_back(folder_.file("big.off"));
  input_.expression = "big - part";
  input_.placement.scale = glm::dvec3(-2);
  const auto scene = load_scene(input_);
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  EXPECT_EQ(bounds(scene->tree).low, glm::dvec3(-80));
  const auto measured = measure(scene->tree, scene->tree.root(), {.resolution = 512});
  EXPECT_NEAR(measured->volume, 8 * (40. * 40 * 40 / 6 - 36), 8 * 36 * 0.2);
}

TEST_F(Placement, WhatLeavesTheRangeOfDoubleIsRefused) {
  input_.placement.scale = glm::dvec3(1e308);
  const auto loaded = load();
  ASSERT_FALSE(loaded.has_value());
  EXPECT_NE(loaded.error().message.find("part.off: --scale, --translate or --unit moves it beyond"),
            std::string::npos)
      << loaded.error().message;
  folder_.write("s.csg", "cube(size = [10, 20, 30], center = false);\n");
  input_.files = {folder_.file("s.csg")};
  EXPECT_FALSE(load_scene(input_).has_value());
}

TEST_F(Placement, AnUnlikelySizeIsToldWhereNothingSaysTheUnit) {
  const MeshReadStats silent;
  const auto doubt = [&](double length) {
    return unit_doubt(silent, input_, {{0, 0, 0}, {length, length / 2, 0}});
  };
  EXPECT_EQ(doubt(0.5), "");
  EXPECT_EQ(doubt(1), "");
  EXPECT_EQ(doubt(2000), "");
  EXPECT_NE(doubt(0.021).find("0.021 long; the file says nothing about units; if it is in metres, "
                              "give --unit m, or --scale 1000"),
            std::string::npos)
      << doubt(0.021);
  EXPECT_NE(doubt(21000).find("--scale 0.001"), std::string::npos);
  EXPECT_EQ(doubt(0), "");
  input_.placement.unit_metres = 1;
  EXPECT_EQ(doubt(0.021), "");  // the user says it
  input_.placement.unit_metres = 0;
  input_.placement.scale = glm::dvec3(1000);
  EXPECT_EQ(doubt(0.021), "");
}

TEST_F(Placement, ReportsSayWhatWasConverted) {
  EXPECT_EQ(describe_unit(0.0254, 1e-3, ""),
            "the millimetre; that of the file is the inch, so numbers were multiplied by 25.4");
  EXPECT_EQ(describe_unit(1e-3, 1e-3, ""), "the millimetre, as the file says");
  EXPECT_EQ(describe_unit(0, 1, ""), "the metre; the file says nothing about units");
  EXPECT_EQ(describe_unit(0, 0, ""), "");
}

}  // namespace
}  // namespace strata::csg
