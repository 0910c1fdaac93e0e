// Files whose voxels have shares or colours.

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "strata/voxelize/formats/voxel_writer.h"
#include "tests/voxelize/formats/voxel_readers.h"
#include "tests/voxelize/voxel_samples.h"

namespace strata::testing {
namespace {

constexpr std::uint32_t kFog = 64;

ReadVoxels read(const std::string& path, const std::string& format) {
  if (format == "npy") return read_npy(path);
  if (format == "npz") return read_npz(path);
  if (format == "nrrd") return read_nrrd(path);
  if (format == "vti") return read_vti(path);
  if (format == "png") return read_png_folder(path);
  if (format == "nii" || format == "nii.gz") return read_nii(path);
  if (format == "mha") return read_mha(path);
  if (format == "raw") return read_raw(path);
  if (format == "tif") return read_tif(path);
  if (format == "h5") return read_h5(path);
  return read_zarr(path);
}

VoxelWriterOptions shares(bool floats) {
  VoxelWriterOptions options;
  options.fog = kFog;
  options.fog_floats = floats;
  return options;
}

VoxelWriterOptions colours() {
  VoxelWriterOptions options;
  options.rgba = true;
  return options;
}

VoxelWriterOptions distances() {
  VoxelWriterOptions options;
  options.band = 1.0f;
  return options;
}

/// write_vdb_test.cpp reads .vdb, with OpenVDB.
std::vector<VoxelFormat> dense_formats() {
  std::vector<VoxelFormat> formats = voxel_formats();
  std::erase_if(formats, [](const VoxelFormat& f) {
    return !f.shares || f.name == "vdb" || f.name == "ome.zarr" || f.name == "sl1";
  });
  return formats;
}

class Values : public ::testing::TestWithParam<VoxelFormat> {
 protected:
  /// What the file says of `set`, which `axis` and slabs do not change.
  ReadVoxels written(const IdOf& label, const VoxelWriterOptions& options, int slab_tiles) {
    const VoxelIntervals set = labelled(make_grid({75, 70, 66}), GetParam().axis, label);
    const std::string path = folder_.file("out" + std::to_string(slab_tiles));
    auto writer = open_voxel_writer(path, GetParam().name, set.grid(), options);
    EXPECT_TRUE(writer) << writer.error().message;
    Execution execution;
    execution.threads = 2;
    for (const VoxelIntervals& slab : cut(set, slab_tiles)) {
      EXPECT_TRUE((*writer)->add(slab, execution));
    }
    EXPECT_TRUE((*writer)->finish(execution));
    return read(path, GetParam().name);
  }
  /// Voxels whose value is not `expected(label)`.
  static int wrong(const ReadVoxels& voxels, const IdOf& label, auto&& expected) {
    int count = 0, filled = 0;
    for (int k = 0; k < voxels.dims.z; ++k) {
      for (int j = 0; j < voxels.dims.y; ++j) {
        for (int i = 0; i < voxels.dims.x; ++i) {
          const std::uint32_t given = label(i, j, k);
          filled += given != 0;
          count += voxels.ids[voxels.index(i, j, k)] != (given == 0 ? 0 : expected(given));
        }
      }
    }
    EXPECT_GT(filled, 1000);
    return count;
  }
  TemporaryFolder folder_;
};
std::string name_of(const ::testing::TestParamInfo<VoxelFormat>& info) {
  std::string name = info.param.name;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Formats, Values, ::testing::ValuesIn(dense_formats()), name_of);

TEST_P(Values, SharesAreBytesRounded) {
  const IdOf label = some_ids(kFog);
  const ReadVoxels voxels = written(label, shares(false), 1);
  EXPECT_EQ(voxels.id_bits, 8);
  EXPECT_FALSE(voxels.floats);
  EXPECT_EQ(wrong(voxels, label,
                  [](std::uint32_t n) {
                    return static_cast<std::uint32_t>(std::lround(255.0 * n / kFog));
                  }),
            0);
}

TEST_P(Values, SharesAreFloats) {
  if (GetParam().name == "png") GTEST_SKIP() << "pictures hold bytes";
  const IdOf label = some_ids(kFog);
  const ReadVoxels voxels = written(label, shares(true), 1);
  EXPECT_EQ(voxels.id_bits, 32);
  EXPECT_TRUE(voxels.floats);
  EXPECT_EQ(wrong(voxels, label,
                  [](std::uint32_t n) {
                    return std::bit_cast<std::uint32_t>(static_cast<float>(n) / float{kFog});
                  }),
            0);
}

TEST_P(Values, SlabsWithoutLabelsAreFilled) {
  const IdOf full = [](int i, int j, int k) -> std::uint32_t { return (i / 9 + j / 7 + k) % 2; };
  const VoxelIntervals set = intervals_of(
      Sample{"", make_grid({75, 70, 66}), [&](int i, int j, int k) { return full(i, j, k) != 0; }},
      GetParam().axis);
  ASSERT_FALSE(set.has_labels());
  const std::string path = folder_.file("full");
  auto writer = open_voxel_writer(path, GetParam().name, set.grid(), shares(false));
  ASSERT_TRUE(writer) << writer.error().message;
  ASSERT_TRUE((*writer)->add(set, {}));
  ASSERT_TRUE((*writer)->finish({}));
  EXPECT_EQ(wrong(read(path, GetParam().name), full, [](std::uint32_t) { return 255u; }), 0);
}

TEST_P(Values, ColoursAreFourBytes) {
  const IdOf few = some_ids(300);
  const IdOf label = [&](int i, int j, int k) {
    return few(i, j, k) == 0 ? 0u : few(i, j, k) * 0x9e3779b9u | 0x01000000u;
  };
  const ReadVoxels voxels = written(label, colours(), 1);
  EXPECT_EQ(voxels.id_bits, 32);
  EXPECT_FALSE(voxels.floats);
  EXPECT_EQ(wrong(voxels, label, [](std::uint32_t n) { return n; }), 0);
}

TEST(ValuesOfFormats, AreRefusedWhereAFormatHoldsThemNot) {
  int refused = 0;
  for (const VoxelFormat& format : voxel_formats()) {
    SCOPED_TRACE(format.name);
    for (const auto& [held, options] : {std::pair{format.shares, shares(true)},
                                        {format.rgba, colours()},
                                        {format.distances, distances()}}) {
      const Result<void> checked = check_values(format, options);
      EXPECT_EQ(checked.has_value(), held);
      if (checked) continue;
      ++refused;
      EXPECT_EQ(checked.error().code, ErrorCode::kUsage);
      EXPECT_NE(checked.error().message.find("format " + format.name + " holds no "),
                std::string::npos)
          << checked.error().message;
    }
  }
  EXPECT_GT(refused, 0);
  const Result<void> binvox = check_values(*voxel_format_for("a.binvox", ""), colours());
  ASSERT_FALSE(binvox);
  EXPECT_NE(binvox.error().message.find("npy, npz, nrrd, vti"), std::string::npos)
      << binvox.error().message;
}

TEST(ValuesOfFormats, IdsBeyondThoseOfAllFormatsNameTheLargest) {
  VoxelWriterOptions options;
  options.ids = 4'000'000'000;
  for (const char* path : {"a.npy", "a.binvox"}) {
    const Result<void> refused = check_values(*voxel_format_for(path, ""), options);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message, "ids of voxels must be at most 2147483647, got 4000000000");
  }
}

TEST(ValuesOfFormats, OfTwoKindsAreRefused) {
  VoxelWriterOptions options = shares(true);
  options.rgba = true;
  const Result<void> refused = check_values(*voxel_format_for("a.npy", ""), options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
}

}  // namespace
}  // namespace strata::testing
