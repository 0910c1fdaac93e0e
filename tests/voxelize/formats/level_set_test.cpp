// Level sets as OpenVDB's tools take them, and distances in all formats that hold them.

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Diagnostics.h>
#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <bit>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "strata/voxelize/distance/signed_distance.h"
#include "strata/voxelize/formats/voxel_writer.h"
#include "strata/voxelize/readers/read_voxels.h"
#include "tests/support/temporary_folder.h"

namespace strata {
namespace {

using testkit::TemporaryFolder;

constexpr double kMajor = 1.0, kMinor = 0.45;

TriangleSoup torus() { return make_torus(kMajor, kMinor, 120, 60); }

VoxelGrid cubes(const glm::ivec3& dims, double size, const glm::dvec3& origin) {
  return {dims, origin, glm::dvec3(size)};
}
const VoxelGrid kTorusGrid = cubes({101, 97, 39}, 0.031, {-1.57, -1.5, -0.6});

void write(const TriangleSoup& mesh, const VoxelGrid& grid, const std::string& path,
           int threads = 2) {
  VoxelWriterOptions options;
  options.band = static_cast<float>(band_in_world(grid, 3));
  auto writer = open_voxel_writer(path, "", grid, options);
  ASSERT_TRUE(writer.has_value()) << writer.error().message;
  const Execution execution{.threads = threads};
  const auto made =
      signed_distance_slabs(mesh, grid, {}, execution, [&](const ScalarField& layers, int z) {
        return (*writer)->add_distances(layers, z, execution);
      });
  ASSERT_TRUE(made.has_value()) << made.error().message;
  const auto done = (*writer)->finish(execution);
  ASSERT_TRUE(done.has_value()) << done.error().message;
}

class LevelSet : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { openvdb::initialize(); }

  openvdb::FloatGrid::Ptr written(const TriangleSoup& mesh, const VoxelGrid& grid) {
    const std::string path = folder_.file("level_set.vdb");
    write(mesh, grid, path);
    openvdb::io::File file(path);
    file.open();
    auto read = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("surface"));
    EXPECT_TRUE(read);
    return read;
  }

  /// Values and states of all voxels, and of some around the grid.
  static void expect_same(const openvdb::FloatGrid& read, const TriangleSoup& mesh,
                          const VoxelGrid& grid, int step = 1) {
    const auto field = signed_distance(mesh, grid);
    ASSERT_TRUE(field.has_value());
    const float band = field->background();
    EXPECT_EQ(read.background(), band);
    const auto accessor = read.getConstAccessor();
    int wrong = 0;
    for (int i = -9; i < grid.dims.x + 9; i += step) {
      for (int j = -9; j < grid.dims.y + 9; j += step) {
        for (int k = -9; k < grid.dims.z + 9; k += step) {
          const bool there =
              i >= 0 && j >= 0 && k >= 0 && i < grid.dims.x && j < grid.dims.y && k < grid.dims.z;
          const float right = there ? field->value(i, j, k) : band;
          float value = 0;
          const bool active = accessor.probeValue({i, j, k}, value);
          wrong += value != right || active != (std::abs(right) < band);
        }
      }
    }
    EXPECT_EQ(wrong, 0);
  }

  TemporaryFolder folder_;
};

TEST_F(LevelSet, OpenvdbReadsEveryVoxel) {
  const auto grid = written(torus(), kTorusGrid);
  EXPECT_EQ(grid->getGridClass(), openvdb::GRID_LEVEL_SET);
  EXPECT_EQ(grid->getName(), "surface");
  EXPECT_TRUE(grid->hasUniformVoxels());
  const openvdb::Vec3d first = grid->indexToWorld(openvdb::Coord(0, 0, 0));
  EXPECT_NEAR(first.x(), -1.57 + 0.0155, 1e-12);
  expect_same(*grid, torus(), kTorusGrid);
  const auto box = grid->evalActiveVoxelBoundingBox();
  EXPECT_EQ(grid->metaValue<openvdb::Vec3i>("file_bbox_min"), box.min().asVec3i());
  EXPECT_EQ(grid->metaValue<openvdb::Vec3i>("file_bbox_max"), box.max().asVec3i());
  EXPECT_EQ(grid->metaValue<openvdb::Int64>("file_voxel_count"),
            static_cast<openvdb::Int64>(grid->activeVoxelCount()));
}

TEST_F(LevelSet, OpenvdbsChecksPass) {
  const auto grid = written(torus(), kTorusGrid);
  EXPECT_EQ(openvdb::tools::checkLevelSet(*grid), "");
  TriangleSoup shell = make_icosphere(9.0, 3), cavity = make_icosphere(5.0, 3);
  reverse_orientation(cavity);
  append(shell, cavity);
  EXPECT_EQ(openvdb::tools::checkLevelSet(
                *written(shell, cubes({21, 23, 25}, 1.0, {-10.5, -11.5, -12.5}))),
            "");
}

TEST_F(LevelSet, OpenvdbMeasuresTheMesh) {
  const TriangleSoup mesh = torus();
  const auto grid = written(mesh, kTorusGrid);
  const double volume = signed_volume(mesh);
  EXPECT_NEAR(openvdb::tools::levelSetVolume(*grid), volume, 0.01 * volume);
  const double area = 4 * std::numbers::pi * std::numbers::pi * kMajor * kMinor;
  EXPECT_NEAR(openvdb::tools::levelSetArea(*grid), area, 0.02 * area);
}

