#include "apps/view/scene/document.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

#include "apps/view/files/file_watch.h"
#include "apps/view/files/scene_files.h"
#include "apps/view/scene/loader.h"
#include "csg/measure/ray_image.h"
#include "strata/csg/measure/measure.h"
#include "tests/support/temporary_folder.h"

namespace strata::view {
namespace {

/// A scene as the loader would give it. Six numbers a transform: .csg has multmatrix.
std::string csg_of() {
  return "difference() {\n"
         "cube(size = [10, 10, 2], center = false);\n"
         "multmatrix([[1,0,0,5],[0,1,0,5],[0,0,1,-1],[0,0,0,1]]) { cube(size = [2,2,9]); }\n"
         "multmatrix([[1,0,0,1],[0,1,0,1],[0,0,1,1],[0,0,0,1]]) { cube(size = [2,2,9]); }\n"
         "}\n"
         "multmatrix([[1,0,0,20],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) { sphere($fn = 24, r = 3); }\n";
}

Model model_of(const std::string& text) {
  Model model;
  auto scene = csg::parse_scene(text, "plate.csg");
  EXPECT_TRUE(scene) << (scene ? "" : scene.error().message);
  if (scene) model.scene = *std::move(scene);
  return model;
}

double volume_of(const Arrangement& what) {
  const auto measured = csg::measure(what.tree, what.tree.root(), {.resolution = 500});
  EXPECT_TRUE(measured);
  return measured ? measured->volume : -1;
}

TEST(Arrange, WithoutWishesItIsTheScene) {
  const Model model = model_of(csg_of());
  const auto what = arrange(model, {});
  ASSERT_EQ(what->tree.solids().size(), model.scene.tree.solids().size());
  EXPECT_EQ(what->model_solids, 4u);
  EXPECT_TRUE(what->ghosts.empty());
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(what->tree.solids()[i].mesh, model.scene.tree.solids()[i].mesh);
    EXPECT_EQ(what->tree.solids()[i].name, model.scene.tree.solids()[i].name);
  }
  const auto scene = csg::measure(model.scene.tree, model.scene.tree.root(), {.resolution = 500});
  ASSERT_TRUE(scene);
  EXPECT_EQ(volume_of(*what), scene->volume);
}

TEST(Arrange, AHiddenSolidIsAsIfItWereNotWritten) {
  const Model model = model_of(csg_of());
  const double whole = volume_of(*arrange(model, {}));
  Looks looks;
  looks.hidden = {0, 1, 0, 0};  // the hole through the plate
  EXPECT_NEAR(volume_of(*arrange(model, looks)), whole + 8, 0.5);
  looks.hidden = {1, 0, 0, 0};  // what it is taken from: nothing is left of the difference
  const auto without = arrange(model, looks);
  EXPECT_NEAR(volume_of(*without), whole - 200 + 8 + 4, 3);
  EXPECT_EQ(without->tree.solids().size(), 4u);  // picks still count as before
  looks.hidden = {1, 1, 1, 1};
  EXPECT_EQ(arrange(model, looks)->tree.root(), csg::Tree::kNone);
}

TEST(Arrange, GhostsAreWhatIsSubtracted) {
  const Model model = model_of(csg_of());
  Looks looks;
  looks.ghosts = true;
  const auto what = arrange(model, looks);
  ASSERT_EQ(what->ghosts.size(), 1u);
  EXPECT_EQ(what->tree.operands(what->ghosts.front().node).size(), 2u);
  EXPECT_EQ(what->tree.solids().size(), 6u);
  EXPECT_EQ(volume_of(*what), volume_of(*arrange(model, {})));
  looks.hidden = {0, 1, 0, 0};
  EXPECT_EQ(arrange(model, looks)->tree.solids().size(), 5u);
  looks.hidden = {0, 1, 1, 0};
  EXPECT_TRUE(arrange(model, looks)->ghosts.empty());
}

TEST(Arrange, ASectionCutsTheResultAndTheGhosts) {
  const Model model = model_of(csg_of());
  Looks looks;
  looks.hidden = {0, 1, 1, 1};
  looks.section = csg::SectionPlane{{0, 0, 1}, 0.5, false};
  EXPECT_NEAR(volume_of(*arrange(model, looks)), 50, 0.5);
  looks.section = csg::SectionPlane{{0, 0, -1}, -0.5, false};
  EXPECT_NEAR(volume_of(*arrange(model, looks)), 150, 0.5);
}

TEST(Arrange, ColoursReplaceTheScenes) {
  const Model model = model_of(csg_of());
  Looks looks;
  looks.colours.emplace(3, *parse_colour("#ff8000"));
  const auto what = arrange(model, looks);
  ASSERT_TRUE(what->tree.solids()[3].colour);
  EXPECT_EQ(*what->tree.solids()[3].colour, glm::vec4(1, 128 / 255.f, 0, 1));
  EXPECT_FALSE(what->tree.solids()[0].colour);
}

TEST(Section, TowardsTheEyeIsDecidedOnce) {
  Camera camera;
  camera.rotation = {90, 0, 0};  // the eye is at -y
  const auto plane = csg::facing({{0, 1, 0}, 4, true}, camera);
  EXPECT_EQ(plane.normal, glm::dvec3(0, -1, 0));
  EXPECT_EQ(plane.offset, -4);
  EXPECT_FALSE(plane.towards_eye);
  camera.rotation = {90, 0, 180};
  EXPECT_EQ(csg::facing({{0, 1, 0}, 4, true}, camera).normal, glm::dvec3(0, 1, 0));
}

TEST(FindSolids, ByIndexNameAndPartOfIt) {
  const Model model = model_of(csg_of());
  EXPECT_EQ(*find_solids(model, "@2"), std::vector<std::uint32_t>{2});
  EXPECT_EQ(*find_solids(model, "sphere"), std::vector<std::uint32_t>{3});
  EXPECT_EQ(find_solids(model, "cube")->size(), 3u);
  EXPECT_EQ(find_solids(model, "all")->size(), 4u);
  const std::string whole = model.scene.tree.solids()[1].name;
  EXPECT_EQ(*find_solids(model, whole), std::vector<std::uint32_t>{1});
  for (const char* none : {"@4", "@", "@1x", "@99999999999999999999", "cone", ""}) {
    const auto found = find_solids(model, none);
    ASSERT_FALSE(found) << none;
    EXPECT_EQ(found.error().code, ErrorCode::kUsage);
  }
}

TEST(CarryOver, LooksStayWithTheirSolids) {
  const Model before = model_of(csg_of());
  // The second hole is gone, a cube of another name stands before all.
  const Model after = model_of(csg_of() + "cylinder(h = 1, r1 = 1, r2 = 1);\n");
  Looks looks;
  looks.hidden = {0, 1, 0, 1};
  looks.colours.emplace(2, glm::vec4(1, 0, 0, 1));
  looks.ghosts = true;
  looks.selected = 3;
  const Looks carried = carry_over(looks, before, after);
  EXPECT_EQ(carried.hidden, (std::vector<std::uint8_t>{0, 1, 0, 1, 0}));
  EXPECT_EQ(carried.colours.count(2), 1u);
  EXPECT_EQ(carried.selected, 3u);
  EXPECT_TRUE(carried.ghosts);
  const Model other = model_of("cylinder(h = 1, r1 = 1, r2 = 1);");
  const Looks forgotten = carry_over(looks, before, other);
  EXPECT_TRUE(forgotten.hidden.empty());
  EXPECT_TRUE(forgotten.colours.empty());
  EXPECT_FALSE(forgotten.selected);
}

TEST(Colours, HexadecimalOnesAndNamesAreRead) {
  EXPECT_EQ(*parse_colour("#f00"), glm::vec4(1, 0, 0, 1));
  EXPECT_EQ(*parse_colour("red"), glm::vec4(1, 0, 0, 1));
  EXPECT_EQ(*parse_colour("#000000"), glm::vec4(0, 0, 0, 1));
  EXPECT_EQ(*parse_colour("#FFffFF00"), glm::vec4(1, 1, 1, 0));
  for (const char* bad :
       {"", "#", "reddish", "#1234567z", "#1234567890", "#12345", "#1234567", "#gg0000"}) {
    EXPECT_FALSE(parse_colour(bad)) << bad;
  }
}

TEST(RayImage, ThicknessIsThatOfTheFirstWall) {
  // A tube seen from the side: two walls of 1 with a gap of 4 between.
  const Model model = model_of(
      "difference() { cube(size = [6, 6, 6], center = true); cube(size = [4, 4, 9], center = "
      "true); "
      "}");
  for (const auto projection : {Projection::kOrthographic, Projection::kPerspective}) {
    Camera camera;
    camera.projection = projection;
    camera.rotation = {90, 0, 0};
    camera.distance = 60;
    Bounds box;
    box.low = glm::dvec3(-5), box.high = glm::dvec3(5);
    const auto view = make_view(camera, {101, 101}, box);
    ASSERT_TRUE(view);
    const csg::RayMeter meter(model.scene.tree, model.scene.tree.root(), 0);
    const auto rays = meter.measure(*view);
    ASSERT_TRUE(rays);
    const std::size_t middle = 50 * 101 + 50;
    EXPECT_NEAR(rays->thickness[middle], 1, 1e-3);
    EXPECT_EQ(rays->crossings[middle], 4u);
    EXPECT_EQ(rays->thickness[0], 0);
    EXPECT_EQ(rays->crossings[0], 0u);
  }
}

TEST(RayImage, WallsThatTouchAreOne) {
  const Model model = model_of(
      "cube(size = [2, 2, 2]); multmatrix([[1,0,0,0],[0,1,0,2],[0,0,1,0],[0,0,0,1]]) { cube(size = "
      "[2, 3, 2]); }");
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = {90, 0, 0};
  camera.target = {1, 1, 1};
  camera.distance = 20;
  Bounds box;
  box.low = glm::dvec3(0), box.high = glm::dvec3(2, 5, 2);
  const auto view = make_view(camera, {64, 64}, box);
  ASSERT_TRUE(view);
  const auto rays = csg::RayMeter(model.scene.tree, model.scene.tree.root(), 5e-6).measure(*view);
  ASSERT_TRUE(rays);
  EXPECT_NEAR(rays->thickness[32 * 64 + 32], 5, 1e-3);
}

TEST(RayImage, CuttersFarLargerThanTheResultLeaveItDepth) {
  const Model model = model_of(
      "difference() { cube(size = [10, 10, 10]); multmatrix([[1,0,0,5],[0,1,0,-1e7],[0,0,1,-1e7],"
      "[0,0,0,1]]) { cube(size = [2e7, 2e7, 2e7]); } }");
  const csg::Tree& tree = model.scene.tree;
  std::vector<Bounds> solids;
  for (const csg::Solid& solid : tree.solids()) solids.push_back(csg::bounds(solid));
  const csg::Tree::NodeId root = tree.root();
  const Bounds box = csg::picture_box(tree, solids, std::span(&root, 1));
  EXPECT_EQ(box.high, glm::dvec3(10));
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = glm::dvec3(0);
  camera.target = glm::dvec3(2.5, 5, 5);
  camera.distance = 60;
  const auto view = make_view(camera, {64, 64}, box);
  ASSERT_TRUE(view);
  const auto rays = csg::RayMeter(tree, root, 5e-6).measure(*view);
  ASSERT_TRUE(rays);
  EXPECT_NEAR(rays->thickness[32 * 64 + 32], 10, 1e-2);
}

class Files : public testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return folder_.file(name); }
  void write(const std::string& name, const std::string& text) const { folder_.write(name, text); }
  testkit::TemporaryFolder folder_;
};

