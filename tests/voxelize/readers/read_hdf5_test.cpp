// HDF5 files as other programs write them, and those that must be refused.

#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "strata/voxelize/formats/voxel_writer.h"
#include "strata/voxelize/readers/read_voxel_grid.h"
#include "strata/voxelize/readers/read_voxels.h"
#include "tests/voxelize/voxel_samples.h"

namespace strata::testing {
namespace {

using Shape = std::vector<hsize_t>;

class Hdf5Files : public ::testing::Test {
 protected:
  Hdf5Files() : path_(folder_.file("other.h5")) {
    file_ = H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(file_, 0);
  }
  ~Hdf5Files() override { close(); }
  void close() {
    if (file_ >= 0) H5Fclose(file_);
    file_ = -1;
  }
  /// A data set of 16-bit numbers, element n of which is n % 251. Its properties are closed.
  void add(const std::string& name, const Shape& shape, hid_t properties = H5P_DEFAULT,
           bool fill = true) {
    const int rank = static_cast<int>(shape.size());
    const hid_t space = H5Screate_simple(rank, shape.data(), nullptr);
    const hid_t links = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_create_intermediate_group(links, 1);
    const hid_t set =
        H5Dcreate2(file_, name.c_str(), H5T_STD_U16BE, space, links, properties, H5P_DEFAULT);
    EXPECT_GE(set, 0);
    std::size_t count = 1;
    for (const hsize_t side : shape) count *= fill ? side : 0;
    std::vector<std::uint16_t> numbers(count);
    for (std::size_t i = 0; i < count; ++i) numbers[i] = static_cast<std::uint16_t>(i / 7 % 251);
    if (fill) {
      EXPECT_GE(H5Dwrite(set, H5T_NATIVE_UINT16, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()), 0);
    }
    H5Dclose(set), H5Pclose(links), H5Sclose(space);
    if (properties != H5P_DEFAULT) H5Pclose(properties);
  }
  static hid_t chunks(const Shape& shape) {
    const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(properties, static_cast<int>(shape.size()), shape.data());
    return properties;
  }
  void expect_error(ErrorCode code, const std::string& words) {
    close();
    const Result<VoxelVolume> read = read_voxels(path_);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, code);
    EXPECT_NE(read.error().message.find(words), std::string::npos) << read.error().message;
    EXPECT_NE(read.error().message.find(path_), std::string::npos) << read.error().message;
  }

  TemporaryFolder folder_;
  std::string path_;
  hid_t file_ = -1;
};

TEST_F(Hdf5Files, ArraysOfOtherProgramsAreReadAsZYX) {
  add("b/table", {40, 3});                                    // not an array of voxels
  add("c/data", {1, 5, 6, 70, 1}, chunks({1, 2, 4, 64, 1}));  // time and channel of one index
  add("d/later", {2, 2, 2});
  close();
  const Result<VoxelVolume> read = read_voxels(path_);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->grid().dims, glm::ivec3(70, 6, 5));
  EXPECT_FALSE(read->placed);
  const auto labels = to_dense_labels(read->set).value();
  ASSERT_EQ(labels.size(), 5u * 6 * 70);
  int wrong = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) wrong += labels[i] != i / 7 % 251;
  EXPECT_EQ(wrong, 0);
}

TEST_F(Hdf5Files, WhatIsNoArrayOfVoxelsIsRefused) {
  add("table", {40, 3});
  expect_error(ErrorCode::kInput, "no data set of numbers with three axes");
}

TEST_F(Hdf5Files, SeveralChannelsAreRefused) {
  add("voxels", {4, 5, 6, 2});
  expect_error(ErrorCode::kInput, "no data set of numbers with three axes");
}

TEST_F(Hdf5Files, OtherFilesAreNotOpened) {
  const hid_t outside = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_external(outside, "/etc/hostname", 0, 4 * 4 * 4 * 2);
  add("voxels", {4, 4, 4}, outside, false);
  expect_error(ErrorCode::kInput, "in other files");
}

TEST_F(Hdf5Files, LinksToOtherFilesAreNotFollowed) {
  const std::string other = folder_.file("target.h5");
  VoxelWriterOptions options;
  ASSERT_TRUE(write_voxels(intervals_of(small_samples().front(), Axis::kX), other, options));
  H5Lcreate_external(other.c_str(), "/voxels", file_, "voxels", H5P_DEFAULT, H5P_DEFAULT);
  expect_error(ErrorCode::kInput, "no data set of numbers with three axes");
}

TEST_F(Hdf5Files, SizesAreCheckedBeforeMemoryIsTaken) {
  add("voxels", {1u << 20, 1u << 20, 1u << 20}, chunks({1, 64, 64}), false);
  close();
  const Result<VoxelVolume> read = read_voxels(path_);
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("1048576"), std::string::npos) << read.error().message;
}

TEST_F(Hdf5Files, ALargeChunkIsALimitError) {
  add("voxels", {1000, 1000, 1000}, chunks({1000, 1000, 1000}), false);
  close();
  Execution execution;
  execution.memory_limit = 100'000'000;
  const Result<VoxelVolume> read = read_voxels(path_, {}, execution);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::kLimit) << read.error().message;
}

