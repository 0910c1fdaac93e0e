// Files whose voxels have ids: values that say which solid a voxel is of.

#include <gtest/gtest.h>

#include "strata/voxelize/formats/voxel_writer.h"
#include "tests/voxelize/formats/voxel_readers.h"
#include "tests/voxelize/voxel_samples.h"

namespace strata::testing {
namespace {

ReadVoxels read(const std::string& path, const std::string& format, glm::ivec3 dims) {
  if (format == "npy") return read_npy(path);
  if (format == "npz") return read_npz(path);
  if (format == "nrrd") return read_nrrd(path);
  if (format == "vti") return read_vti(path);
  if (format == "vox") return read_vox(path, dims);
  if (format == "png") return read_png_folder(path);
  if (format == "nii" || format == "nii.gz") return read_nii(path);
  if (format == "mha") return read_mha(path);
  if (format == "raw") return read_raw(path);
  if (format == "tif") return read_tif(path);
  if (format == "h5") return read_h5(path);
  return read_zarr(path);
}

std::vector<VoxelFormat> formats_with_ids() {
  std::vector<VoxelFormat> formats = voxel_formats();
  std::erase_if(formats, [](const VoxelFormat& format) { return format.ids == 0; });
  return formats;
}

class Ids : public ::testing::TestWithParam<VoxelFormat> {
 protected:
  Result<void> write(const std::string& name, const std::vector<VoxelIntervals>& slabs,
                     std::uint32_t largest, int threads) {
    VoxelWriterOptions options;
    options.ids = largest;
    auto writer =
        open_voxel_writer(folder_.file(name), GetParam().name, slabs.front().grid(), options);
    if (!writer) return tl::unexpected(writer.error());
    Execution execution;
    execution.threads = threads;
    for (const VoxelIntervals& slab : slabs) {
      if (auto added = (*writer)->add(slab, execution); !added) return added;
    }
    return (*writer)->finish(execution);
  }
  TemporaryFolder folder_;
};
std::string name_of(const ::testing::TestParamInfo<VoxelFormat>& info) {
  std::string name = info.param.name;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Formats, Ids, ::testing::ValuesIn(formats_with_ids()), name_of);

/// write_vdb_test.cpp reads those of .vdb, with OpenVDB, and coloured_files_test.cpp those of
/// points.
std::vector<VoxelFormat> formats_read_here() {
  std::vector<VoxelFormat> formats = formats_with_ids();
  std::erase_if(formats, [](const VoxelFormat& format) {
    return format.name == "vdb" || format.name == "ome.zarr" || format.name == "ply" ||
           format.name == "xyz";
  });
  return formats;
}
class ReadIds : public Ids {};
INSTANTIATE_TEST_SUITE_P(Formats, ReadIds, ::testing::ValuesIn(formats_read_here()), name_of);

TEST_P(ReadIds, AreThoseWrittenInTheNarrowestType) {
  for (const std::uint32_t largest : {1u, 2u, 255u, 256u, 65535u, 65536u, 3'000'000u}) {
    if (largest > GetParam().ids) continue;
    SCOPED_TRACE(largest);
    const VoxelGrid grid = make_grid({75, 70, 66});
    const IdOf id = some_ids(largest);
    const std::vector<VoxelIntervals> slabs = cut(labelled(grid, GetParam().axis, id), 1);
    const std::string name = "ids" + std::to_string(largest);
    const auto written = write(name, slabs, largest, 2);
    ASSERT_TRUE(written) << written.error().message;
    const ReadVoxels voxels = read(folder_.file(name), GetParam().name, grid.dims);
    if (GetParam().name != "vox") {
      EXPECT_EQ(voxels.id_bits, largest < 256 ? 8 : largest < 65536 ? 16 : 32);
    }
    int wrong = 0;
    for (int k = 0; k < grid.dims.z; ++k) {
      for (int j = 0; j < grid.dims.y; ++j) {
        for (int i = 0; i < grid.dims.x; ++i) {
          wrong += voxels.ids[voxels.index(i, j, k)] != id(i, j, k) ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(wrong, 0);
  }
}

TEST_P(Ids, AreTheSameBytesForAnyThreadsSlabsAndAxis) {
  const std::uint32_t largest = std::min(GetParam().ids, 1000u);
  const auto of_axis = [&](Axis axis) {
    return labelled(make_grid({20, 70, 140}), axis, some_ids(largest));
  };
  ASSERT_TRUE(write("a", cut(of_axis(GetParam().axis), 1000), largest, 1));
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    const std::string name(1, "xyz"[static_cast<int>(axis)]);
    ASSERT_TRUE(write(name, cut(of_axis(axis), 1), largest, 5));
    const std::filesystem::path a = folder_.file("a"), b = folder_.file(name);
    if (!std::filesystem::is_directory(a)) {
      EXPECT_EQ(testkit::bytes_of(a), testkit::bytes_of(b));
      continue;
    }
    for (const auto& entry : std::filesystem::recursive_directory_iterator(a)) {
      if (entry.is_directory()) continue;
      EXPECT_EQ(testkit::bytes_of(entry.path()),
                testkit::bytes_of(b / entry.path().lexically_relative(a)));
    }
  }
}

/// .vox and PNG; the others hold any id that there can be.
std::vector<VoxelFormat> formats_with_few_ids() {
  std::vector<VoxelFormat> formats = formats_with_ids();
  std::erase_if(formats, [](const VoxelFormat& format) { return format.ids > 0xffff; });
  return formats;
}
class FewIds : public Ids {};
INSTANTIATE_TEST_SUITE_P(Formats, FewIds, ::testing::ValuesIn(formats_with_few_ids()), name_of);

TEST_P(FewIds, BeyondWhatTheFormatHoldsAreRefused) {
  std::vector<VoxelIntervals> empty;
  empty.emplace_back(make_grid({8, 8, 8}), GetParam().axis);
  const auto refused = write("a", empty, GetParam().ids + 1, 1);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
  EXPECT_NE(refused.error().message.find("npy"), std::string::npos) << refused.error().message;
}

TEST(IdsOfOtherFormats, AreRefusedWithTheNamesOfThoseThatHoldThem) {
  const TemporaryFolder folder;
  VoxelWriterOptions options;
  options.ids = 3;
  const auto refused =
      open_voxel_writer(folder.file("a.binvox"), "", make_grid({8, 8, 8}), options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
  EXPECT_NE(refused.error().message.find("npy, npz, nrrd, vti"), std::string::npos)
      << refused.error().message;
}

TEST(LabelledIntervals, CountTheirRunsOnce) {
  const VoxelIntervals set =
      labelled(make_grid({4, 4, 9}), Axis::kZ, [](int i, int, int k) -> std::uint32_t {
        return k == 8 ? 0 : i == 0 ? 1 + static_cast<std::uint32_t>(k) / 3 : i == 1 ? 5 : 0;
      });
  EXPECT_EQ(set.column(0, 0).size(), 3u);
  EXPECT_EQ(set.column_labels(0, 0).size(), 3u);
  EXPECT_EQ(run_count(set.column(0, 0)), 1u);
  EXPECT_EQ(set.interval_count(), 8u);
  EXPECT_EQ(set.solid_voxels(), 2u * 4 * 8);
}

}  // namespace
}  // namespace strata::testing
