#include "apps/view/scene/exporter.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/read_mesh.h"
#include "tests/support/temporary_folder.h"

namespace strata::view {
namespace {

constexpr const char* kScene =
    "difference() {\n"
    "color([1, 0, 0, 1]) cube(size = [10, 10, 4]);\n"
    "multmatrix([[1,0,0,4],[0,1,0,4],[0,0,1,-1],[0,0,0,1]]) cube(size = [2, 2, 9]);\n"
    "}\n"
    "multmatrix([[1,0,0,20],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) cube(size = [3, 3, 3]);\n";

class Export : public testing::Test {
 protected:
  Export() {
    auto scene = csg::parse_scene(kScene, "plate.csg");
    EXPECT_TRUE(scene);
    if (scene) model_.scene = *std::move(scene);
  }
  /// What an export of these looks says.
  Result<std::string> run(const std::string& name, const Looks& looks, int resolution = 16,
                          const Execution& execution = {}) {
    return export_what_is_seen({arrange(model_, looks), folder_.file(name), resolution}, execution);
  }
  [[nodiscard]] double volume(const std::string& name) const {
    const auto file = read_mesh(folder_.file(name));
    EXPECT_TRUE(file) << file.error().message;
    return file ? diagnose(file->soup).volume : 0.0;
  }
  Model model_;
  testkit::TemporaryFolder folder_;
};

TEST_F(Export, AMeshIsTheSceneWithoutHiddenSolidsAndCutByTheSection) {
  Looks looks;
  const auto all = run("all.ply", looks);
  ASSERT_TRUE(all) << all.error().message;
  EXPECT_EQ(*all, folder_.file("all.ply") + ": 44 triangles");
  EXPECT_NEAR(volume("all.ply"), 400 - 16 + 27, 1e-5);
  EXPECT_NE(folder_.read("all.ply").find("property uchar red"), std::string::npos);
  looks.hidden = {0, 1};  // the hole
  ASSERT_TRUE(run("filled.stl", looks));
  EXPECT_NEAR(volume("filled.stl"), 400 + 27, 1e-4);
  looks.hidden = {};
  looks.section = csg::SectionPlane{{0, 0, 1}, 1, false};
  looks.ghosts = true;
  looks.selected = 0;
  ASSERT_TRUE(run("low.obj", looks));
  EXPECT_NEAR(volume("low.obj"), 100 - 4 + 9, 1e-5);
  EXPECT_NE(folder_.read("low.mtl").find("newmtl "), std::string::npos);
}

/// Two boxes, parts of an OBJ, one of them red.
constexpr const char* kParts =
    "mtllib two.mtl\n"
    "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 0 0 2\nv 9 0 0\nv 11 0 0\nv 9 2 0\nv 9 0 2\n"
    "o left\nusemtl red\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    "o right\nf 5 7 6\nf 5 6 8\nf 6 7 8\nf 5 8 7\n";

TEST_F(Export, MeshFilesKeepTheirPartsAndColours) {
  const std::string path = folder_.write("two.obj", kParts);
  folder_.write("two.mtl", "newmtl red\nKd 1 0 0\n");
  csg::SceneInput input;
  input.files = {path};
  auto scene = csg::load_scene(input);
  ASSERT_TRUE(scene) << scene.error().message;
  model_ = {};
  model_.scene = *std::move(scene);
  ExportRequest request{arrange(model_, {}), folder_.file("out.obj"), 16, input};
  const auto told = export_what_is_seen(request, {});
  ASSERT_TRUE(told) << told.error().message;
  EXPECT_EQ(told->find(folder_.file("out.obj") + ": 8 triangles, 2 parts"), 0u) << *told;
  const std::string obj = folder_.read("out.obj");
  EXPECT_NE(obj.find("left\n"), std::string::npos) << obj;
  EXPECT_NE(obj.find("right\n"), std::string::npos) << obj;
  EXPECT_NE(folder_.read("out.mtl").find("Kd 1 0 0"), std::string::npos);
  // A colour that was given in the window is that of the whole solid.
  Looks looks;
  looks.colours.emplace(0, glm::vec4(0, 0, 1, 1));
  request.what = arrange(model_, looks);
  ASSERT_TRUE(export_what_is_seen(request, {}));
  EXPECT_EQ(folder_.read("out.mtl").find("Kd 1 0 0"), std::string::npos);
  EXPECT_NE(folder_.read("out.mtl").find("Kd 0 0 1"), std::string::npos);
  // The file is another one by now.
  folder_.write("two.obj", std::string(kParts) + "v 0 0 3\n");
  request.what = arrange(model_, {});
  const auto changed = export_what_is_seen(request, {});
  ASSERT_FALSE(changed);
  EXPECT_EQ(changed.error().code, ErrorCode::kInput);
  EXPECT_NE(changed.error().message.find("has changed since it was read"), std::string::npos);
}

TEST_F(Export, VoxelsAreThoseOfTheGridAroundTheResult) {
  Looks looks;
  looks.hidden = {0, 0, 1};
  const auto all = run("all.npy", looks, 20);
  ASSERT_TRUE(all) << all.error().message;
  // Voxels of half a unit: 20 x 20 x 8 without 4 x 4 x 8.
  EXPECT_EQ(*all, folder_.file("all.npy") + ": 20 x 20 x 8 voxels, 3072 solid");
  EXPECT_GT(folder_.read("all.npy").size(), 3200u);
}

TEST_F(Export, MistakesLeaveNoFile) {
  Looks nothing;
  nothing.hidden = {1, 1, 1};
  for (const char* name : {"a.3mf", "a.vdb"}) {
    if (std::string(name) == "a.vdb" && !export_kind(name)) continue;  // a build without it
    const auto empty = run(name, nothing);
    ASSERT_FALSE(empty) << name;
    EXPECT_EQ(empty.error().code, ErrorCode::kGeometry) << empty.error().message;
  }
  EXPECT_EQ(run("a.step", {}).error().code, ErrorCode::kUsage);
  EXPECT_EQ(run("a.png", {}).error().code, ErrorCode::kUsage);
  EXPECT_EQ(run("none/a.ply", {}).error().code, ErrorCode::kOutput);
  std::stop_source source;
  source.request_stop();
  Execution execution;
  execution.stop = source.get_token();
  for (const char* name : {"a.3mf", "a.npy"}) {
    const auto stopped = run(name, {}, 16, execution);
    ASSERT_FALSE(stopped) << name;
    EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled) << stopped.error().message;
  }
  EXPECT_TRUE(folder_.is_empty());
}

TEST_F(Export, AThreadOfItsOwnTellsHowItEnded) {
  std::atomic<int> woken{0};
  Exporter exporter([&] { ++woken; });
  for (const char* name : {"a.off", "none/a.off"}) {
    exporter.start({arrange(model_, {}), folder_.file(name)}, 1);
    for (int i = 0; i < 3000 && exporter.busy(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    const auto done = exporter.take();
    ASSERT_TRUE(done);
    EXPECT_EQ(done->has_value(), std::string(name) == "a.off");
    EXPECT_FALSE(exporter.take());
  }
  EXPECT_EQ(folder_.names(), std::vector<std::string>{"a.off"});
}

TEST(ExportKind, IsSeenByTheName) {
  EXPECT_EQ(export_kind("a.3mf").value(), ExportKind::kMesh);
  EXPECT_EQ(export_kind("a.OBJ").value(), ExportKind::kMesh);
  EXPECT_EQ(export_kind("a.npy").value(), ExportKind::kVoxels);
  EXPECT_EQ(export_kind("a.PNG").value(), ExportKind::kPicture);
  EXPECT_EQ(export_kind("a.step").error().code, ErrorCode::kUsage);
  EXPECT_EQ(export_files("b/a.obj"), (std::vector<std::string>{"b/a.obj", "b/a.mtl"}));
  EXPECT_EQ(export_files("a.ply"), std::vector<std::string>{"a.ply"});
}

}  // namespace
}  // namespace strata::view
