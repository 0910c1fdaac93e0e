// Files that OpenVDB itself writes, of every tree and compression that is read.

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <fstream>
#include <random>

#include "strata/voxelize/readers/read_voxels.h"
#include "tests/support/temporary_folder.h"

namespace strata::testing {
namespace {

using openvdb::Coord;

class OpenVdbFiles : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { openvdb::initialize(); }

  std::string write(const openvdb::GridPtrVec& grids, std::uint32_t compression) {
    const std::string path = folder_.file(std::to_string(files_++) + ".vdb");
    openvdb::io::File file(path);
    file.setCompression(compression);
    file.write(grids);
    file.close();
    return path;
  }
  static VoxelVolume read(const std::string& path, const ReadVoxelsOptions& options = {}) {
    Result<VoxelVolume> volume = read_voxels(path, options);
    EXPECT_TRUE(volume) << volume.error().message;
    return volume ? std::move(*volume) : VoxelVolume{};
  }
  testkit::TemporaryFolder folder_;
  int files_ = 0;
};

constexpr std::uint32_t kCompressions[] = {
    openvdb::io::COMPRESS_NONE,
    openvdb::io::COMPRESS_ZIP,
    openvdb::io::COMPRESS_BLOSC,
    openvdb::io::COMPRESS_ACTIVE_MASK,
    openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK,
    openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK};

/// Voxels by themselves, blocks, tiles of all levels, and inactive values of several kinds.
template <class GridType>
typename GridType::Ptr random_grid(bool far_tiles) {
  using Value = typename GridType::ValueType;
  auto grid = GridType::create(static_cast<Value>(0));
  std::mt19937 random(7);
  const auto value = [&] { return static_cast<Value>(1 + random() % 200); };
  grid->fill({{-100, 3, 5}, {-60, 40, 50}}, value(), true);
  grid->fill({{0, 0, 0}, {127, 127, 127}}, value(), true);  // a tile of an upper node
  for (int n = 0; n < 3000; ++n) {
    const Coord at(static_cast<int>(random() % 250) - 110, static_cast<int>(random() % 150),
                   static_cast<int>(random() % 90));
    if (n % 3 == 0) {
      grid->tree().setValueOff(at, n % 2 == 0 ? value() : static_cast<Value>(7));
    } else {
      grid->tree().setValueOn(at, value());
    }
  }
  if (far_tiles) grid->fill({{4096, 0, 0}, {8191, 4095, 4095}}, value(), true);  // of the root
  grid->tree().prune();
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  grid->setName("random");
  return grid;
}

template <class GridType>
int wrong_values(const GridType& grid, const VoxelVolume& volume, bool solid_by_value) {
  int wrong = 0;
  const glm::ivec3 dims = volume.grid().dims, first = volume.first_index;
  auto accessor = grid.getConstAccessor();
  for (int i = 0; i < dims.x; ++i) {
    for (int j = 0; j < dims.y; ++j) {
      for (int k = 0; k < dims.z; ++k) {
        const Coord at(first.x + i, first.y + j, first.z + k);
        const auto expected = static_cast<float>(accessor.getValue(at));
        if (!volume.values.empty()) wrong += volume.values.value(i, j, k) != expected;
        const bool solid = solid_by_value ? expected > volume.threshold
                                          : accessor.isValueOn(at) && expected != 0.0f;
        wrong += volume.set.contains(i, j, k) != solid;
      }
    }
  }
  return wrong;
}

template <class GridType>
void expect_box(const GridType& grid, const VoxelVolume& volume) {
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(volume.first_index[axis], box.min()[axis]);
    EXPECT_EQ(volume.grid().dims[axis], box.dim()[axis]);
    EXPECT_NEAR(volume.grid().origin[axis], grid.transform().indexToWorld(box.min())[axis] - 0.25,
                1e-12);
    EXPECT_EQ(volume.grid().voxel_size[axis], 0.5);
  }
}

