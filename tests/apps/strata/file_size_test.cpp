// The size of a file that --dry-run says, against the file that is written.

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>

#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "tests/apps/strata/voxelize_fixture.h"

namespace strata {
namespace {

using nlohmann::json;

class FileSize : public testkit::VoxelizeFixture {
 protected:
  struct Sizes {
    double said = 0, real = 0;
    bool exact = false;
  };

  /// Of a dry run and of a real one.
  Sizes sizes(std::vector<std::string> arguments, const std::string& output) const {
    arguments.insert(arguments.end(), {"-o", output});
    const auto real = report(arguments);
    EXPECT_FALSE(real.contains("file_size"));
    Sizes result;
    const std::filesystem::path path = place.path(output);
    if (std::filesystem::is_directory(path)) {
      for (const auto& entry : std::filesystem::recursive_directory_iterator(path)) {
        if (entry.is_regular_file()) result.real += static_cast<double>(entry.file_size());
      }
    } else {
      result.real = static_cast<double>(std::filesystem::file_size(path));
    }
    std::filesystem::remove_all(path);
    arguments.emplace_back("--dry-run");
    const json dry = report(arguments)["file_size"];
    result.said = dry["bytes"].get<double>();
    result.exact = dry["exact"].get<bool>();
    EXPECT_FALSE(place.has(output));
    return result;
  }

  /// Expects that no file is larger than what was said. @return the largest said / real
  double holds(const std::vector<std::string>& arguments, const std::string& output) const {
    const Sizes size = sizes(arguments, output);
    EXPECT_GT(size.real, 0) << output;
    EXPECT_GE(size.said, size.real) << arguments[0] << " " << output;
    if (size.exact) {
      EXPECT_EQ(size.said, size.real) << output;
    }
    return size.said / size.real;
  }
};

constexpr const char* kOutputs[] = {"a.vdb", "a.npy",    "a.npz", "a.nrrd",
                                    "a.vti", "a.binvox", "a.vox", "a.zarr"};

TEST_F(FileSize, HoldsForEveryFormatAndKindOfSolid) {
  put("ball.obj", make_icosphere(10.0, 4));
  put("small.obj", make_icosphere(1.0, 1));
  put("box.obj", make_box({0, 0, 0}, {7, 8, 9}));  // faces and edges on the grid's sides
  TriangleSoup rods;
  for (int i = 0; i < 12; ++i) append(rods, make_box({0, 2 * i, 0}, {24, 2 * i + 1.03, 1.1}));
  put("rods.obj", rods);
  place.write("scene.csg",
              "difference() { cube([20, 20, 20], center = true); rotate([30, 40, 50]) "
              "cube([30, 9, 9], center = true); color(\"red\") cylinder(h = 30, r = 3, center = "
              "true); }\n");
  for (const char* input : {"ball.obj", "small.obj", "box.obj", "rods.obj", "scene.csg"}) {
    for (const char* output : kOutputs) {
      holds({input, "-r", "37"}, output);
      holds({input, "-r", "70", "--surface"}, output);
    }
    holds({input, "-r", "65"}, "slices/");
    holds({input, "-r", "130", "--fog"}, "a.vdb");
    holds({input, "-r", "130", "--mask"}, "a.vdb");
    for (const char* output : {"a.vdb", "a.npy", "a.npz", "a.nrrd", "a.vti", "a.zarr"}) {
      holds({input, "-r", "37", "--sdf"}, output);
      holds({input, "-r", "60", "--coverage=4"}, output);
      holds({input, "-r", "30", "--coverage=2", "--floats"}, output);
    }
    holds({input, "-r", "60"}, "a.sl1");
    holds({input, "-r", "60", "--display", "90x130"}, "a.sl1");
    holds({input, "-r", "60", "--grey", "--slice-axis", "x"}, "slices/");
    holds({input, "-r", "20", "--sdf", "--band", "all"}, "a.npz");
  }
}

TEST_F(FileSize, HoldsForIdsPartsOfSolidsAndOpenMeshes) {
  place.write(
      "scene.csg",
      "union() { sphere(r = 9, $fn = 50); translate([8, 0, 0]) cube([9, 9, 9]); "
      "translate([0, 9, 0]) rotate([20, 0, 0]) cylinder(h = 20, r = 4, center = true); }\n");
  TriangleSoup open = make_icosphere(10.0, 3);
  open.triangles.resize(open.triangles.size() - 200);
  put("open.obj", open);
  for (const char* output : kOutputs) {
    holds({"open.obj", "-r", "60"}, output);
    holds({"open.obj", "-r", "60", "--open", "surface"}, output);
    holds({"scene.csg", "--voxel-size", "0.2", "--bounds=0,0,0,9,9,5"}, output);
    if (std::string(output) == "a.binvox") continue;
    holds({"scene.csg", "-r", "90", "--ids"}, output);
  }
  holds({"scene.csg", "-r", "90", "--ids"}, "slices/");
}

TEST_F(FileSize, IsNearWhereTheSurfaceDecides) {
  put("ball.obj", make_icosphere(10.0, 5));
  const std::vector<std::string> arguments{"ball.obj", "-r", "256"};
  EXPECT_LT(holds(arguments, "a.vdb"), 4);
  EXPECT_LT(holds(arguments, "a.nrrd"), 6);
  EXPECT_LT(holds(arguments, "a.vti"), 6);
  EXPECT_LT(holds(arguments, "a.binvox"), 6);
  EXPECT_EQ(holds(arguments, "a.npy"), 1);
  EXPECT_LT(holds(arguments, "a.sl1"), 3);
  EXPECT_LT(holds({"ball.obj", "-r", "256", "--display", "400x300"}, "a.sl1"), 3);
  EXPECT_LT(holds({"ball.obj", "-r", "256", "--coverage"}, "a.nrrd"), 4);
}

TEST_F(FileSize, IsInTheTextOfADryRun) {
  put("box.obj", make_box({0, 0, 0}, {1, 1, 1}));
  auto run = place.run({"voxelize", "box.obj", "-r", "4000", "-o", "a.npy", "--dry-run"});
  EXPECT_NE(run.out.find("output    a.npy: npy, 64 GB\n"), std::string::npos) << run.out;
  run = place.run({"voxelize", "box.obj", "-r", "400", "-o", "a.vdb", "--dry-run"});
  EXPECT_NE(run.out.find("output    a.vdb: vdb, at most "), std::string::npos) << run.out;
  run = place.run({"voxelize", "box.obj", "-r", "400", "--dry-run"});
  EXPECT_EQ(run.out.find("output "), std::string::npos) << run.out;
}

}  // namespace
}  // namespace strata
