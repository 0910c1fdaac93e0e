// What the writers write, the readers read: the same voxels, labels and place, for every format.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "strata/voxelize/formats/voxel_writer.h"
#include "strata/voxelize/readers/read_voxels.h"
#include "tests/voxelize/voxel_samples.h"

namespace strata::testing {
namespace {

std::uint32_t label_at(const VoxelIntervals& set, glm::ivec3 at) {
  const AxisFrame frame(set.axis());
  if (!set.contains(at.x, at.y, at.z)) return 0;
  std::uint32_t label = 0;
  for_each_labelled(set, at[frame.u], at[frame.v], [&](const Interval& run, std::uint32_t value) {
    if (at[frame.w] >= run.begin() && at[frame.w] < run.end()) label = value;
  });
  return label;
}

class RoundTrip : public ::testing::TestWithParam<VoxelFormat> {
 protected:
  [[nodiscard]] const VoxelFormat& format() const { return GetParam(); }
  [[nodiscard]] bool is_folder() const { return format().extension.ends_with('/'); }

  std::string write(const VoxelIntervals& set, const VoxelWriterOptions& options = {}) {
    const std::string path =
        folder_.file(std::to_string(files_++) + (is_folder() ? "" : format().extension));
    auto writer = open_voxel_writer(path, format().name, set.grid(), options);
    EXPECT_TRUE(writer) << writer.error().message;
    EXPECT_TRUE((*writer)->add(set, {}) && (*writer)->finish({}));
    return path;
  }
  VoxelVolume round_trip(const VoxelIntervals& set, const VoxelWriterOptions& options = {}) {
    const std::string path = write(set, options);
    EXPECT_TRUE(is_voxel_file(path));
    Result<VoxelVolume> read = read_voxels(path);
    EXPECT_TRUE(read) << read.error().message;
    if (!read) return {};
    EXPECT_EQ(read->format, format().name);
    return std::move(*read);
  }
  /// Where the writer put voxel (0, 0, 0) of its grid: .vox files have their middle at 0.
  [[nodiscard]] glm::ivec3 first_index(const VoxelVolume& volume, const VoxelGrid& grid) const {
    const bool scene = std::max({grid.dims.x, grid.dims.y, grid.dims.z}) > 256;
    return format().name == "vox" && scene ? volume.first_index + grid.dims / 2
                                           : volume.first_index;
  }
  /// Voxels that differ from label(i, j, k).
  template <class Label>
  int wrong(const VoxelVolume& volume, const VoxelGrid& grid, Label&& label) const {
    int count = 0;
    std::uint64_t solid = 0;
    const glm::ivec3 first = first_index(volume, grid);
    for (int k = 0; k < grid.dims.z; ++k) {
      for (int j = 0; j < grid.dims.y; ++j) {
        for (int i = 0; i < grid.dims.x; ++i) {
          const std::uint32_t expected = label(i, j, k);
          solid += expected != 0 ? 1 : 0;
          count += label_at(volume.set, glm::ivec3(i, j, k) - first) != expected;
        }
      }
    }
    EXPECT_EQ(volume.set.solid_voxels(), solid) << "some lie beyond the grid";
    return count;
  }
  /// The grid is the one that was written, or what the format makes of it.
  void expect_grid(const VoxelVolume& volume, const VoxelGrid& grid) const {
    const bool holds = format().name != "npy" && format().name != "vox";
    EXPECT_EQ(volume.placed, holds);
    for (int axis = 0; axis < 3 && holds; ++axis) {
      const double size = grid.voxel_size[axis];
      const bool floats = format().name.starts_with("nii");  // numbers of NIfTI-1
      const double origin = grid.origin[axis] + volume.first_index[axis] * size;
      EXPECT_NEAR(volume.grid().voxel_size[axis], size, floats ? 1e-6 : 1e-15);
      EXPECT_NEAR(volume.grid().origin[axis], origin, floats ? 1e-3 : 1e-9);
    }
    if (format().name == "binvox") {
      EXPECT_EQ(volume.grid().dims, glm::ivec3(std::max({grid.dims.x, grid.dims.y, grid.dims.z})));
    } else if (format().name != "vdb" && format().name != "vox") {
      EXPECT_EQ(volume.grid().dims, grid.dims);
    }
  }