TEST_F(OpenVdbFiles, NumbersOfEveryTypeAndCompression) {
  const auto check = [&](const auto& grid, const char* type) {
    for (const std::uint32_t compression : kCompressions) {
      SCOPED_TRACE(std::string(type) + ", compression " + std::to_string(compression));
      ReadVoxelsOptions options;
      options.integers = IntegerVoxels::kValues;
      options.threshold = 20.0f;
      const VoxelVolume volume = read(write({grid}, compression), options);
      EXPECT_EQ(volume.kind, VoxelKind::kValues);
      EXPECT_EQ(volume.type, type);
      EXPECT_EQ(volume.name, "random");
      expect_box(*grid, volume);
      EXPECT_EQ(wrong_values(*grid, volume, true), 0);
      EXPECT_GT(volume.set.solid_voxels(), 100000u);
    }
  };
  check(random_grid<openvdb::FloatGrid>(false), "float");
  check(random_grid<openvdb::DoubleGrid>(false), "double");
  check(random_grid<openvdb::Int32Grid>(false), "int32");
  check(random_grid<openvdb::Int64Grid>(false), "int64");
  const auto half = random_grid<openvdb::FloatGrid>(false);
  half->setSaveFloatAsHalf(true);
  check(half, "half");
}

TEST_F(OpenVdbFiles, BoolsAndMasksOfEveryCompression) {
  const auto check = [&](const auto& grid, const char* type) {
    for (const std::uint32_t compression : kCompressions) {
      SCOPED_TRACE(std::string(type) + ", compression " + std::to_string(compression));
      const VoxelVolume volume = read(write({grid}, compression));
      EXPECT_EQ(volume.kind, VoxelKind::kMask);
      EXPECT_EQ(volume.type, type);
      expect_box(*grid, volume);
      EXPECT_EQ(wrong_values(*grid, volume, false), 0);
    }
  };
  check(random_grid<openvdb::BoolGrid>(false), "bool");
  check(random_grid<openvdb::MaskGrid>(false), "mask");
}

TEST_F(OpenVdbFiles, IdsAreLabels) {
  const auto grid = random_grid<openvdb::Int32Grid>(false);
  const VoxelVolume volume = read(write({grid}, openvdb::io::COMPRESS_BLOSC));
  EXPECT_EQ(volume.kind, VoxelKind::kIds);
  EXPECT_TRUE(volume.values.empty());
  auto accessor = grid->getConstAccessor();
  int wrong = 0;
  for_each_run(volume.set, [&](const glm::ivec3& first, const glm::ivec3& last, unsigned label) {
    for (int k = first.z; k <= last.z; ++k) {
      wrong += accessor.getValue({first.x + volume.first_index.x, first.y + volume.first_index.y,
                                  k + volume.first_index.z}) != static_cast<int>(label);
    }
  });
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(volume.set.solid_voxels(), 1000000u);
}

TEST_F(OpenVdbFiles, TilesOfTheRootAreRunsAndNotVoxels) {
  for (const bool bools : {true, false}) {
    SCOPED_TRACE(bools);
    const openvdb::GridBase::Ptr grid =
        bools ? openvdb::GridBase::Ptr(random_grid<openvdb::BoolGrid>(true))
              : openvdb::GridBase::Ptr(random_grid<openvdb::FloatGrid>(true));
    ReadVoxelsOptions options;
    options.threshold = 0.5f;
    const VoxelVolume volume = read(write({grid}, openvdb::io::COMPRESS_BLOSC), options);
    // Inactive voxels above the threshold count, if they are numbers.
    EXPECT_GE(volume.set.solid_voxels(), grid->activeVoxelCount());
    EXPECT_LT(volume.set.solid_voxels(), grid->activeVoxelCount() + 3000);
    EXPECT_GT(volume.set.solid_voxels(), std::uint64_t{1} << 36);
    EXPECT_LT(volume.set.memory_bytes() + volume.values.memory_bytes(), 200'000'000u);
  }
}

