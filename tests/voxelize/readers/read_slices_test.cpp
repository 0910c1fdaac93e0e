// Archives of layers that are not what they say, or that can be read in two ways.

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "strata/voxelize/formats/voxel_writer.h"
#include "strata/voxelize/readers/read_voxels.h"
#include "tests/voxelize/voxel_samples.h"
#include "voxelize/readers/readers.h"

namespace strata::testing {
namespace {

std::string little_endian(std::uint64_t number, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(number >> 8 * i);
  return text;
}

/// An archive with one deflated member.
std::string archive_of(const std::string& name, const std::string& packed, std::uint32_t bytes) {
  const std::string facts = little_endian(8, 2) + little_endian(0, 4) + little_endian(0, 4) +
                            little_endian(packed.size(), 4) + little_endian(bytes, 4) +
                            little_endian(name.size(), 2) + little_endian(0, 2);
  const std::string member =
      std::string("PK\3\4", 4) + little_endian(20, 2) + little_endian(0, 2) + facts + name + packed;
  const std::string entry = std::string("PK\1\2", 4) + little_endian(20, 2) + little_endian(20, 2) +
                            little_endian(0, 2) + facts + little_endian(0, 14) + name;
  return member + entry + std::string("PK\5\6", 4) + little_endian(0, 4) + little_endian(1, 2) +
         little_endian(1, 2) + little_endian(entry.size(), 4) + little_endian(member.size(), 4) +
         little_endian(0, 2);
}

TEST(ArchivesOfLayers, TakeWhatTheirMembersClaimFromTheMemoryLimit) {
  Execution execution;
  execution.memory_limit = 64 << 20;
  for (const char* name : {"config.ini", "a00000.png"}) {
    const auto read =
        parse_voxels(archive_of(name, "\3", 900 << 20), "sl1", "a.sl1", {}, execution);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::kLimit) << read.error().message;
    EXPECT_NE(read.error().message.find(name), std::string::npos) << read.error().message;
    const auto small = parse_voxels(archive_of(name, "\3", 900), "sl1", "a.sl1", {}, execution);
    ASSERT_FALSE(small);
    EXPECT_EQ(small.error().code, ErrorCode::kInput) << small.error().message;
  }
}

TEST(ArchivesOfLayers, OfSquareDisplaysKeepTheSidesOfVoxels) {
  VoxelGrid grid = make_grid({33, 30, 9});
  grid.voxel_size = {0.05, 0.125, 0.25};
  const VoxelIntervals set = labelled(grid, Axis::kX, [](int i, int j, int k) {
    return i + j + k > 20 ? std::uint32_t{255} : std::uint32_t{0};
  });
  const TemporaryFolder folder;
  VoxelWriterOptions options;
  options.fog = 255;
  options.layers.display = {40, 40};
  ASSERT_TRUE(write_voxels(set, folder.file("a.sl1"), options));
  const auto read = read_voxels(folder.file("a.sl1"));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->grid().dims, glm::ivec3(40, 40, 9));
  EXPECT_NEAR(read->grid().voxel_size.x, 0.05, 1e-9);
  EXPECT_NEAR(read->grid().voxel_size.y, 0.125, 1e-9);
}

}  // namespace
}  // namespace strata::testing
