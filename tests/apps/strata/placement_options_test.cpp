// --unit, --up, --scale and --translate of every command that reads meshes.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/apps/strata/voxelize_fixture.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::RunResult;

/// An L of 4 x 2 x 1 with its foot to the right, and a box of 2 x 2 x 2 from (1, 1, 1).
class PlacementOptions : public testkit::VoxelizeFixture {
 protected:
  void SetUp() override {
    place.write("l.off",
                "OFF\n12 8 0\n0 0 0\n4 0 0\n4 1 0\n1 1 0\n1 2 0\n0 2 0\n0 0 1\n4 0 1\n4 1 1\n1 1 "
                "1\n1 2 1\n0 2 1\n6 5 4 3 2 1 0\n6 6 7 8 9 10 11\n4 0 1 7 6\n4 1 2 8 7\n4 2 3 9 "
                "8\n4 3 4 10 9\n4 4 5 11 10\n4 5 0 6 11\n");
    place.write(
        "box.off",
        "OFF\n8 6 0\n1 1 1\n3 1 1\n1 3 1\n3 3 1\n1 1 3\n3 1 3\n1 3 3\n3 3 3\n4 0 2 3 1\n4 4 "
        "5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n");
    place.write("tiny.off",
                "OFF\n4 4 0\n0 0 0\n0.02 0 0\n0 0.02 0\n0 0 0.02\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 "
                "3\n");
    place.write("s.csg", "cube(size = [1, 2, 3], center = false);\n");
  }
  json bounds(const std::vector<std::string>& arguments) const {
    return report(arguments)["input"]["bounds"];
  }
  void refuses(const std::vector<std::string>& options, const std::string& text) const {
    std::vector<std::string> arguments = {"voxelize", "l.off", "--stats"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 2) << text;
    EXPECT_NE(run.err.find(text), std::string::npos) << run.err;
  }
};

TEST_F(PlacementOptions, BoundsAreInTheWorldAfterThePlacement) {
  const json found = report({"l.off", "--up", "y", "--scale", "2,1,3", "--translate", "10,20,30",
                             "--voxel-size", "0.5", "--bounds", "9,18,29,19,21,37"});
  // (x, y, z) becomes (10 + 2 x, 20 - z, 30 + 3 y).
  EXPECT_EQ(found["input"]["bounds"]["low"], (json{10.0, 19.0, 30.0}));
  EXPECT_EQ(found["input"]["bounds"]["high"], (json{18.0, 20.0, 36.0}));
  EXPECT_EQ(found["grid"]["dims"], (json{20, 6, 16}));
  EXPECT_EQ(found["voxels"]["volume"], 5.0 * 2 * 1 * 3);
}

TEST_F(PlacementOptions, SeveralFilesIdsAndExpressionsAreMovedAlike) {
  const json two = report({"l.off", "box.off", "--scale", "-2", "--voxel-size", "0.25", "--ids"});
  EXPECT_EQ(two["input"]["bounds"]["low"], (json{-8.0, -6.0, -6.0}));
  EXPECT_EQ(two["ids"][0]["voxels"], 5 * 8 * 64);
  EXPECT_EQ(two["ids"][1]["voxels"], 8 * 8 * 64);
  // The box holds 1 x 1 of the foot's top only by touching it, so nothing is cut.
  const RunResult cut = place.run({"csg", "l.off", "box.off", "--expr", "l + box", "--translate",
                                   "5,0,0", "--scale", "2", "--json"});
  ASSERT_EQ(cut.exit_code, 0) << cut.err;
  const json measured = json::parse(cut.out);
  EXPECT_NEAR(measured["result"]["volume"], 8.0 * (5 + 8), 1e-6);
  EXPECT_EQ(measured["result"]["low"], (json{5.0, 0.0, 0.0}));
}

TEST_F(PlacementOptions, ScenesAreMovedToo) {
  const json found = report({"s.csg", "--scale", "2,2,-2", "--translate", "1,0,0", "-r", "12"});
  EXPECT_EQ(found["input"]["bounds"]["low"], (json{1.0, 0.0, -6.0}));
  EXPECT_EQ(found["input"]["bounds"]["high"], (json{3.0, 4.0, 0.0}));
  EXPECT_EQ(found["voxels"]["volume"], 48.0);
}