TEST_F(OpenVdbFiles, LevelSetsAreSolidBelowZero) {
  const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
      20.0f, openvdb::Vec3f(3, 40, 5), 0.5f);
  sphere->setName("ball");
  const VoxelVolume volume = read(write({sphere}, openvdb::io::COMPRESS_ZIP));
  EXPECT_EQ(volume.kind, VoxelKind::kDistances);
  EXPECT_EQ(volume.threshold, 0.0f);
  auto accessor = sphere->getConstAccessor();
  int wrong = 0;
  const glm::ivec3 dims = volume.grid().dims;
  for (int i = 0; i < dims.x; ++i) {
    for (int j = 0; j < dims.y; ++j) {
      for (int k = 0; k < dims.z; ++k) {
        const float distance = accessor.getValue(
            {i + volume.first_index.x, j + volume.first_index.y, k + volume.first_index.z});
        wrong += volume.set.contains(i, j, k) != (distance < 0.0f);
        wrong += volume.values.value(i, j, k) != distance;
      }
    }
  }
  EXPECT_EQ(wrong, 0);
  const double ball = 4.0 / 3.0 * 3.14159265 * 40 * 40 * 40;
  EXPECT_NEAR(static_cast<double>(volume.set.solid_voxels()) / ball, 1.0, 0.01);
}

TEST_F(OpenVdbFiles, AGridIsChosenByNameAndInstancesShareATree) {
  const auto first = openvdb::Vec3DGrid::create();
  first->setName("velocity");
  const auto second = random_grid<openvdb::BoolGrid>(false);
  const auto third =
      openvdb::gridPtrCast<openvdb::BoolGrid>(second->copyGrid());  // shares the tree
  third->setName("again");
  third->setTransform(openvdb::math::Transform::createLinearTransform(2.0));
  const std::string path = write({first, second, third}, openvdb::io::COMPRESS_ZIP);
  const VoxelVolume by_default = read(path);
  EXPECT_EQ(by_default.name, "random");
  EXPECT_EQ(by_default.grids, (std::vector<std::string>{"velocity", "random", "again"}));
  ReadVoxelsOptions options;
  options.grid = "again";
  const VoxelVolume again = read(path, options);
  EXPECT_EQ(again.set.solid_voxels(), by_default.set.solid_voxels());
  EXPECT_EQ(again.grid().voxel_size.x, 2.0);
  options.grid = "velocity";
  const auto vectors = read_voxels(path, options);
  ASSERT_FALSE(vectors);
  EXPECT_NE(vectors.error().message.find("Tree_vec3d_5_4_3"), std::string::npos);
  options.grid = "none";
  const auto none = read_voxels(path, options);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::kUsage);
  EXPECT_NE(none.error().message.find("'again' (Tree_bool_5_4_3)"), std::string::npos)
      << none.error().message;
}

TEST_F(OpenVdbFiles, StreamsAndTurnedTransforms) {
  const auto grid = random_grid<openvdb::FloatGrid>(false);
  openvdb::math::Mat4d turn =
      openvdb::math::rotation<openvdb::math::Mat4d>(openvdb::Vec3d(0, 0, 1), 0.5);
  turn.preScale(openvdb::Vec3d(2.0, 3.0, 4.0));
  turn.setTranslation(openvdb::Vec3d(1, 2, 3));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(turn));
  const std::string path = folder_.file("stream.vdb");
  {
    std::ofstream file(path, std::ios::binary);
    openvdb::io::Stream(file).write(openvdb::GridCPtrVec{grid});
  }
  ReadVoxelsOptions options;
  options.threshold = 0.5f;
  const VoxelVolume volume = read(path, options);
  EXPECT_EQ(wrong_values(*grid, volume, true), 0);
  ASSERT_EQ(volume.notes.size(), 1u);
  EXPECT_NE(volume.notes[0].find("turns"), std::string::npos);
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(volume.grid().voxel_size[axis], 2 + axis, 1e-12);
}

TEST_F(OpenVdbFiles, DamagedFilesAreRefusedOrRead) {
  const auto grid = random_grid<openvdb::FloatGrid>(false);
  for (const std::uint32_t compression : kCompressions) {
    const std::string bytes = testkit::bytes_of(write({grid}, compression));
    std::mt19937 random(3);
    for (int n = 0; n < 20; ++n) {
      std::string damaged = bytes;
      for (int k = 0; k < 3; ++k) {
        damaged[random() % (n % 2 == 0 ? 2000 : bytes.size())] ^= 0x5a;
      }
      Execution execution;
      execution.memory_limit = std::uint64_t{1} << 30;
      const auto read = read_voxels(folder_.write("damaged.vdb", damaged), {}, execution);
      if (!read) {
        EXPECT_NE(read.error().code, ErrorCode::kInternal) << read.error().message;
      }
    }
  }
}

}  // namespace
}  // namespace strata::testing