  TemporaryFolder folder_;
  int files_ = 0;
};

/// Those that can be read, and of them those that hold ids.
std::vector<VoxelFormat> readable(bool with_ids) {
  std::vector<VoxelFormat> formats = voxel_formats();
  std::erase_if(formats, [&](const VoxelFormat& format) {
    const auto names = readable_voxel_formats();
    return std::find(names.begin(), names.end(), format.name) == names.end() ||
           format.name == "sl1" || (with_ids && format.ids == 0);
  });
  return formats;
}
std::string format_name(const ::testing::TestParamInfo<VoxelFormat>& info) {
  std::string name = info.param.name;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}
TEST(Readers, ReadEveryFormatThatIsWritten) {
  EXPECT_EQ(readable(false).size() + 4, voxel_formats().size())
      << "but ply, xyz and schem; sl1 holds fractions alone";
}
INSTANTIATE_TEST_SUITE_P(Formats, RoundTrip, ::testing::ValuesIn(readable(false)), format_name);
class IdsRoundTrip : public RoundTrip {};
INSTANTIATE_TEST_SUITE_P(Formats, IdsRoundTrip, ::testing::ValuesIn(readable(true)), format_name);

TEST_P(RoundTrip, GivesTheSameVoxelsAndGrid) {
  for (const Sample& sample : small_samples()) {
    SCOPED_TRACE(sample.name);
    const VoxelVolume volume = round_trip(intervals_of(sample, format().axis));
    EXPECT_EQ(wrong(volume, sample.grid,
                    [&](int i, int j, int k) { return sample.solid(i, j, k) ? 1u : 0u; }),
              0);
    EXPECT_EQ(volume.kind, VoxelKind::kMask);
    expect_grid(volume, sample.grid);
  }
}

TEST_P(RoundTrip, KeepsAnyPlaceInTheWorld) {
  Sample sample = small_samples().front();
  sample.grid.origin = {1.0 / 3, -12345.875, 2e-5};
  if (format().name != "binvox") sample.grid.voxel_size = {0.1, 1.0 / 7, 3.0};
  expect_grid(round_trip(intervals_of(sample, format().axis)), sample.grid);
}

TEST_P(IdsRoundTrip, GivesTheSameIds) {
  for (const std::uint32_t largest : {3u, 255u, 300u, 70000u}) {
    if (largest > format().ids) continue;
    SCOPED_TRACE(largest);
    const VoxelGrid grid = make_grid({37, 70, 91});
    VoxelWriterOptions options;
    options.ids = largest;
    const VoxelVolume volume =
        round_trip(labelled(grid, format().axis, some_ids(largest)), options);
    EXPECT_EQ(wrong(volume, grid, some_ids(largest)), 0);
    EXPECT_EQ(volume.kind, format().name == "vox" ? VoxelKind::kColours : VoxelKind::kIds);
    expect_grid(volume, grid);
  }
}

/// Eight bits of how much of a voxel a ball of radius 11 fills, roughly.
std::uint32_t ball_fraction(int i, int j, int k) {
  const double away =
      std::sqrt((i - 14.3) * (i - 14.3) + (j - 15.1) * (j - 15.1) + (k - 13.8) * (k - 13.8));
  return static_cast<std::uint32_t>(std::clamp((11.5 - away) * 255, 0.0, 255.0));
}

class FractionsRoundTrip : public RoundTrip {
 protected:
  void expect_ball(const VoxelVolume& volume, const VoxelGrid& grid, float tolerance) const {
    EXPECT_EQ(volume.kind, VoxelKind::kValues);
    EXPECT_NEAR(volume.threshold, 127.5f, 0.01f);
    ASSERT_FALSE(volume.values.empty());
    int count = 0, parts = 0;
    for (int k = 0; k < grid.dims.z; ++k) {
      for (int j = 0; j < grid.dims.y; ++j) {
        for (int i = 0; i < grid.dims.x; ++i) {
          const auto wanted = static_cast<float>(ball_fraction(i, j, k));
          const float got = volume.values.value(i, j, k);
          parts += wanted > 0.0f && wanted < 255.0f ? 1 : 0;
          count += std::abs(got - wanted) > tolerance ? 1 : 0;
          count += volume.set.contains(i, j, k) != (got > 127.5f) ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(count, 0);
    EXPECT_GT(parts, 1000);
  }
  static VoxelWriterOptions eight_bits() {
    VoxelWriterOptions options;
    options.fog = 255;
    options.fog_floats = false;
    return options;
  }
  VoxelGrid grid_ = make_grid({33, 30, 29});
};

std::vector<VoxelFormat> with_fractions_of_8_bits() {
  std::vector<VoxelFormat> formats = readable(false);
  std::erase_if(formats,
                [](const VoxelFormat& format) { return !format.shares || format.name == "vdb"; });
  for (const VoxelFormat& format : voxel_formats()) {
    if (format.name == "sl1") formats.push_back(format);
  }
  return formats;
}
INSTANTIATE_TEST_SUITE_P(Formats, FractionsRoundTrip,
                         ::testing::ValuesIn(with_fractions_of_8_bits()), format_name);

TEST_P(FractionsRoundTrip, AreNoIds) {
  const VoxelIntervals ball = labelled(grid_, format().axis, ball_fraction);
  expect_ball(round_trip(ball, eight_bits()), grid_, 0.001f);
  ReadVoxelsOptions ids;
  ids.integers = IntegerVoxels::kIds;
  const Result<VoxelVolume> as_ids = read_voxels(write(ball, eight_bits()), ids);
  ASSERT_TRUE(as_ids);
  EXPECT_EQ(as_ids->kind, VoxelKind::kIds);
}

TEST_P(FractionsRoundTrip, HaveTheirGammaTakenOff) {
  if (format().name != "png" && format().name != "sl1") GTEST_SKIP() << "no gamma";
  VoxelWriterOptions options = eight_bits();
  options.layers.gamma = 0.5;
  // Where few voxels are full the description of the slices tells.
  expect_ball(round_trip(labelled(grid_, format().axis, ball_fraction), options), grid_, 1.1f);
}

class DisplayRoundTrip : public FractionsRoundTrip {};
std::vector<VoxelFormat> with_a_display() {
  std::vector<VoxelFormat> formats = voxel_formats();
  std::erase_if(formats, [](const VoxelFormat& format) { return format.name != "sl1"; });
  return formats;
}
INSTANTIATE_TEST_SUITE_P(Formats, DisplayRoundTrip, ::testing::ValuesIn(with_a_display()),
                         format_name);

TEST_P(DisplayRoundTrip, FractionsLieInItsMiddle) {
  VoxelWriterOptions options = eight_bits();
  options.layers.display = {53, 44};
  for (const bool mirror : {false, true}) {
    options.layers.mirror_left_right = mirror;
    options.layers.mirror_up_down = mirror;
    const VoxelVolume volume = round_trip(labelled(grid_, format().axis, ball_fraction), options);
    EXPECT_FALSE(volume.placed);
    EXPECT_EQ(volume.grid().dims, glm::ivec3(53, 44, 29));
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(volume.grid().voxel_size[axis], grid_.voxel_size[axis], 1e-8);
    }
    int wrong = 0, parts = 0;
    for (int k = 0; k < 29; ++k) {
      for (int j = 0; j < 44; ++j) {
        for (int i = 0; i < 53; ++i) {
          const int x = i - 10, y = j - 7;
          const bool there = x >= 0 && x < 33 && y >= 0 && y < 30;
          const auto wanted = there ? static_cast<float>(ball_fraction(x, y, k)) : 0.0f;
          parts += wanted > 0.0f ? 1 : 0;
          wrong += std::abs(volume.values.value(i, j, k) - wanted) > 0.001f ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(wrong, 0) << mirror;
    EXPECT_GT(parts, 1000);
  }
}

class ColoursRoundTrip : public RoundTrip {};
std::vector<VoxelFormat> readable_colours() {
  std::vector<VoxelFormat> formats = readable(false);
  std::erase_if(formats, [](const VoxelFormat& format) {
    const auto holds = {"npy", "npz", "vox",    "h5",   "nrrd", "raw",      "mha", "nii",
                        "tif", "vti", "nii.gz", "zarr", "vdb",  "ome.zarr", "png"};
    return std::find(holds.begin(), holds.end(), format.name) == holds.end();
  });
  return formats;
}
INSTANTIATE_TEST_SUITE_P(Formats, ColoursRoundTrip, ::testing::ValuesIn(readable_colours()),
                         format_name);

TEST_P(ColoursRoundTrip, GivesTheSameColours) {
  const std::uint32_t most = format().name == "vox" ? 200 : 60000;
  const VoxelGrid grid = make_grid({37, 70, 91});
  const IdOf colour = [&](int i, int j, int k) {
    const std::uint32_t number = some_ids(most)(i, j, k);
    return number == 0 ? 0 : number * 0x9e3779u | 0x80000000u;
  };
  VoxelWriterOptions options;
  options.rgba = true;
  VoxelVolume volume = round_trip(labelled(grid, format().axis, colour), options);
  EXPECT_EQ(volume.kind, VoxelKind::kColours);
  const glm::ivec3 first = first_index(volume, grid);
  int count = 0, solid = 0;
  for (int k = 0; k < grid.dims.z; ++k) {
    for (int j = 0; j < grid.dims.y; ++j) {
      for (int i = 0; i < grid.dims.x; ++i) {
        const std::uint32_t wanted = colour(i, j, k);
        const std::uint32_t label = label_at(volume.set, glm::ivec3(i, j, k) - first);
        solid += wanted != 0;
        if ((label == 0) != (wanted == 0) || label > volume.colours.size()) ++count;
        if (label == 0 || label > volume.colours.size()) continue;
        const glm::u8vec4 got = volume.colours[label - 1];
        count += (got.x | got.y << 8 | got.z << 16) != static_cast<int>(wanted & 0xffffff);
      }
    }
  }
  EXPECT_EQ(count, 0);
  EXPECT_GT(solid, 10000);
}

TEST_P(RoundTrip, IsTheSameForAnyNumberOfThreads) {
  const std::string path = write(intervals_of(small_samples().front(), format().axis));
  Execution one, many;
  one.threads = 1;
  many.threads = 7;
  const Result<VoxelVolume> a = read_voxels(path, {}, one), b = read_voxels(path, {}, many);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->set.axis(), b->set.axis());
  EXPECT_EQ(a->set.interval_count(), b->set.interval_count());
  EXPECT_EQ(a->set.memory_bytes(), b->set.memory_bytes());
  EXPECT_GT(a->set.interval_count(), 10000u);
}

TEST_P(RoundTrip, EveryCutOffFileIsRefused) {
  if (is_folder() || format().name == "raw") GTEST_SKIP() << "several files";
  const Sample sample{"small", make_grid({9, 5, 11}),
                      [](int i, int j, int k) { return random_voxel(i, j, k, 300); }};
  const std::string bytes = testkit::bytes_of(write(intervals_of(sample, format().axis)));
  // The last bytes of some formats hold no voxels.
  const std::map<std::string, std::size_t> ends = {
      {"vti", 50}, {"nrrd", 13}, {"nii.gz", 16}, {"mha", 9}};
  const auto end = ends.find(format().name);
  const std::size_t needless = end == ends.end() ? 0 : end->second;
  for (std::size_t length = 0; length + needless < bytes.size(); length += length < 400 ? 1 : 37) {
    const std::string cut = folder_.write("cut" + format().extension, bytes.substr(0, length));
    const Result<VoxelVolume> read = read_voxels(cut);
    ASSERT_FALSE(read) << "the first " << length << " of " << bytes.size() << " bytes";
    EXPECT_EQ(read.error().code, ErrorCode::kInput) << read.error().message;
    EXPECT_NE(read.error().message.find(cut), std::string::npos) << read.error().message;
  }
}

TEST_P(RoundTrip, TheMemoryLimitHolds) {
  const std::string path = write(intervals_of(small_samples().front(), format().axis));
  Execution execution;
  execution.memory_limit = 100000;
  const Result<VoxelVolume> read = read_voxels(path, {}, execution);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::kLimit) << read.error().message;
}

TEST_P(RoundTrip, AStopEndsTheWork) {
  const std::string path = write(intervals_of(small_samples().front(), format().axis));
  std::stop_source source;
  source.request_stop();
  Execution execution;
  execution.stop = source.get_token();
  const Result<VoxelVolume> read = read_voxels(path, {}, execution);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::kCancelled) << read.error().message;
}

TEST(SliceReader, ReadsMirroredSlicesAndRefusesThoseOfOtherAxes) {
  const TemporaryFolder folder;
  const VoxelGrid grid = make_grid({37, 20, 9});
  const IdOf label = some_ids(200);
  const VoxelIntervals set = labelled(grid, Axis::kX, label);
  VoxelWriterOptions options;
  options.ids = 200;
  options.layers.mirror_left_right = options.layers.mirror_up_down = true;
  const auto write = [&](const std::string& name) {
    auto writer = open_voxel_writer(folder.file(name), "png", grid, options);
    EXPECT_TRUE(writer && (*writer)->add(set, {}) && (*writer)->finish({}));
    return read_voxels(folder.file(name));
  };
  const Result<VoxelVolume> read = write("mirrored");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(to_dense_labels(read->set).value(), to_dense_labels(set).value());
  options.layers.axis = Axis::kY;
  const Result<VoxelVolume> refused = write("front");
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("slice_axis must be z to be read, got 'y'"),
            std::string::npos)
      << refused.error().message;
}

}  // namespace
}  // namespace strata::testing