TEST(QuotedNames, AreWhatASceneMayRead) {
  EXPECT_EQ(quoted_names("use <lib.scad>\nimport(file = \"part.stl\"); echo(\"hello\"); a < b; "
                         "text(\"x.y\nz\")"),
            (std::vector<std::string>{"lib.scad", "part.stl"}));
  EXPECT_EQ(quoted_names("include < my lib.scad>\nif (a<b.c>d) use<x.y>;"),
            (std::vector<std::string>{" my lib.scad", "x.y"}));
  EXPECT_EQ(quoted_names("// 5\" tube\ntext(\"5\\\" x\"); surface(\"a\\\\b.png\");"),
            (std::vector<std::string>{"a\\b.png"}));
  EXPECT_TRUE(quoted_names("\"").empty());
  EXPECT_TRUE(quoted_names("").empty());
}

TEST_F(Files, AChangeIsSeenOnceItIsWhole) {
  write("a.csg", "cube();");
  FileWatch watch({path("a.csg")});
  EXPECT_FALSE(watch.changed());
  write("a.csg", "sphere(); cube();");
  EXPECT_FALSE(watch.changed());  // it may still grow
  EXPECT_TRUE(watch.changed());
  EXPECT_FALSE(watch.changed());
  std::filesystem::remove(path("a.csg"));  // as some editors do before they write
  EXPECT_FALSE(watch.changed());
  EXPECT_FALSE(watch.changed());
  write("b.csg", "cylinder();");
  std::filesystem::rename(path("b.csg"), path("a.csg"));
  EXPECT_FALSE(watch.changed());
  EXPECT_TRUE(watch.changed());
}