TEST_F(PlacementOptions, InfoTellsOfThePlacedMesh) {
  const RunResult run = place.run({"info", "l.off", "--json", "--scale", "1,1,-2", "--unit", "cm"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json file = json::parse(run.out)["files"][0];
  EXPECT_EQ(file["bounds"]["low"], (json{0.0, 0.0, -2.0}));
  EXPECT_NEAR(file["volume"], 10.0, 1e-12);
  EXPECT_EQ(file["inverted"], false);
  EXPECT_EQ(
      file["unit"],
      (json{
          {"file_metres", nullptr}, {"world_metres", 0.01}, {"factor", 1.0}, {"doubt", nullptr}}));
  const RunResult text = place.run({"info", "l.off", "--unit", "cm"});
  EXPECT_NE(text.out.find("unit         the centimetre; the file says nothing about units"),
            std::string::npos)
      << text.out;
}

TEST_F(PlacementOptions, AnUnlikelySizeIsAFactOfTheReportAndNoWarning) {
  const json found = report({"tiny.off", "-r", "16", "--strict"});
  EXPECT_TRUE(found["warnings"].empty());
  const std::string doubt = found["input"]["files"][0]["unit"]["doubt"];
  EXPECT_NE(doubt.find("0.02 long; the file says nothing about units"), std::string::npos) << doubt;
  const RunResult info = place.run({"info", "tiny.off", "--strict"});
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_NE(info.out.find("not known: 0.02 long"), std::string::npos) << info.out;
  EXPECT_EQ(place.run({"info", "l.off"}).out.find("unit"), std::string::npos);
  EXPECT_TRUE(report({"l.off", "-r", "16"})["input"]["files"][0]["unit"]["doubt"].is_null());
}

TEST_F(PlacementOptions, AMeshIsWrittenInTheWorldsUnit) {
  const RunResult made =
      place.run({"mesh", "l.off", "--unit", "in", "--translate", "1,0,0", "-o", "a.3mf"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const RunResult info = place.run({"info", "a.3mf"});
  EXPECT_EQ(info.exit_code, 0) << info.err;
  const RunResult moved = place.run({"mesh", "l.off", "--translate", "1,0,0", "-o", "a.stl"});
  ASSERT_EQ(moved.exit_code, 0) << moved.err;
  EXPECT_EQ(bounds({"a.stl", "-r", "8"})["low"], (json{1.0, 0.0, 0.0}));
}

TEST_F(PlacementOptions, DepthListsAndPicturesMoveToo) {
  EXPECT_EQ(place.run({"ldi", "l.off", "-r", "8", "--scale", "2", "-o", "a.npz"}).exit_code, 0);
  const RunResult drawn = place.run({"csg", "l.off", "-o", "a.png", "--size", "64,64"});
  ASSERT_EQ(drawn.exit_code, 0) << drawn.err;
  ASSERT_EQ(
      place.run({"picture", "l.off", "-o", "b.png", "--size", "64,64", "--scale", "2"}).exit_code,
      0);
  ASSERT_EQ(place.run({"oit", "l.off", "-o", "c.png", "--size", "64,64", "--up", "y"}).exit_code,
            0);
  EXPECT_EQ(place.run({"voxelize", "l.off", "-r", "8", "-o", "v.npy"}).exit_code, 0);
  const RunResult voxels = place.run({"picture", "v.npy", "-o", "d.png", "--scale", "2"});
  EXPECT_EQ(voxels.exit_code, 2);
  EXPECT_NE(voxels.err.find("--scale"), std::string::npos) << voxels.err;
}

TEST_F(PlacementOptions, BadNumbersAreNamed) {
  refuses({"--scale", "0,1,1"}, "--scale must not be 0, got 0,1,1");
  refuses({"--scale", "0"}, "--scale must not be 0, got 0");
  refuses({"--scale", "1,2"}, "--scale must be 1 or 3 numbers, got 2: '1,2'");
  refuses({"--scale", "x"}, "--scale");
  refuses({"--scale", "nan"}, "--scale");
  refuses({"--translate", "1,2"}, "--translate");
  refuses({"--translate", "1,2,inf"}, "--translate");
  refuses({"--up", "x"}, "--up must be");
  refuses({"--unit", "mile"}, "--unit must be");
  for (const char* scale : {"1e308", "1e120", "1e-200", "1,1,-1e16"}) {
    refuses({"--scale", scale},
            std::string("--scale must be 1e-15 to 1e+15, or negative, got ") + scale);
  }
  refuses({"--translate", "0,1e16,0"}, "--translate must be -1e+15 to 1e+15, got 0,1e16,0");
  refuses({"--scale", "1,2"}, "--scale must be 1 or 3 numbers");
}

TEST_F(PlacementOptions, MeshesWhoseVolumeIsBeyondDoubleAreRefused) {
  place.write("far.off",
              "OFF\n4 4 0\n0 0 0\n1e120 0 0\n0 1e120 0\n0 0 1e120\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 "
              "2 3\n");
  for (const auto& command : {std::vector<std::string>{"info", "far.off"},
                              std::vector<std::string>{"voxelize", "far.off", "-r", "8"}}) {
    const RunResult run = place.run(command);
    EXPECT_EQ(run.exit_code, 5) << command[0] << run.err;
    EXPECT_NE(run.err.find("far.off: the mesh is 1e+120 long"), std::string::npos) << run.err;
  }
  const RunResult small = place.run({"info", "far.off", "--scale", "1e-15"});
  EXPECT_EQ(small.exit_code, 5) << "still too large";
}

}  // namespace
}  // namespace strata