TEST_F(LevelSet, OpenvdbMakesTheMeshAgain) {
  const auto grid = written(torus(), kTorusGrid);
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(*grid, points, quads);
  ASSERT_GT(points.size(), 1000u);
  for (const openvdb::Vec3s& p : points) {
    const double tube = std::hypot(std::hypot(p.x(), p.y()) - kMajor, p.z());
    ASSERT_NEAR(tube, kMinor, 0.1 * 0.031);
  }
}

TEST_F(LevelSet, InsidesAreTilesAtEveryLevel) {
  // Lower nodes of OpenVDB's tree have 128 voxels a side, and upper ones 4096.
  const TriangleSoup box = make_box(glm::dvec3(60.25), glm::dvec3(290.5));
  const VoxelGrid grid = cubes(glm::ivec3(300), 1.0, glm::dvec3(0));
  const auto read = written(box, grid);
  expect_same(*read, box, grid, 7);
  const auto accessor = read->getConstAccessor();
  EXPECT_EQ(accessor.getValueDepth({200, 200, 200}), 1);  // a tile of an upper node
  EXPECT_EQ(accessor.getValue({200, 200, 200}), -3.0f);
  EXPECT_EQ(accessor.getValueDepth({100, 200, 200}), 2);  // of a lower one
  EXPECT_EQ(accessor.getValue({100, 200, 200}), -3.0f);
  // Two upper nodes.
  const TriangleSoup bar = make_box({3.5, 3.5, 4000.25}, {8.5, 8.5, 4200});
  const VoxelGrid tall = cubes({12, 12, 4210}, 1.0, glm::dvec3(0));
  expect_same(*written(bar, tall), bar, tall, 3);
}

TEST_F(LevelSet, GridsThatCutTheMeshAreReadToo) {
  const TriangleSoup box = make_box(glm::dvec3(-50), glm::dvec3(40.3));
  const VoxelGrid grid = cubes({43, 37, 45}, 1.0, glm::dvec3(0));
  expect_same(*written(box, grid), box, grid);
  const VoxelGrid inside = cubes({9, 8, 16}, 1.0, glm::dvec3(-10));
  expect_same(*written(box, inside), box, inside);
  const VoxelGrid outside = cubes({9, 8, 16}, 1.0, glm::dvec3(100));
  expect_same(*written(box, outside), box, outside);
}

TEST_F(LevelSet, BytesDoNotDependOnThreads) {
  write(torus(), kTorusGrid, folder_.file("one.vdb"), 1);
  write(torus(), kTorusGrid, folder_.file("five.vdb"), 5);
  const std::string bytes = testkit::bytes_of(folder_.file("one.vdb"));
  EXPECT_FALSE(bytes.empty());
  EXPECT_EQ(bytes, testkit::bytes_of(folder_.file("five.vdb")));
}

TEST_F(LevelSet, NeedsCubes) {
  VoxelWriterOptions options;
  options.band = 3.0f;
  const auto writer = open_voxel_writer(folder_.file("x.vdb"), "",
                                        {glm::ivec3(8), glm::dvec3(0), {1, 1, 2}}, options);
  ASSERT_FALSE(writer.has_value());
  EXPECT_EQ(writer.error().code, ErrorCode::kUsage);
  EXPECT_NE(writer.error().message.find("cubes, got 1 x 1 x 2"), std::string::npos)
      << writer.error().message;
  EXPECT_TRUE(testkit::names_in(folder_.path()).empty());
}

TEST_F(LevelSet, EveryFormatOfDistancesReadsBack) {
  const TriangleSoup mesh = torus();
  const auto field = signed_distance(mesh, kTorusGrid);
  ASSERT_TRUE(field.has_value());
  int formats = 0;
  for (const VoxelFormat& format : voxel_formats()) {
    if (!format.distances) continue;
    SCOPED_TRACE(format.name);
    std::string path = folder_.file("torus" + format.extension);
    if (path.ends_with('/')) path.pop_back();
    write(mesh, kTorusGrid, path);
    const auto read = read_voxels(path);
    ASSERT_TRUE(read.has_value()) << read.error().message;
    ASSERT_FALSE(read->values.empty());
    ++formats;
    const glm::ivec3 dims = read->grid().dims, shift = read->first_index;
    EXPECT_TRUE(format.name == "vdb" || dims == kTorusGrid.dims);
    int wrong = 0;
    for (int k = 0; k < dims.z; ++k) {
      for (int j = 0; j < dims.y; ++j) {
        for (int i = 0; i < dims.x; ++i) {
          const glm::ivec3 at = glm::ivec3(i, j, k) + shift;
          wrong += std::bit_cast<std::uint32_t>(read->values.value(i, j, k)) !=
                   std::bit_cast<std::uint32_t>(field->value(at.x, at.y, at.z));
        }
      }
    }
    EXPECT_EQ(wrong, 0);
    if (format.name == "vdb") {
      EXPECT_EQ(read->kind, VoxelKind::kDistances);
      const auto solid = voxelize(mesh, kTorusGrid);
      ASSERT_TRUE(solid.has_value());
      EXPECT_EQ(read->set.solid_voxels(), solid->solid_voxels());
    }
  }
  EXPECT_GE(formats, 6);
}

TEST_F(LevelSet, FormatsWithoutFloatsNameThoseThatHoldDistances) {
  VoxelWriterOptions options;
  options.band = 3.0f;
  for (const char* name : {"x.binvox", "x.vox", "slices/"}) {
    const auto writer = open_voxel_writer(folder_.file(name), "", kTorusGrid, options);
    ASSERT_FALSE(writer.has_value()) << name;
    EXPECT_EQ(writer.error().code, ErrorCode::kUsage);
    EXPECT_NE(writer.error().message.find("holds no distances; vdb, npy"), std::string::npos)
        << writer.error().message;
  }
}

}  // namespace
}  // namespace strata
