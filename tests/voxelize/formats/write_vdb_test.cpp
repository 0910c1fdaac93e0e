// Everything is read back with OpenVDB itself; the one place of the tests that includes it.

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <array>
#include <cmath>
#include <glm/vector_relational.hpp>
#include <sstream>

#include "strata/voxelize/formats/openvdb_bridge.h"
#include "strata/voxelize/formats/voxel_writer.h"
#include "tests/support/predicate_intervals.h"
#include "tests/voxelize/voxel_samples.h"

namespace strata::testing {
namespace {

class WriteVdb : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { openvdb::initialize(); }

  std::string write(const VoxelIntervals& set, const VoxelWriterOptions& options = {},
                    int threads = 2, int slab_tiles = 1000) {
    const std::string path = folder_.file(std::to_string(files_++) + ".vdb");
    Execution execution;
    execution.threads = threads;
    auto writer = open_voxel_writer(path, "", set.grid(), options);
    if (!writer) throw std::runtime_error(writer.error().message);
    for (const VoxelIntervals& slab : cut(set, slab_tiles)) {
      if (auto added = (*writer)->add(slab, execution); !added) {
        throw std::runtime_error(added.error().message);
      }
    }
    if (auto done = (*writer)->finish(execution); !done) {
      throw std::runtime_error(done.error().message);
    }
    return path;
  }

  template <class GridType>
  static typename GridType::Ptr read(const std::string& path, const std::string& name = "solid") {
    openvdb::io::File file(path);
    file.open();
    EXPECT_TRUE(file.hasGrid(name));
    auto grid = openvdb::gridPtrCast<GridType>(file.readGrid(name));
    EXPECT_TRUE(grid);
    return grid;
  }

  /// The tree that OpenVDB makes of the same set.
  template <class GridType = openvdb::BoolGrid>
  static typename GridType::Ptr reference(const VoxelIntervals& set) {
    auto grid = GridType::create();
    for (int y = 0; y < set.grid().dims.y; ++y) {
      for (int x = 0; x < set.grid().dims.x; ++x) {
        for (const Interval& interval : set.column(x, y)) {
          grid->tree().fill({{x, y, interval.first}, {x, y, interval.last}}, true, true);
        }
      }
    }
    grid->tree().prune();
    return grid;
  }