TEST_F(Files, WhatASceneNamesIsWatchedToo) {
  write("main.scad", "include <lib.scad>\nimport(\"part.off\");");
  write("lib.scad", "module m() { surface(\"height.dat\"); }");
  write("part.off", "OFF\n0 0 0\n");
  write("height.dat", "1 2\n");
  write("other.scad", "");
  FileWatch watch({path("main.scad")});
  EXPECT_EQ(watch.files().size(), 4u);
  write("height.dat", "1 2\n3 4\n");
  EXPECT_FALSE(watch.changed());
  EXPECT_TRUE(watch.changed());
  write("main.scad", "include <other.scad>\n");
  EXPECT_FALSE(watch.changed());
  EXPECT_TRUE(watch.changed());
  watch.refresh();
  EXPECT_EQ(watch.files(), (std::vector<std::string>{path("main.scad"), path("other.scad")}));
}

TEST_F(Files, APictureIsNotWrittenOverAFileOfTheScene) {
  write("a.csg", "surface(file = \"h\\x65ight.dat\"); cube();");
  write("height.dat", "1 2\n3 4\n");
  apps::CsgCommand command;
  command.input.files = {path("a.csg")};
  command.outputs = {{"--screenshot", path("other.dat")}};
  EXPECT_TRUE(load_model(command, {}).has_value());
  command.outputs.push_back({"--screenshot", path("height.dat")});
  const auto refused = load_model(command, {});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
  EXPECT_NE(refused.error().message.find("would overwrite a file of the scene"), std::string::npos);
}

