// Files of voxels in the window, under Xvfb.

#include <gtest/gtest.h>

#include <string>

#include "tests/apps/view/window_fixture.h"

namespace strata::testkit {
namespace {

class Voxels : public Window {
 protected:
  void SetUp() override {
    Window::SetUp();
    if (IsSkipped()) return;
    // An L, so that no mirror image is the same: x to 20 at z < 10, and x < 5 up to z = 20.
    place_.write("l.csg", "union() { cube([20, 10, 10]); cube([5, 10, 20]); }\n");
    ASSERT_EQ(place_.run({"voxelize", "l.csg", "--voxel-size", "1", "-o", "l.vdb"}).exit_code, 0);
    ASSERT_EQ(
        place_.run({"voxelize", "l.csg", "--voxel-size", "1", "--ids", "-o", "l.npz"}).exit_code,
        0);
  }
  RunResult window(const std::string& file, const std::string& script) {
    place_.write("drive.txt", script + "quit\n");
    return place_.run({"view", file, "--script", "drive.txt", "--size", "600,600", "--no-panels"},
                      options());
  }
};

TEST_F(Voxels, ArePickedAsTheFileCountsThem) {
  // From the front: x to the right, z up; the eye sees faces at y = 0.
  const RunResult run = window("l.vdb",
                               "projection ortho\ncamera 10,0,10,90,0,0,100\naxes off\n"
                               "pick 300 350\npick 500 100\nsection y=4.5\nkey i\npick 300 350\n");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("pick 300 350: voxel ("), std::string::npos) << run.out;
  EXPECT_NE(run.out.find(", 0, "), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("pick 500 100: nothing"), std::string::npos) << run.out;
}

TEST_F(Voxels, SlicesShowOnePlaneUpright) {
  const RunResult run = window("l.vdb",
                               "slice y=5.5\npicture y.png\npick 100 100\npick 500 100\n"
                               "slice k=15\npicture k.png\nslice off\npicture solid.png\n"
                               "voxels xray\npicture xray.png\n");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  // x to the right, z up: the upper left corner is solid, the upper right one is empty.
  EXPECT_NE(run.out.find("solid"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("empty"), std::string::npos) << run.out;
  const Image y = image_of(place_, "y.png"), k = image_of(place_, "k.png");
  EXPECT_FALSE(std::equal(y.at(100, 100), y.at(100, 100) + 3, y.at(500, 100)));
  EXPECT_TRUE(std::equal(y.at(100, 500), y.at(100, 500) + 3, y.at(500, 500)));
  EXPECT_GT(different(y, k, 600, 600), 10000);
  const Image solid = image_of(place_, "solid.png"), xray = image_of(place_, "xray.png");
  EXPECT_GT(different(solid, xray, 600, 600), 10000);
}

TEST_F(Voxels, MistakesSayWhatMustBe) {
  RunResult run = window("l.vdb", "slice k=99\n");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("drive.txt:1: the slice must be k=0 to k=19, got k=99"), std::string::npos)
      << run.err;
  run = window("l.vdb", "threshold 0.5\n");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("these voxels have no values, but are mask"), std::string::npos)
      << run.err;
  run = window("part.csg", "slice k=1\n");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("drive.txt:1: slice needs a file of voxels"), std::string::npos)
      << run.err;
  place_.write("broken.vdb", "no vdb");
  run = window("broken.vdb", "picture a.png\n");
  EXPECT_NE(run.exit_code, 0);
  EXPECT_NE(run.err.find("broken.vdb: byte 0"), std::string::npos) << run.err;
}

