// What `strata voxelize --sdf` makes.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <string>

#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "strata/voxelize/readers/read_voxels.h"
#include "tests/apps/strata/voxelize_fixture.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::RunResult;

class Distances : public testkit::VoxelizeFixture {
 protected:
  VoxelVolume read(const std::string& name) const {
    auto volume = read_voxels(place.path(name));
    EXPECT_TRUE(volume.has_value()) << volume.error().message;
    return volume ? *std::move(volume) : VoxelVolume{};
  }
  void refuses(std::vector<std::string> arguments, const std::string& message) const {
    arguments.insert(arguments.begin(), "voxelize");
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_NE(run.err.find(message), std::string::npos) << run.err;
    EXPECT_FALSE(place.has("a.vdb"));
  }
  /// The greatest difference from `right`, of voxels nearer than the band.
  template <class Right>
  static double worst(const VoxelVolume& volume, double band, Right&& right) {
    const VoxelGrid& grid = volume.grid();
    double worst = 0;
    for (int k = 0; k < grid.dims.z; ++k) {
      for (int j = 0; j < grid.dims.y; ++j) {
        for (int i = 0; i < grid.dims.x; ++i) {
          const glm::dvec3 at = grid.origin + (glm::dvec3(i, j, k) + 0.5) * grid.voxel_size;
          const double value = volume.values.value(i, j, k);
          worst = std::max(worst, std::abs(value - std::clamp(right(at), -band, band)));
        }
      }
    }
    return worst;
  }
};

double to_box(const glm::dvec3& p, const glm::dvec3& low, const glm::dvec3& high) {
  const glm::dvec3 out = glm::max(low - p, p - high);
  const double inner = std::min(0.0, std::max({out.x, out.y, out.z}));
  return glm::length(glm::max(out, 0.0)) + inner;
}

TEST_F(Distances, AreThoseOfABoxWithABandAround) {
  put("box.obj", make_box({0, 0, 0}, {20, 10, 5}));
  const json found = report({"box.obj", "--voxel-size", "0.5", "--sdf", "-o", "a.vdb"});
  EXPECT_EQ(found["grid"]["dims"], (json{46, 26, 16}));  // 3 voxels of padding
  EXPECT_EQ(found["distances"]["band"], 1.5);
  EXPECT_EQ(found["distances"]["surface"], "mesh");
  const VoxelVolume volume = read("a.vdb");
  EXPECT_EQ(volume.kind, VoxelKind::kDistances);
  EXPECT_EQ(volume.name, "surface");
  EXPECT_LT(worst(volume, 1.5,
                  [](const glm::dvec3& p) {
                    return to_box(p, {0, 0, 0}, {20, 10, 5});
                  }),
            1e-5);
  EXPECT_EQ(found["voxels"]["solid"], 40 * 20 * 10);
  EXPECT_EQ(volume.set.solid_voxels(), 40u * 20 * 10);
  EXPECT_EQ(report({"box.obj", "--voxel-size", "0.5", "--sdf", "--padding", "0", "-o", "b.vdb",
                    "--band", "5.5"})["grid"]["dims"],
            (json{40, 20, 10}));
}

TEST_F(Distances, OfPartsThatOverlapAreThoseToTheirUnion) {
  put("a.obj", make_box({0, 0, 0}, {20, 10, 10}));
  put("b.obj", make_box({15, 0, 0}, {40, 10, 10}));
  put("c.obj", make_box({40, 0, 0}, {50, 10, 10}));  // touches b
  place.write(
      "scene.csg",
      "union() { cube([20, 10, 10]); multmatrix([[1, 0, 0, 15], [0, 1, 0, 0], [0, 0, 1, 0], "
      "[0, 0, 0, 1]]) cube([35, 10, 10]); }\n");
  const auto right = [](const glm::dvec3& p) { return to_box(p, {0, 0, 0}, {50, 10, 10}); };
  for (const std::vector<std::string>& input :
       {std::vector<std::string>{"a.obj", "b.obj", "c.obj"}, {"scene.csg"}}) {
    std::vector<std::string> arguments = input;
    for (const char* word : {"--voxel-size", "1", "--sdf", "-o", "a.vdb"})
      arguments.push_back(word);
    const json found = report(arguments);
    EXPECT_EQ(found["distances"]["surface"], "boundary");
    EXPECT_LT(worst(read("a.vdb"), 3.0, right), 1e-5);
  }
  // Boxes that touch.
  EXPECT_EQ(report({"b.obj", "c.obj", "--voxel-size", "1", "--sdf"})["distances"]["surface"],
            "boundary");
  // A notch is no overlap, though rays along its edge leave and enter at once.
  place.write("notch.csg",
              "difference() { cube([20, 10, 10]); multmatrix([[0.7, 0, 0.7, 10], [0, 1, 0, 0], "
              "[-0.7, 0, 0.7, 10], [0, 0, 0, 1]]) cube([5, 40, 5], center = true); }\n");
  ASSERT_EQ(place.run({"mesh", "notch.csg", "-o", "notch.obj"}).exit_code, 0);
  EXPECT_EQ(report({"notch.obj", "-r", "200", "--sdf"})["distances"]["surface"], "mesh");
}