TEST_F(Files, TheLoaderReadsScenesAndReportsErrors) {
  write("good.csg", csg_of());
  write("bad.csg", "cube(size = [1, 1);\n");
  Loader loader([] {});
  apps::CsgCommand command;
  const auto load = [&](const std::string& name) {
    command.input.files = {path(name)};
    loader.start(command, 1);
    auto result = loader.take();
    for (int i = 0; i < 10000 && !result; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      result = loader.take();
    }
    return result;
  };
  const auto good = load("good.csg");
  ASSERT_TRUE(good && *good) << (good ? good->error().message : "nothing came");
  EXPECT_EQ((**good)->scene.tree.solids().size(), 4u);
  EXPECT_FALSE((**good)->box.empty());
  EXPECT_FALSE(loader.busy());
  const auto bad = load("bad.csg");
  ASSERT_TRUE(bad);
  ASSERT_FALSE(*bad);
  EXPECT_NE(bad->error().message.find("bad.csg:1:"), std::string::npos) << bad->error().message;
}

TEST_F(Files, ALoadThatIsCancelledEndsSoon) {
  write("many.csg", [] {
    std::string text;
    for (int i = 0; i < 20000; ++i)
      text += "sphere($fn = 64, r = " + std::to_string(i + 1) + ");\n";
    return text;
  }());
  apps::CsgCommand command;
  command.input.files = {path("many.csg")};
  Loader loader([] {});
  loader.start(command, 1);
  loader.cancel();
  auto result = loader.take();
  for (int i = 0; i < 10000 && !result; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    result = loader.take();
  }
  ASSERT_TRUE(result);
  if (!*result) {
    EXPECT_EQ(result->error().code, ErrorCode::kCancelled);
  }
}

}  // namespace
}  // namespace strata::view
