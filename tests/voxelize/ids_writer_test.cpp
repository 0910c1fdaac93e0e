// Files whose voxels have ids: values that say which solid a voxel is of.

#include <gtest/gtest.h>

#include "tests/voxelize/voxel_readers.h"
#include "tests/voxelize/voxel_samples.h"
#include "voxelize/voxel_writer.h"

namespace strata::testing {
namespace {

using IdOf = std::function<std::uint32_t(int, int, int)>;

/// Labelled intervals by brute force, of all rows.
VoxelIntervals labelled(const VoxelGrid& grid, Axis axis, const IdOf& id) {
  const AxisFrame frame(axis);
  VoxelIntervals result(grid, axis);
  constexpr int kSide = VoxelIntervals::kTileSide;
  for (int tile = 0; tile < result.tiles_u() * result.tiles_v(); ++tile) {
    const int tu = tile % result.tiles_u(), tv = tile / result.tiles_u();
    std::vector<std::uint32_t> offsets(1, 0), labels;
    std::vector<Interval> items;
    for (int local = 0; local < kSide * kSide; ++local) {
      glm::ivec3 at(0);
      at[frame.u] = tu * kSide + local % kSide;
      at[frame.v] = tv * kSide + local / kSide;
      std::uint32_t last = 0;
      for (int k = 0; k < grid.dims[frame.w]; ++k) {
        if (at[frame.u] >= grid.dims[frame.u] || at[frame.v] >= grid.dims[frame.v]) break;
        at[frame.w] = k;
        const std::uint32_t now = id(at.x, at.y, at.z);
        const auto place = static_cast<std::uint16_t>(k);
        if (now != 0 && now != last) {
          items.push_back({place, place});
          labels.push_back(now);
        }
        if (now != 0) items.back().last = place;
        last = now;
      }
      offsets.push_back(static_cast<std::uint32_t>(items.size()));
    }
    if (!items.empty()) result.set_tile(tu, tv, offsets, items, labels);
  }
  return result;
}

/// Cuts labelled intervals into slabs of a row of tiles.
std::vector<VoxelIntervals> rows_of(const VoxelIntervals& set) {
  std::vector<VoxelIntervals> slabs;
  constexpr int kSide = VoxelIntervals::kTileSide;
  for (int tv = 0; tv < set.tiles_v(); ++tv) {
    VoxelIntervals& slab = slabs.emplace_back(set.grid(), set.axis(), tv * kSide,
                                              std::min((tv + 1) * kSide, set.v_end()));
    for (int tu = 0; tu < set.tiles_u(); ++tu) {
      if (set.tile_empty(tu, tv)) continue;
      const auto tile = set.tile(tu, tv);
      slab.set_tile(tu, 0, tile.offsets, tile.items, tile.labels);
    }
  }
  return slabs;
}

ReadVoxels read(const std::string& path, const std::string& format, glm::ivec3 dims) {
  if (format == "npy") return read_npy(path);
  if (format == "nrrd") return read_nrrd(path);
  if (format == "vti") return read_vti(path);
  if (format == "vox") return read_vox(path, dims);
  if (format == "png") return read_png_folder(path);
  return read_zarr(path);
}

/// Blocks, and some voxels by themselves; ids up to `largest`, which is there.
IdOf some_ids(std::uint32_t largest) {
  return [largest](int i, int j, int k) -> std::uint32_t {
    if (i + j + k == 0) return largest;
    if (random_voxel(i, j, k, 20)) {
      return 1 + static_cast<std::uint32_t>(i * 7919 + j * 104729 + k * 1299709) % largest;
    }
    if (!random_voxel(i / 9, j / 9, k / 9, 600)) return 0;
    return 1 + static_cast<std::uint32_t>(i / 9 * 31 + j / 9 * 1009 + k / 9 * 65537) % largest;
  };
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
std::string name_of(const ::testing::TestParamInfo<VoxelFormat>& info) { return info.param.name; }
INSTANTIATE_TEST_SUITE_P(Formats, Ids, ::testing::ValuesIn(formats_with_ids()), name_of);

TEST_P(Ids, AreReadBackInTheNarrowestType) {
  for (const std::uint32_t largest : {1u, 2u, 255u, 256u, 65535u, 65536u, 3'000'000u}) {
    if (largest > GetParam().ids) continue;
    SCOPED_TRACE(largest);
    const VoxelGrid grid = make_grid({75, 70, 66});
    const IdOf id = some_ids(largest);
    const std::vector<VoxelIntervals> slabs = rows_of(labelled(grid, GetParam().axis, id));
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

TEST_P(Ids, AreTheSameBytesForAnyThreadsAndSlabs) {
  const std::uint32_t largest = std::min(GetParam().ids, 1000u);
  std::vector<VoxelIntervals> whole;
  whole.push_back(labelled(make_grid({20, 70, 140}), GetParam().axis, some_ids(largest)));
  ASSERT_TRUE(write("a", whole, largest, 1));
  ASSERT_TRUE(write("b", rows_of(whole.front()), largest, 5));
  const std::string a = folder_.file("a"), b = folder_.file("b");
  if (!std::filesystem::is_directory(a)) {
    EXPECT_EQ(file_bytes(a), file_bytes(b));
    return;
  }
  for (const auto& entry : std::filesystem::directory_iterator(a)) {
    EXPECT_EQ(file_bytes(entry.path()), file_bytes(b / entry.path().filename()));
  }
}

TEST_P(Ids, BeyondWhatTheFormatHoldsAreRefused) {
  if (GetParam().ids > 0xffff) return;
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
  EXPECT_NE(refused.error().message.find("npy, nrrd, vti"), std::string::npos)
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