TEST_F(Hdf5Files, FiltersOfChunksAreUndone) {
  const Shape shape = {5, 30, 70}, side = {2, 13, 64};  // chunks reach beyond the shape
  const hid_t packed = chunks(side);
  H5Pset_fletcher32(packed);
  H5Pset_shuffle(packed);
  H5Pset_deflate(packed, 6);
  add("voxels", shape, packed);
  close();
  const Result<VoxelVolume> read = read_voxels(path_);
  ASSERT_TRUE(read) << read.error().message;
  const auto labels = to_dense_labels(read->set).value();
  ASSERT_EQ(labels.size(), 5u * 30 * 70);
  int wrong = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) wrong += labels[i] != i / 7 % 251;
  EXPECT_EQ(wrong, 0);

  // The checksum guards what zlib does not: with it alone, a changed number is an error.
  std::string bytes = testkit::bytes_of(path_);
  file_ = H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t summed = chunks(side);
  H5Pset_fletcher32(summed);
  add("voxels", shape, summed);
  close();
  ASSERT_TRUE(read_voxels(path_));
  bytes = testkit::bytes_of(path_);
  const std::size_t at = bytes.find(std::string("\0\x9\0\x9\0\x9", 6));
  ASSERT_NE(at, std::string::npos);
  bytes[at + 1] = 8;
  folder_.write("other.h5", bytes);
  expect_error(ErrorCode::kInput, "its checksum is wrong");
}

TEST_F(Hdf5Files, OtherFiltersAreRefused) {
  const hid_t packed = chunks({2, 2, 2});
  H5Pset_scaleoffset(packed, H5Z_SO_INT, 0);
  add("voxels", {4, 4, 4}, packed);
  expect_error(ErrorCode::kInput, "packed by filter 6; deflate, shuffle and fletcher32 are read");
}

TEST_F(Hdf5Files, ChunksThatAreNotThereHaveTheFillValue) {
  const hid_t properties = chunks({2, 4, 4});
  const std::uint16_t seven = 7;
  H5Pset_fill_value(properties, H5T_NATIVE_UINT16, &seven);
  add("voxels", {4, 4, 4}, properties, false);
  close();
  const Result<VoxelVolume> read = read_voxels(path_);
  ASSERT_TRUE(read) << read.error().message;
  const auto labels = to_dense_labels(read->set).value();
  EXPECT_EQ(std::count(labels.begin(), labels.end(), 7u), 4 * 4 * 4);
}

TEST_F(Hdf5Files, ChunksOfWrongSizesThatCancelAreDamaged) {
  constexpr std::uint32_t kBytes = 64 * 64 * 64 * 2;
  add("voxels", {128, 64, 64}, chunks({64, 64, 64}));
  close();
  std::string bytes = testkit::bytes_of(path_);
  const std::size_t tree = bytes.find("TREE\x01");  // a node of chunks; its keys begin 24 bytes on
  ASSERT_NE(tree, std::string::npos);
  constexpr std::size_t kKeys = 24, kStride = 48;
  for (const std::uint32_t size : {2 * kBytes - 1, 1u}) {
    const std::size_t at = tree + kKeys + (size == 1 ? kStride : 0);
    std::uint32_t before = 0;
    std::memcpy(&before, bytes.data() + at, sizeof before);
    ASSERT_EQ(before, kBytes);
    std::memcpy(bytes.data() + at, &size, sizeof size);
  }
  folder_.write("other.h5", bytes);
  expect_error(ErrorCode::kInput, "smaller than a chunk");
}

TEST(Hdf5Damage, OfAnyByteEndsInAnOrderlyWay) {
  const TemporaryFolder folder;
  const Sample sample{"", make_grid({12, 11, 5}),
                      [](int i, int j, int k) { return random_voxel(i, j, k, 300); }};
  const std::string path = folder.file("a.h5");
  ASSERT_TRUE(write_voxels(intervals_of(sample, Axis::kX), path));
  const std::string bytes = testkit::bytes_of(path);
  int refused = 0;
  Execution execution;
  execution.memory_limit = 1 << 28;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::string changed = bytes;
    changed[i] = static_cast<char>(i % 2 == 0 ? ~changed[i] : changed[i] + 1);
    folder.write("a.h5", changed);
    const Result<VoxelVolume> read = read_voxels(path, {}, execution);
    refused += read ? 0 : 1;
  }
  EXPECT_GT(refused, 100);
}

TEST(Hdf5Grid, IsTheOneThatWasWritten) {
  const TemporaryFolder folder;
  const Sample sample{"", make_grid({9, 5, 11}, {-3.5, 20.25, 1.125}, {0.5, 0.25, 0.75}),
                      [](int i, int j, int k) { return random_voxel(i, j, k, 300); }};
  VoxelWriterOptions options;
  options.frame.direction = glm::dmat3(0.6, 0.8, 0.0, -0.8, 0.6, 0.0, 0.0, 0.0, 1.0);
  options.frame.unit_metres = 1e-3;
  options.frame.space = "right-anterior-superior";
  const std::string path = folder.file("a.h5");
  ASSERT_TRUE(write_voxels(intervals_of(sample, Axis::kX), path, options));
  const Result<VoxelFileGrid> read = read_voxel_grid(path);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->grid.dims, sample.grid.dims);
  EXPECT_EQ(read->frame.space, options.frame.space);
  EXPECT_EQ(read->frame.unit_metres, 1e-3);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(read->grid.origin[axis], sample.grid.origin[axis], 1e-12);
    EXPECT_NEAR(read->grid.voxel_size[axis], sample.grid.voxel_size[axis], 1e-15);
    for (int row = 0; row < 3; ++row) {
      EXPECT_NEAR(read->frame.direction[axis][row], options.frame.direction[axis][row], 1e-12);
    }
  }
}

}  // namespace
}  // namespace strata::testing