TEST_F(Distances, OfPartsThatTouchOrOverlapAlongAnAxisAreThoseToTheirUnion) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double begin : {2.0, 1.5}) {  // they touch; they overlap
      glm::dvec3 middle(4, 4, 4), start(0, 0, 0);
      middle[axis] = 2.0, start[axis] = begin;
      TriangleSoup both = make_box({0, 0, 0}, middle);
      append(both, make_box(start, {4, 4, 4}));
      put("both.obj", both);
      const json found = report({"both.obj", "--voxel-size", "0.25", "--sdf", "-o", "a.vdb"});
      EXPECT_EQ(found["distances"]["surface"], "boundary") << axis << ' ' << begin;
      EXPECT_LT(worst(read("a.vdb"), 0.75,
                      [](const glm::dvec3& p) {
                        return to_box(p, {0, 0, 0}, {4, 4, 4});
                      }),
                1e-5);
    }
  }
}

TEST_F(Distances, OfAllVoxelsGoIntoArrays) {
  put("ball.obj", make_icosphere(10.0, 4));
  const json found = report({"ball.obj", "-r", "40", "--sdf", "--band", "all", "-o", "a.nrrd"});
  const VoxelVolume volume = read("a.nrrd");
  EXPECT_LT(worst(volume, 1e9, [](const glm::dvec3& p) { return glm::length(p) - 10.0; }), 0.05);
  EXPECT_EQ(found["distances"]["band"], 0.0);
  EXPECT_EQ(found["distances"]["band_voxels"], 46 * 46 * 46);
  EXPECT_NEAR(found["distances"]["least"].get<double>(), -10.0, 0.7);
}

TEST_F(Distances, OfACutMeshAndOfCavitiesHaveTheSolidsSigns) {
  TriangleSoup ball = make_icosphere(10.0, 3), cavity = make_icosphere(6.0, 3);
  reverse_orientation(cavity);
  append(ball, cavity);
  put("ball.obj", ball);
  const std::vector<std::string> grid{"--voxel-size", "0.5", "--bounds", "-4,-12,-12,3,9,12"};
  std::vector<std::string> solid{"voxelize", "ball.obj", "-o", "solid.npy"};
  std::vector<std::string> sdf{"voxelize", "ball.obj", "--sdf", "-o", "sdf.npy"};
  solid.insert(solid.end(), grid.begin(), grid.end());
  sdf.insert(sdf.end(), grid.begin(), grid.end());
  ASSERT_EQ(place.run(solid).exit_code, 0);
  ASSERT_EQ(place.run(sdf).exit_code, 0);
  const VoxelVolume inside = read("solid.npy"), distances = read("sdf.npy");
  ASSERT_EQ(inside.grid().dims, distances.grid().dims);
  int wrong = 0;
  std::uint64_t solid_voxels = 0;
  const glm::ivec3 dims = inside.grid().dims;
  for (int k = 0; k < dims.z; ++k) {
    for (int j = 0; j < dims.y; ++j) {
      for (int i = 0; i < dims.x; ++i) {
        const bool is_solid = inside.set.contains(i, j, k);
        solid_voxels += is_solid;
        wrong += is_solid != (distances.values.value(i, j, k) < 0);
      }
    }
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(solid_voxels, 1000u);
}

TEST_F(Distances, RefusesWhatDoesNotFit) {
  put("box.obj", make_box({0, 0, 0}, {20, 10, 5}));
  for (const char* other : {"--ids", "--fog", "--mask", "--surface"}) {
    refuses({"box.obj", "-r", "8", "--sdf", other, "-o", "a.vdb"}, "--sdf cannot be combined with");
  }
  refuses({"box.obj", "-r", "8", "--band", "4", "-o", "a.vdb"}, "--band needs --sdf");
  refuses({"box.obj", "-r", "8", "--sdf", "--band", "0", "-o", "a.vdb"},
          "--band must be 0.5 to 1024, or all, got 0");
  refuses({"box.obj", "-r", "8", "--sdf", "--band", "wide", "-o", "a.vdb"}, "wide");
  refuses({"box.obj", "-r", "8", "--sdf", "--band", "all", "-o", "a.vdb"}, "--band all");
  refuses({"box.obj", "-r", "8", "--sdf", "-o", "a.binvox"}, "format binvox holds no distances");
  refuses({"box.obj", "-r", "8", "--sdf", "--axis", "z", "-o", "a.vdb"},
          "--sdf needs rays along x");
  refuses({"box.obj", "--voxel-size", "1,1,2", "--sdf", "-o", "a.vdb"}, "cubes, got 1 x 1 x 2");
}

}  // namespace
}  // namespace strata