TEST_F(Voxels, WhatNeedsSurfacesIsRefused) {
  for (const std::string command : {"distance 300 300 310 310", "size 300 300", "edges on",
                                    "heat wall", "opacity 0.5", "colour all red"}) {
    const RunResult run = window("l.vdb", command + "\n");
    EXPECT_EQ(run.exit_code, 2) << command;
    const std::string name = command.substr(0, command.find(' '));
    EXPECT_NE(run.err.find("drive.txt:1: " + name +
                           " needs the surfaces of a mesh or scene, but "
                           "what is shown is a file of voxels"),
              std::string::npos)
        << run.err;
  }
  // Keys tell, and what is off may be turned off.
  const RunResult told = window("l.vdb",
                                "edges off\nghosts off\nheat off\nopacity off\naxes off\n"
                                "screenshot quiet.png\nkey t\nwait 0.3\nscreenshot told.png\n");
  ASSERT_EQ(told.exit_code, 0) << told.err;
  EXPECT_GT(different(image_of(place_, "quiet.png"), image_of(place_, "told.png"), 600, 600), 500);
  for (const char* option : {"--edges", "--ghosts", "--heat=wall"}) {
    const RunResult run = place_.run({"view", "l.vdb", option, "--screenshot", "a.png"}, options());
    EXPECT_EQ(run.exit_code, 2) << option;
    EXPECT_NE(run.err.find("needs meshes or scenes, but l.vdb is a file of voxels"),
              std::string::npos)
        << run.err;
  }
}

TEST_F(Voxels, SlicesAreUndone) {
  const RunResult run =
      window("l.vdb",
             "axes off\npicture a.png\nslice k=5\npicture b.png\nslice k=15\npicture c.png\n"
             "voxels xray\npicture d.png\nundo\npicture c2.png\nundo\npicture b2.png\nundo\n"
             "picture a2.png\nredo\nredo\nredo\npicture d2.png\n");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const std::string one : {"a", "b", "c", "d"}) {
    EXPECT_EQ(image_of(place_, one + ".png"), image_of(place_, one + "2.png")) << one;
  }
  EXPECT_NE(image_of(place_, "b.png"), image_of(place_, "c.png"));
}

TEST_F(Voxels, NumbersAreThoseOfTheThreshold) {
  RunResult run = window("l.vdb", "numbers\n");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("\"size_x\": 20"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("\"volume\": 2500"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("\"voxels\": 2500"), std::string::npos) << run.out;
  // Values 0.25 to 3.25 along x: as many columns of 2 x 2 voxels are above a threshold.
  std::string bytes;
  for (int i = 0; i < 16; ++i) {
    const float value = static_cast<float>(i % 4) + 0.25f;
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  place_.write("v.nrrd",
               "NRRD0004\ntype: float\nendian: little\ndimension: 3\nsizes: 4 2 2\n"
               "encoding: raw\n\n" +
                   bytes);
  run = window("v.nrrd", "threshold 0.5\nnumbers\nthreshold 2.5\nbox on\nnumbers\n");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("\"voxels\": 12"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("\"voxels\": 4"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("\"size_x\": 1,"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("box: 1 x 2 x 2"), std::string::npos) << run.out;
}

TEST_F(Voxels, AreExportedInAnotherFormatAndThresholdsDecide) {
  ASSERT_EQ(
      place_.run({"voxelize", "l.csg", "--voxel-size", "0.7", "--fog", "-o", "fog.vdb"}).exit_code,
      0);
  const RunResult run = window("fog.vdb",
                               "picture half.png\nexport half.npy\nthreshold 0\nexport any.npy\n"
                               "threshold file\nexport again.npy\n");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string half = place_.read("half.npy"), any = place_.read("any.npy");
  EXPECT_EQ(half, place_.read("again.npy"));
  EXPECT_EQ(half.size(), any.size());
  EXPECT_NE(half, any);
  const RunResult told = place_.run({"info", "half.npy"});
  EXPECT_EQ(told.exit_code, 0);
  EXPECT_NE(told.out.find("npy, mask of bool"), std::string::npos) << told.out;
  EXPECT_EQ(window("fog.vdb", "export a.stl\n").exit_code, 2);
}

TEST_F(Voxels, IdsHaveTheirColours) {
  place_.write("two.csg",
               "cube([10, 10, 10]); multmatrix([[1,0,0,10],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) "
               "{ cube([10, 10, 10]); }\n");
  ASSERT_EQ(
      place_.run({"voxelize", "two.csg", "--voxel-size", "1", "--ids", "-o", "two.nrrd"}).exit_code,
      0);
  const RunResult run =
      window("two.nrrd", "slice z=5\npicture ids.png\npick 150 300\npick 450 300\n");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("label 1"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("label 2"), std::string::npos) << run.out;
  const Image ids = image_of(place_, "ids.png");
  EXPECT_FALSE(std::equal(ids.at(150, 300), ids.at(150, 300) + 3, ids.at(450, 300)));
}

}  // namespace
}  // namespace strata::testkit
