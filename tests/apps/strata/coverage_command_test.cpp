// The filled fraction of voxels on the command line, and pictures for printers.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "strata/mesh/shapes.h"
#include "tests/apps/strata/voxelize_fixture.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::RunResult;

class CoverageCommand : public testkit::VoxelizeFixture {};

TEST_F(CoverageCommand, SaysTheVolumeOfTheMeshAndTheVoxelsOfTheSolid) {
  put("ball.obj", make_icosphere(1.0, 4));
  const json solid = report({"ball.obj", "-r", "30", "--checksum"});
  double error = 1;
  for (const char* rays : {"1", "4", "16"}) {
    json found = report({"ball.obj", "-r", "30", "--checksum", std::string("--coverage=") + rays});
    const double volume = found["input"]["volume"];
    const json coverage = found["voxels"]["coverage"];
    EXPECT_EQ(std::to_string(coverage["rays"].get<int>()), rays);
    const double now = std::abs(coverage["volume"].get<double>() / volume - 1);
    EXPECT_LT(now, error / 4) << rays;
    error = now;
    found["voxels"].erase("coverage");
    EXPECT_EQ(found["voxels"], solid["voxels"]);
  }
  EXPECT_LT(error, 1e-4);
}

TEST_F(CoverageCommand, OfASceneIsThatOfItsResult) {
  place.write("scene.csg",
              "difference() { cube([4, 4, 4]); "
              "multmatrix([[1, 0, 0, 1.1], [0, 1, 0, -1], [0, 0, 1, 1.3], [0, 0, 0, 1]]) "
              "cube([1.5, 9, 1.25]); }");
  const json found = report({"scene.csg", "--voxel-size", "0.5", "--coverage=16", "-o", "a.npy"});
  // Walls across the rays, along x, are exact; the others are off by 1 / 32 of a voxel at most.
  EXPECT_NEAR(found["voxels"]["coverage"]["volume"].get<double>(), 64 - 1.5 * 4 * 1.25,
              1.5 * 4 / 32);
  EXPECT_TRUE(found["warnings"].empty());
}

TEST_F(CoverageCommand, HasTheTypesOfItsFormats) {
  put("box.obj", make_box({0, 0, 0}, {2.25, 1, 1}));
  const std::vector<std::string> size = {"box.obj", "--voxel-size", "1", "-o", "a.npy"};
  auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), size.begin(), size.end());
    (void)report(more);
    return place.read("a.npy");
  };
  const std::string bytes = with({"--coverage"});
  EXPECT_NE(bytes.find("'|u1'"), std::string::npos);
  EXPECT_EQ(bytes.substr(bytes.size() - 3), "\xff\xff\x40");  // a fourth of 255 is 63.75
  const std::string floats = with({"--coverage=2", "--floats"});
  EXPECT_NE(floats.find("'<f4'"), std::string::npos);
  float last = 0;
  std::memcpy(&last, floats.data() + floats.size() - sizeof last, sizeof last);
  EXPECT_EQ(last, 0.25f);
}

TEST_F(CoverageCommand, AnSl1HasTheSameBytesForAnyNumberOfThreads) {
  put("knot.obj", make_torus_knot(2, 3, 0.4, 96, 16));
  const json found = report({"knot.obj", "-r", "150", "-j", "1", "-o", "a.sl1"});
  EXPECT_EQ(found["output"]["format"], "sl1");
  EXPECT_EQ(found["voxels"]["coverage"]["rays"], 8);
  const std::string bytes = place.read("a.sl1");
  (void)report({"knot.obj", "-r", "150", "-j", "3", "--memory-limit", "100M", "-o", "a.sl1"});
  EXPECT_EQ(place.read("a.sl1"), bytes);
}

TEST_F(CoverageCommand, RefusesWhatHasNoFractionsOrPictures) {
  put("box.obj", make_box({0, 0, 0}, {2, 1, 1}));
  TriangleSoup open = make_box({0, 0, 0}, {2, 1, 1});
  open.triangles.pop_back();
  put("open.obj", open);
  const auto refuses = [&](std::vector<std::string> arguments, const std::string& word) {
    arguments.insert(arguments.begin(), "voxelize");
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 2) << arguments.back() << run.err;
    EXPECT_NE(run.err.find(word), std::string::npos) << run.err;
    EXPECT_FALSE(place.has("a.npy") || place.has("a.sl1") || place.has("a"));
  };
  refuses({"box.obj", "--coverage=3", "-o", "a.npy"}, "1, 2, 4, 8 or 16, got 3");
  refuses({"box.obj", "--coverage=32", "-o", "a.npy"}, "got 32");
  refuses({"box.obj", "--coverage", "--ids", "-o", "a.npy"}, "--coverage cannot be combined with");
  refuses({"box.obj", "--coverage", "--fog", "-o", "a.vdb"}, "--fog");
  refuses({"box.obj", "--coverage", "--surface", "-o", "a.npy"}, "no filled fraction");
  refuses({"box.obj", "--coverage", "--solid", "--surface", "-o", "a.npy"}, "--surface");
  refuses({"box.obj", "--coverage", "-o", "a.binvox"}, "format binvox holds no");
  refuses({"box.obj", "--coverage", "-o", "a.vox"}, "format vox holds no");
  refuses({"open.obj", "--coverage", "--open", "surface", "-o", "a.npy"}, "keeps only the surface");
  refuses({"box.obj", "--floats", "-o", "a.npy"}, "--floats needs --coverage");
  refuses({"box.obj", "--floats", "-o", "a.sl1"}, "8 bits");
  refuses({"box.obj", "--grey", "-o", "a.npy"}, "--grey needs pictures");
  refuses({"box.obj", "--flip", "x", "-o", "a.npy"}, "--flip needs pictures");
  refuses({"box.obj", "--flip", "z", "-o", "a.sl1"}, "--flip");
  refuses({"box.obj", "--slice-axis", "x", "-o", "a.sl1"}, "--slice-axis must be z");
  refuses({"box.obj", "--gamma", "2", "--format", "png", "-o", "a"}, "--gamma needs --grey");
  refuses({"box.obj", "--gamma", "11", "-o", "a.sl1"}, "0 to 10, got 11");
  refuses({"box.obj", "--display", "9x9", "--format", "png", "-o", "a"}, "needs an .sl1");
  refuses({"box.obj", "--display", "9", "-o", "a.sl1"}, "1440x2560");
  refuses({"box.obj", "--display", "255x300", "-o", "a.sl1"}, "256 x 128");
  refuses({"box.obj", "--exposure", "0", "-o", "a.sl1"}, "got 0");
}

}  // namespace
}  // namespace strata