  TemporaryFolder folder_;
  int files_ = 0;
};

VoxelWriterOptions of_kind(bool fog) {
  VoxelWriterOptions options;
  options.fog = fog ? 1 : 0;
  return options;
}

std::string tree_bytes(const openvdb::GridBase& grid) {
  std::ostringstream stream(std::ios::binary);
  openvdb::io::setDataCompression(stream, openvdb::io::COMPRESS_ACTIVE_MASK);
  grid.writeTopology(stream);
  grid.writeBuffers(stream);
  return stream.str();
}

TEST_F(WriteVdb, BoolsHoldExactlyTheSet) {
  for (const Sample& sample : small_samples()) {
    SCOPED_TRACE(sample.name);
    const VoxelIntervals set = intervals_of(sample, Axis::kZ);
    const auto grid = read<openvdb::BoolGrid>(write(set));
    EXPECT_FALSE(grid->background());
    ASSERT_EQ(grid->activeVoxelCount(), set.solid_voxels());
    auto accessor = grid->getConstAccessor();
    int wrong = 0;
    for (int i = -1; i <= sample.grid.dims.x; ++i) {
      for (int j = -1; j <= sample.grid.dims.y; ++j) {
        for (int k = -1; k <= sample.grid.dims.z; ++k) {
          const glm::ivec3 at(i, j, k);
          const bool in_grid = glm::all(glm::greaterThanEqual(at, glm::ivec3(0))) &&
                               glm::all(glm::lessThan(at, sample.grid.dims));
          const bool solid = in_grid && sample.solid(i, j, k);
          wrong += accessor.isValueOn({i, j, k}) != solid ? 1 : 0;
          wrong += accessor.getValue({i, j, k}) != solid ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(wrong, 0);
  }
}

TEST_F(WriteVdb, TreeIsByteForByteTheOneOpenVdbWrites) {
  for (const Sample& sample : small_samples()) {
    SCOPED_TRACE(sample.name);
    const VoxelIntervals set = intervals_of(sample, Axis::kZ);
    for (const bool mask : {false, true}) {
      const std::string expected =
          mask ? tree_bytes(*reference<openvdb::MaskGrid>(set)) : tree_bytes(*reference(set));
      VoxelWriterOptions options;
      options.mask = mask;
      const std::string path = write(set, options);
      const std::string bytes = testkit::bytes_of(path);
      ASSERT_GT(bytes.size(), expected.size());
      EXPECT_TRUE(bytes.ends_with(expected));
      if (mask) {
        EXPECT_EQ(read<openvdb::MaskGrid>(path)->activeVoxelCount(), set.solid_voxels());
      }
    }
  }
}

TEST_F(WriteVdb, InsideIsTiles) {
  const VoxelGrid grid = make_grid({300, 290, 280});
  const VoxelIntervals set =
      intervals_from_predicate(grid, Axis::kZ, [](int, int, int) { return true; });
  const auto read_back = read<openvdb::BoolGrid>(write(set));
  // 2 x 2 x 2 whole nodes of 128^3 become tiles of the node above.
  std::vector<openvdb::Index32> nodes = read_back->tree().nodeCount();
  EXPECT_EQ(nodes.at(1), 27u - 8u);
  EXPECT_EQ(read_back->activeVoxelCount(), set.solid_voxels());
  EXPECT_TRUE(testkit::bytes_of(write(set)).ends_with(tree_bytes(*reference(set))));
}

TEST_F(WriteVdb, GridsBeyondOneRootNodeKeepTheirOrder) {
  for (const glm::ivec3 dims :
       {glm::ivec3(8300, 5, 12), glm::ivec3(6, 8300, 9), glm::ivec3(9, 10, 8300)}) {
    const Sample sample{"long", make_grid(dims), [](int i, int j, int k) {
                          return random_voxel(i / 90, j / 90, k / 90, 600) &&
                                 random_voxel(i, j, k, 999);
                        }};
    const VoxelIntervals set = intervals_of(sample, Axis::kZ);
    const std::string path = write(set);
    EXPECT_EQ(read<openvdb::BoolGrid>(path)->activeVoxelCount(), set.solid_voxels());
    EXPECT_TRUE(testkit::bytes_of(path).ends_with(tree_bytes(*reference(set))))
        << dims.x << " " << dims.y;
  }
}

TEST_F(WriteVdb, SolidRootNodeIsOneTile) {
  const VoxelGrid grid = make_grid(glm::ivec3(4096));
  VoxelIntervals set(grid, Axis::kZ);
  std::vector<std::uint32_t> offsets(VoxelIntervals::kTileColumns + 1);
  for (std::uint32_t i = 0; i < offsets.size(); ++i) offsets[i] = i;
  const std::vector<Interval> items(VoxelIntervals::kTileColumns, Interval{0, 4095});
  for (int tv = 0; tv < set.tiles_v(); ++tv) {
    for (int tu = 0; tu < set.tiles_u(); ++tu) set.set_tile(tu, tv, offsets, items);
  }
  for (const bool fog : {false, true}) {
    const std::string path = write(set, of_kind(fog));
    EXPECT_LT(testkit::bytes_of(path).size(), 2000u);
    openvdb::io::File file(path);
    file.open();
    const auto read_back = file.readGrid(fog ? "density" : "solid");
    EXPECT_EQ(read_back->activeVoxelCount(), std::uint64_t{1} << 36);
    EXPECT_EQ(read_back->baseTree().nonLeafCount(), 1u);  // the root alone
  }
}

TEST_F(WriteVdb, FogIsOneInsideAndZeroOutside) {
  for (const Sample& sample : small_samples()) {
    SCOPED_TRACE(sample.name);
    const VoxelIntervals set = intervals_of(sample, Axis::kZ);
    const auto grid = read<openvdb::FloatGrid>(write(set, of_kind(true)), "density");
    EXPECT_EQ(grid->getGridClass(), openvdb::GRID_FOG_VOLUME);
    EXPECT_EQ(grid->background(), 0.0f);
    EXPECT_TRUE(grid->tree().hasSameTopology(reference(set)->tree()));
    auto accessor = grid->getConstAccessor();
    int wrong = 0;
    for (int i = -1; i <= sample.grid.dims.x; ++i) {
      for (int j = -1; j <= sample.grid.dims.y; ++j) {
        for (int k = -1; k <= sample.grid.dims.z; ++k) {
          const bool in_grid = i >= 0 && j >= 0 && k >= 0 && i < sample.grid.dims.x &&
                               j < sample.grid.dims.y && k < sample.grid.dims.z;
          const float expected = in_grid && sample.solid(i, j, k) ? 1.0f : 0.0f;
          wrong += accessor.getValue({i, j, k}) != expected ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(wrong, 0);
  }
}

TEST_F(WriteVdb, FogIsTheFractionOfSamplesThatLabelsCount) {
  const VoxelGrid grid = make_grid({75, 70, 66});
  const IdOf samples = some_ids(27);
  VoxelWriterOptions options;
  options.fog = 27;
  const std::string path = write(labelled(grid, Axis::kZ, samples), options);
  const auto fog = read<openvdb::FloatGrid>(path, "density");
  EXPECT_EQ(fog->getGridClass(), openvdb::GRID_FOG_VOLUME);
  auto accessor = fog->getConstAccessor();
  int wrong = 0;
  for (int i = 0; i < grid.dims.x; ++i) {
    for (int j = 0; j < grid.dims.y; ++j) {
      for (int k = 0; k < grid.dims.z; ++k) {
        const std::uint32_t count = samples(i, j, k);
        wrong += accessor.getValue({i, j, k}) != static_cast<float>(count) / 27.0f ? 1 : 0;
        wrong += accessor.isValueOn({i, j, k}) != (count != 0) ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(wrong, 0);
}

TEST_F(WriteVdb, IdsAreTheTreeThatOpenVdbMakes) {
  struct IdSample {
    std::string name;
    VoxelGrid grid;
    IdOf id;
  };
  const auto stripes = [](int along, int width) {
    return [=](int i, int j, int k) -> std::uint32_t {
      return 1 + static_cast<std::uint32_t>(glm::ivec3(i, j, k)[along] / width);
    };
  };
  for (const IdSample& sample : std::vector<IdSample>{
           {"some", make_grid({75, 70, 66}), some_ids(3)},
           {"many", make_grid({75, 70, 66}), some_ids(3'000'000)},
           {"one", make_grid({130, 140, 150}), stripes(0, 1000)},
           {"leaves", make_grid({64, 64, 64}), stripes(2, 8)},
           {"in leaves", make_grid({64, 64, 64}), stripes(2, 12)},
           {"along x", make_grid({300, 129, 140}), stripes(0, 128)},
           {"along y", make_grid({129, 300, 140}), stripes(1, 100)},
           {"along z", make_grid({129, 140, 300}), stripes(2, 64)},
           {"voxels", make_grid({20, 20, 40}),
            [](int i, int j, int k) {
              return 1 + static_cast<std::uint32_t>(i + j * 20 + k * 400);
            }},
           {"ragged", make_grid({129, 66, 131}), stripes(2, 50)},
           {"nothing", make_grid({20, 70, 30}), [](int, int, int) { return 0u; }},
       }) {
    SCOPED_TRACE(sample.name);
    const glm::ivec3 dims = sample.grid.dims;
    const VoxelIntervals set = labelled(sample.grid, Axis::kZ, sample.id);
    VoxelWriterOptions options;
    options.ids = 3'000'000;
    options.name = "ids";
    const std::string path = write(set, options);
    EXPECT_EQ(testkit::bytes_of(write(set, options, 5, 1)), testkit::bytes_of(path));
    const auto grid = read<openvdb::FloatGrid>(path, "ids");
    EXPECT_EQ(grid->background(), 0.0f);
    EXPECT_EQ(grid->activeVoxelCount(), set.solid_voxels());
    auto expected = openvdb::FloatGrid::create();
    auto to = expected->getAccessor();
    auto from = grid->getConstAccessor();
    int wrong = 0;
    for (int i = 0; i < dims.x; ++i) {
      for (int j = 0; j < dims.y; ++j) {
        for (int k = 0; k < dims.z; ++k) {
          const auto id = static_cast<float>(sample.id(i, j, k));
          if (id != 0) to.setValueOn({i, j, k}, id);
          wrong += from.getValue({i, j, k}) != id || from.isValueOn({i, j, k}) != (id != 0) ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(wrong, 0);
    expected->tree().prune();
    EXPECT_TRUE(grid->tree().hasSameTopology(expected->tree()));
  }
}

TEST_F(WriteVdb, IdsOfSolidRootNodesAreTiles) {
  const VoxelGrid grid = make_grid(glm::ivec3(4096));
  std::vector<std::uint32_t> offsets(VoxelIntervals::kTileColumns + 1);
  for (const int pieces : {1, 2}) {
    // One id, or one below and one above.
    std::vector<Interval> items;
    std::vector<std::uint32_t> labels;
    for (std::size_t column = 0; column < VoxelIntervals::kTileColumns; ++column) {
      for (int i = 0; i < pieces; ++i) {
        items.push_back({static_cast<std::uint16_t>(4096 / pieces * i),
                         static_cast<std::uint16_t>(4096 / pieces * (i + 1) - 1)});
        labels.push_back(7 + static_cast<std::uint32_t>(i));
      }
      offsets[column + 1] = static_cast<std::uint32_t>(items.size());
    }
    VoxelIntervals set(grid, Axis::kZ);
    for (int tv = 0; tv < set.tiles_v(); ++tv) {
      for (int tu = 0; tu < set.tiles_u(); ++tu) set.set_tile(tu, tv, offsets, items, labels);
    }
    VoxelWriterOptions options;
    options.ids = 8;
    const auto read_back = read<openvdb::FloatGrid>(write(set, options), "ids");
    EXPECT_EQ(read_back->activeVoxelCount(), std::uint64_t{1} << 36);
    EXPECT_EQ(read_back->tree().leafCount(), 0u);
    EXPECT_EQ(read_back->tree().nonLeafCount(), pieces == 1 ? 1u : 2u);
    EXPECT_EQ(read_back->tree().getValue({5, 6, 100}), 7);
    EXPECT_EQ(read_back->tree().getValue({4095, 0, 2047}), 7);
    EXPECT_EQ(read_back->tree().getValue({4095, 0, 2048}), pieces == 1 ? 7 : 8);
  }
}

TEST_F(WriteVdb, ColoursAreVectorsOfLight) {
  // Patches of one colour that fill leaves and tiles, and one that changes from voxel to voxel.
  const IdOf colour = [](int i, int j, int k) -> std::uint32_t {
    if (k >= 140) return 0;
    if (i < 130) return j < 130 ? 0xffffffffu : 0xff0000bcu;
    return 0xff000000u | static_cast<std::uint32_t>(i % 8 << 5 | j % 8 << 13 | k % 8 << 21);
  };
  VoxelWriterOptions options;
  options.rgba = true;
  const VoxelIntervals set = labelled(make_grid({150, 140, 150}), Axis::kZ, colour);
  const std::string path = write(set, options);
  const auto grid = read<openvdb::Vec3SGrid>(path, "Cd");
  EXPECT_EQ(grid->activeVoxelCount(), 150u * 140u * 140u);
  EXPECT_EQ(grid->background(), openvdb::Vec3f(0.0f));
  EXPECT_EQ(testkit::bytes_of(path), testkit::bytes_of(write(set, options, 7, 1)));
  const auto accessor = grid->getConstAccessor();
  const auto light = [](std::uint32_t value) {
    const double v = value / 255.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  int wrong = 0;
  for (int k = 0; k < 150; ++k) {
    for (int j = 0; j < 140; ++j) {
      for (int i = 0; i < 150; ++i) {
        const std::uint32_t wanted = colour(i, j, k);
        const openvdb::Coord at(i, j, k);
        wrong += accessor.isValueOn(at) != (wanted != 0);
        const openvdb::Vec3f got = accessor.getValue(at);
        for (int c = 0; c < 3; ++c) wrong += std::abs(got[c] - light(wanted >> 8 * c & 255)) > 1e-6;
      }
    }
  }
  EXPECT_EQ(wrong, 0);
}

TEST_F(WriteVdb, FogIdsAndMaskTogetherAreRefused) {
  for (const int two : {1 | 2, 1 | 4, 2 | 4}) {
    VoxelWriterOptions options;
    options.ids = (two & 1) != 0 ? 2 : 0;
    options.fog = (two & 2) != 0 ? 8 : 0;
    options.mask = (two & 4) != 0;
    const auto refused =
        open_voxel_writer(folder_.file("a.vdb"), "", make_grid({8, 8, 8}), options);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
  }
}

TEST_F(WriteVdb, IdsThatFloatsDoNotCountAreRefused) {
  VoxelWriterOptions options;
  options.ids = 1 << 24;
  EXPECT_TRUE(open_voxel_writer(folder_.file("a.vdb"), "", make_grid({8, 8, 8}), options));
  ++options.ids;
  const auto refused = open_voxel_writer(folder_.file("a.vdb"), "", make_grid({8, 8, 8}), options);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("16777216"), std::string::npos) << refused.error().message;
}

// Programs copy and scale transforms: a file that only opens is not enough.
TEST_F(WriteVdb, VoxelSizesThatOpenVdbRefusesAreRefused) {
  for (const glm::dvec3 size :
       {glm::dvec3(1e-4), glm::dvec3(1.45e-5), glm::dvec3(1.44e-5), glm::dvec3(1e-5),
        glm::dvec3(1e-110), glm::dvec3(1e80), glm::dvec3(1.0, 1.0, 4e-15),
        glm::dvec3(1.0, 1.0, 2e-15), glm::dvec3(1e-6, 1e-6, 1.0), glm::dvec3(1e120)}) {
    bool taken = true;
    try {
      const openvdb::math::ScaleMap map(openvdb::Vec3d(size.x, size.y, size.z));
      taken = std::isfinite(map.getAffineMap()->determinant());
    } catch (const openvdb::ArithmeticError&) {
      taken = false;
    }
    const auto opened =
        open_voxel_writer(folder_.file("a.vdb"), "", make_grid({8, 8, 8}, glm::dvec3(0), size));
    EXPECT_EQ(opened.has_value(), taken) << size.x << " " << size.z;
    if (!opened) {
      EXPECT_EQ(opened.error().code, ErrorCode::kUsage);
    }
  }
}

TEST_F(WriteVdb, IndexCoordinatesAreVoxelCentres) {
  for (const glm::dvec3 size : {glm::dvec3(0.3), glm::dvec3(0.1, 0.25, 7.0)}) {
    for (const bool fog : {false, true}) {
      const VoxelGrid grid = make_grid({20, 30, 40}, {1.0 / 3, -1e6, 0.7}, size);
      const VoxelIntervals set =
          intervals_from_predicate(grid, Axis::kZ, [](int i, int j, int) { return i == j; });
      openvdb::io::File file(write(set, of_kind(fog)));
      file.open();
      const auto read_back = file.readGrid(fog ? "density" : "solid");
      const openvdb::math::Transform& transform = read_back->transform();
      EXPECT_TRUE(transform.isLinear());
      EXPECT_EQ(transform.hasUniformScale(), size.x == size.y);
      EXPECT_EQ(read_back->voxelSize(), openvdb::Vec3d(size.x, size.y, size.z));
      for (const glm::ivec3 index : {glm::ivec3(0), glm::ivec3(19, 3, 39)}) {
        const openvdb::Vec3d world =
            transform.indexToWorld(openvdb::Coord(index.x, index.y, index.z));
        const glm::dvec3 centre = grid.origin + (glm::dvec3(index) + 0.5) * size;
        EXPECT_NEAR(world.x(), centre.x, 1e-12);
        EXPECT_NEAR(world.y(), centre.y, 1e-9);
        EXPECT_NEAR(world.z(), centre.z, 1e-12);
        const openvdb::Vec3d back = transform.worldToIndex(world);
        EXPECT_NEAR(back.x(), index.x, 1e-9);
        EXPECT_NEAR(back.y(), index.y, 1e-8);
        EXPECT_NEAR(back.z(), index.z, 1e-9);
      }
    }
  }
}

TEST_F(WriteVdb, MetadataTellsCountAndBounds) {
  const VoxelGrid grid = make_grid({100, 200, 300});
  const VoxelIntervals set = intervals_from_predicate(grid, Axis::kZ, [](int i, int j, int k) {
    return i >= 7 && i <= 90 && j >= 66 && j <= 190 && k >= 5 && k <= 280;
  });
  const auto read_back = read<openvdb::BoolGrid>(write(set));
  EXPECT_EQ(read_back->metaValue<openvdb::Int64>("file_voxel_count"),
            static_cast<openvdb::Int64>(set.solid_voxels()));
  EXPECT_EQ(read_back->metaValue<openvdb::Vec3i>("file_bbox_min"), openvdb::Vec3i(7, 66, 5));
  EXPECT_EQ(read_back->metaValue<openvdb::Vec3i>("file_bbox_max"), openvdb::Vec3i(90, 190, 280));
  EXPECT_EQ(read_back->getCreator(), "strata");
  EXPECT_EQ(read_back->getName(), "solid");
}

TEST_F(WriteVdb, NameOfTheGridIsKept) {
  const VoxelIntervals set = intervals_of(small_samples().front(), Axis::kZ);
  VoxelWriterOptions options;
  options.name = "left hand";
  openvdb::io::File file(write(set, options));
  file.open();
  EXPECT_TRUE(file.hasGrid("left hand"));
}

TEST_F(WriteVdb, BytesDoNotDependOnThreadsOrSlabs) {
  for (const Sample& sample : small_samples()) {
    SCOPED_TRACE(sample.name);
    const VoxelIntervals set = intervals_of(sample, Axis::kZ);
    for (const bool fog : {false, true}) {
      const std::string expected = testkit::bytes_of(write(set, of_kind(fog), 1));
      EXPECT_EQ(testkit::bytes_of(write(set, of_kind(fog), 1)), expected);
      EXPECT_EQ(testkit::bytes_of(write(set, of_kind(fog), 2, 1)), expected);
      EXPECT_EQ(testkit::bytes_of(write(set, of_kind(fog), 5, 2)), expected);
    }
  }
}

TEST_F(WriteVdb, UniqueTagFollowsTheContent) {
  const auto tag = [&](int last) {
    const VoxelIntervals set =
        intervals_from_predicate(make_grid({40, 40, 40}), Axis::kZ,
                                 [=](int i, int j, int k) { return i < 20 && j < 20 && k < last; });
    openvdb::io::File file(write(set));
    file.open();
    return file.getUniqueTag();
  };
  EXPECT_EQ(tag(16), tag(16));
  EXPECT_NE(tag(16), tag(17));
  EXPECT_NE(tag(16), tag(24));
  const auto tag_of_ids = [&](std::uint32_t id) {
    const VoxelIntervals set = labelled(make_grid({40, 40, 40}), Axis::kZ, [=](int i, int, int k) {
      return k < 16 ? 1 : i < 20 ? id : 0;
    });
    VoxelWriterOptions options;
    options.ids = 5;
    openvdb::io::File file(write(set, options));
    file.open();
    return file.getUniqueTag();
  };
  EXPECT_EQ(tag_of_ids(4), tag_of_ids(4));
  EXPECT_NE(tag_of_ids(4), tag_of_ids(5));
}

class OpenVdbBridge : public WriteVdb {
 protected:
  /// The grid made in memory is the one that the file holds.
  template <class Grid>
  static void expect_same(const VoxelIntervals& set, const OpenVdbOptions& options,
                          const std::string& path, const std::string& name) {
    const auto from_file = read<Grid>(path, name);
    const auto made = to_openvdb<Grid>(set, options);
    ASSERT_TRUE(made) << made.error().message;
    EXPECT_EQ(tree_bytes(**made), tree_bytes(*from_file));
    EXPECT_EQ((*made)->activeVoxelCount(), set.solid_voxels());
    EXPECT_EQ((*made)->getName(), name);
    EXPECT_EQ((*made)->getGridClass(), from_file->getGridClass());
    EXPECT_EQ((*made)->transform(), from_file->transform());
    EXPECT_EQ((*made)->background(), from_file->background());
  }
};

TEST_F(OpenVdbBridge, MakesTheGridsOfTheFilesAlongAnyAxis) {
  VoxelWriterOptions mask;
  mask.mask = true;
  for (const Sample& sample : small_samples()) {
    SCOPED_TRACE(sample.name);
    const VoxelIntervals along_z = intervals_of(sample, Axis::kZ);
    const std::array paths = {write(along_z), write(along_z, mask), write(along_z, of_kind(true))};
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      const VoxelIntervals set = intervals_of(sample, axis);
      expect_same<openvdb::BoolGrid>(set, {}, paths[0], "solid");
      expect_same<openvdb::MaskGrid>(set, {}, paths[1], "solid");
      expect_same<openvdb::FloatGrid>(set, {}, paths[2], "density");
    }
  }
}

TEST_F(OpenVdbBridge, LabelsAreFractionsOrIds) {
  const VoxelGrid grid = make_grid({70, 90, 150}, glm::dvec3(0), {0.1, 0.25, 7.0});
  VoxelWriterOptions fog, ids;
  fog.fog = 27;
  ids.ids = 27;
  const VoxelIntervals along_z = labelled(grid, Axis::kZ, some_ids(27));
  const std::array paths = {write(along_z, fog), write(along_z, ids)};
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    const VoxelIntervals set = labelled(grid, axis, some_ids(27));
    expect_same<openvdb::FloatGrid>(set, {.full_label = 27}, paths[0], "density");
    expect_same<openvdb::FloatGrid>(set, {.full_label = 0}, paths[1], "ids");
  }
}

TEST_F(OpenVdbBridge, RefusesPartsAndSizesThatOpenVdbDoesNotTake) {
  const VoxelIntervals set =
      intervals_of({"", make_grid({8, 130, 8}), [](int, int, int) { return true; }}, Axis::kZ);
  for (const VoxelIntervals& slab : cut(set, 1)) {
    const auto refused = to_openvdb(slab);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
    EXPECT_NE(refused.error().message.find("130"), std::string::npos) << refused.error().message;
  }
  const auto tiny =
      to_openvdb(VoxelIntervals(make_grid({8, 8, 8}, {}, glm::dvec3(1e-110)), Axis::kZ));
  ASSERT_FALSE(tiny);
  EXPECT_EQ(tiny.error().code, ErrorCode::kUsage);
}

TEST_F(WriteVdb, ATurnedGridHasAnAffineMapThatOpenVdbAgreesWith) {
  VoxelGrid grid = make_grid({9, 10, 11}, {1, 2, 3}, {0.5, 0.25, 2});
  VoxelWriterOptions options;
  // A turn by 3-4-5, mirrored along z.
  options.frame.direction = glm::dmat3(0.6, 0.8, 0, -0.8, 0.6, 0, 0, 0, -1);
  const auto set = intervals_from_predicate(grid, Axis::kZ, [](int i, int, int) { return i > 4; });
  const auto read_back = read<openvdb::BoolGrid>(write(set, options));
  EXPECT_EQ(read_back->activeVoxelCount(), set.solid_voxels());
  for (const glm::dvec3& index : {glm::dvec3(0), glm::dvec3(3, 0, 0), glm::dvec3(2, 5, 7)}) {
    const glm::dvec3 expected =
        options.frame.direction * (grid.origin + (index + 0.5) * grid.voxel_size);
    const openvdb::Vec3d world = read_back->indexToWorld(openvdb::Vec3d(index.x, index.y, index.z));
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(world[axis], expected[axis], 1e-12);
    const openvdb::Vec3d back = read_back->worldToIndex(world);
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(back[axis], index[axis], 1e-9);
  }
}

}  // namespace
}  // namespace strata::testing
