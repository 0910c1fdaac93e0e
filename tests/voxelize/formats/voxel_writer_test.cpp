#include "strata/voxelize/formats/voxel_writer.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "tests/voxelize/formats/voxel_readers.h"
#include "tests/voxelize/voxel_samples.h"

namespace strata::testing {
namespace {

bool is_folder(const VoxelFormat& format) { return format.extension.ends_with('/'); }

Result<void> write(const std::string& path, const std::string& format, const VoxelIntervals& set,
                   int threads = 2, int slab_tiles = 1000) {
  Execution execution;
  execution.threads = threads;
  auto writer = open_voxel_writer(path, format, set.grid());
  if (!writer) return tl::unexpected(writer.error());
  for (const VoxelIntervals& slab : cut(set, slab_tiles)) {
    if (auto added = (*writer)->add(slab, execution); !added) return added;
  }
  return (*writer)->finish(execution);
}

ReadVoxels read(const std::string& path, const std::string& format, glm::ivec3 dims) {
  if (format == "npy") return read_npy(path);
  if (format == "npz") return read_npz(path);
  if (format == "nrrd") return read_nrrd(path);
  if (format == "vti") return read_vti(path);
  if (format == "binvox") return read_binvox(path, dims);
  if (format == "vox") return read_vox(path, dims);
  if (format == "png") return read_png_folder(path);
  if (format == "nii" || format == "nii.gz") return read_nii(path);
  if (format == "mha") return read_mha(path);
  if (format == "raw") return read_raw(path);
  if (format == "tif") return read_tif(path);
  if (format == "h5") return read_h5(path);
  if (format == "zarr") return read_zarr(path);
  throw std::runtime_error("no reader for " + format);
}

/// All bytes of a file, or of the files of a folder with their names.
std::string all_bytes(const std::string& path) {
  if (!std::filesystem::is_directory(path)) return testkit::bytes_of(path);
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(path)) {
    if (!entry.is_directory()) files.push_back(entry);
  }
  std::sort(files.begin(), files.end());
  std::string bytes;
  for (const auto& file : files) {
    bytes += file.lexically_relative(path).string() + "\n" + testkit::bytes_of(file);
  }
  return bytes;
}

/// With the header of a .raw.
void remove_output(const std::string& path) {
  std::filesystem::remove_all(path);
  std::filesystem::remove(path + ".nhdr");
}

std::string name_of(const ::testing::TestParamInfo<VoxelFormat>& info) {
  std::string name = info.param.name;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}

class Writer : public ::testing::TestWithParam<VoxelFormat> {
 protected:
  [[nodiscard]] const VoxelFormat& format() const { return GetParam(); }
  TemporaryFolder folder_;
};

/// All but .sl1, whose bytes have the file's name; layers_writer_test.cpp reads it.
std::vector<VoxelFormat> grids() {
  std::vector<VoxelFormat> formats = voxel_formats();
  std::erase_if(formats, [](const VoxelFormat& format) { return format.name == "sl1"; });
  return formats;
}

std::vector<VoxelFormat> single_files() {
  std::vector<VoxelFormat> formats = grids();
  std::erase_if(formats, is_folder);
  return formats;
}

/// All but .vdb, which OpenVDB reads back in write_vdb_test.cpp, and those of
/// coloured_files_test.cpp.
std::vector<VoxelFormat> formats_read_here() {
  std::vector<VoxelFormat> formats = grids();
  std::erase_if(formats, [](const VoxelFormat& format) {
    return format.name == "vdb" || format.name == "ome.zarr" || format.name == "ply" ||
           format.name == "xyz" || format.name == "schem";
  });
  return formats;
}

INSTANTIATE_TEST_SUITE_P(Formats, Writer, ::testing::ValuesIn(grids()), name_of);

class ReadBack : public Writer {};
INSTANTIATE_TEST_SUITE_P(Formats, ReadBack, ::testing::ValuesIn(formats_read_here()), name_of);

TEST_P(ReadBack, RoundTripGivesTheSameVoxels) {
  for (const Sample& sample : small_samples()) {
    SCOPED_TRACE(sample.name);
    const std::string path = folder_.file(sample.name);
    const auto written = write(path, format().name, intervals_of(sample, format().axis));
    ASSERT_TRUE(written) << written.error().message;
    const glm::ivec3 dims = sample.grid.dims;
    const ReadVoxels voxels = read(path, format().name, dims);
    ASSERT_EQ(voxels.dims, dims);
    int wrong = 0;
    for (int k = 0; k < dims.z; ++k) {
      for (int j = 0; j < dims.y; ++j) {
        for (int i = 0; i < dims.x; ++i) {
          wrong += voxels.solid[voxels.index(i, j, k)] != (sample.solid(i, j, k) ? 1 : 0) ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(wrong, 0);
  }
}

TEST_P(ReadBack, WorldTransformIsKeptWhereTheFormatHoldsIt) {
  Sample sample = small_samples().front();
  sample.grid.origin = {1.0 / 3, -1234567.875, 2e-5};
  if (format().name != "binvox") sample.grid.voxel_size = {0.1, 1.0 / 7, 3.0};
  const std::string path = folder_.file("out");
  ASSERT_TRUE(write(path, format().name, intervals_of(sample, format().axis)));
  const ReadVoxels voxels = read(path, format().name, sample.grid.dims);
  const bool holds = format().name != "npy" && format().name != "vox";
  ASSERT_EQ(voxels.origin.has_value(), holds);
  if (!holds) return;
  for (int axis = 0; axis < 3; ++axis) {
    const bool floats = format().name.starts_with("nii");  // numbers of NIfTI-1
    const double origin = sample.grid.origin[axis], size = sample.grid.voxel_size[axis];
    EXPECT_NEAR((*voxels.origin)[axis], origin, floats ? 1e-7 * std::abs(origin) + size : 1e-9);
    EXPECT_NEAR((*voxels.voxel_size)[axis], size, floats ? 1e-6 : 1e-15);
  }
}

TEST_P(Writer, BytesDoNotDependOnThreadsOrSlabs) {
  for (const Sample& sample : small_samples()) {
    SCOPED_TRACE(sample.name);
    const VoxelIntervals set = intervals_of(sample, format().axis);
    const auto bytes = [&](const std::string& name, int threads, int slab_tiles) {
      const std::string path = folder_.file(sample.name + name);
      EXPECT_TRUE(write(path, format().name, set, threads, slab_tiles));
      return all_bytes(path);
    };
    const std::string expected = bytes("a", 1, 1000);
    EXPECT_EQ(bytes("b", 1, 1), expected);
    EXPECT_EQ(bytes("c", 2, 1), expected);
    EXPECT_EQ(bytes("d", 7, 2), expected);
  }
}

TEST_P(Writer, SlabsOfAnyAxisGiveTheSameBytes) {
  for (const Sample& sample : small_samples()) {
    SCOPED_TRACE(sample.name);
    const std::string path = folder_.file(sample.name);
    ASSERT_TRUE(write(path, format().name, intervals_of(sample, format().axis)));
    const std::string expected = all_bytes(path);
    int slab_tiles = 1;  // in pieces along one of the two other axes, as a whole along the other
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      if (axis == format().axis) continue;
      std::filesystem::remove_all(path);
      const auto written = write(path, format().name, intervals_of(sample, axis), 2, slab_tiles);
      ASSERT_TRUE(written) << written.error().message;
      EXPECT_EQ(all_bytes(path), expected) << "xyz"[static_cast<int>(axis)];
      slab_tiles = 1000;
    }
  }
}

TEST_P(Writer, NothingIsLeftWithoutFinish) {
  const VoxelIntervals set = intervals_of(small_samples().front(), format().axis);
  {
    auto writer = open_voxel_writer(folder_.file("out"), format().name, set.grid());
    ASSERT_TRUE(writer);
    EXPECT_FALSE(folder_.is_empty());
    ASSERT_TRUE((*writer)->add(set, {}));
    EXPECT_FALSE(std::filesystem::exists(folder_.file("out")));
  }
  EXPECT_TRUE(folder_.is_empty());
}

TEST_P(Writer, UnwritablePathIsAnOutputErrorThatNamesIt) {
  const VoxelGrid grid = make_grid({8, 8, 8});
  const std::string path = folder_.file("missing/out");
  const auto writer = open_voxel_writer(path, format().name, grid);
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().code, ErrorCode::kOutput);
  EXPECT_NE(writer.error().message.find(path), std::string::npos) << writer.error().message;
}

/// Makes every file that grows beyond a few bytes fail, as a full disk does.
class NoRoom {
 public:
  explicit NoRoom(rlim_t bytes) {
    before_ = signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &limit_);
    rlimit small = limit_;
    small.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~NoRoom() {
    setrlimit(RLIMIT_FSIZE, &limit_);
    signal(SIGXFSZ, before_);
  }
  NoRoom(const NoRoom&) = delete;
  NoRoom& operator=(const NoRoom&) = delete;

 private:
  rlimit limit_{};
  void (*before_)(int) = nullptr;
};

TEST_P(Writer, FullDiskIsAnOutputErrorAndLeavesNothing) {
  const VoxelIntervals set = intervals_of(small_samples().front(), format().axis);
  for (const rlim_t room : {rlim_t{0}, rlim_t{40}, rlim_t{300}}) {
    if (room == 300 && format().name.ends_with("zarr")) continue;  // whole files are smaller
    Result<void> written;
    {
      const NoRoom no_room(format().name == "png" ? room / 4 : room);
      written = write(folder_.file("out"), format().name, set);
    }
    ASSERT_FALSE(written) << room;
    EXPECT_EQ(written.error().code, ErrorCode::kOutput) << written.error().message;
    EXPECT_NE(written.error().message.find(folder_.file("out")), std::string::npos)
        << written.error().message;
    EXPECT_TRUE(folder_.is_empty());
  }
}

TEST_P(Writer, AStoppedJobLeavesNothing) {
  const VoxelIntervals set = intervals_of(small_samples().front(), format().axis);
  std::stop_source source;
  Execution execution;
  execution.stop = source.get_token();
  {
    auto writer = open_voxel_writer(folder_.file("out"), format().name, set.grid());
    ASSERT_TRUE(writer);
    ASSERT_TRUE((*writer)->add(set, execution));
    source.request_stop();
    const auto finished = (*writer)->finish(execution);
    ASSERT_FALSE(finished);
    EXPECT_EQ(finished.error().code, ErrorCode::kCancelled);
  }
  EXPECT_TRUE(folder_.is_empty());
}

// Wherever the stop falls, the output is whole or not there.
TEST_P(Writer, AJobStoppedAnywhereIsWholeOrNotThere) {
  const Sample sample{"slabs", make_grid({20, 150, 140}),
                      [](int i, int j, int k) { return random_voxel(i / 3, j / 3, k / 5, 500); }};
  const VoxelIntervals set = intervals_of(sample, format().axis);
  const std::string whole = folder_.file("whole"), path = folder_.file("out");
  ASSERT_TRUE(write(whole, format().name, set));
  const std::string expected = all_bytes(whole);
  remove_output(whole);
  for (int round = 0; round < 30; ++round) {
    std::stop_source source;
    Execution execution;
    execution.threads = 2;
    execution.stop = source.get_token();
    std::jthread stopper([&] {
      std::atomic<int> spent{0};
      while (spent.fetch_add(1) < round * 3000) continue;
      source.request_stop();
    });
    {
      auto writer = open_voxel_writer(path, format().name, set.grid());
      ASSERT_TRUE(writer);
      Result<void> result;
      for (const VoxelIntervals& slab : cut(set, 1)) {
        if (result) result = (*writer)->add(slab, execution);
      }
      if (result) result = (*writer)->finish(execution);
      EXPECT_EQ(result.has_value(), std::filesystem::exists(path));
      if (result) {
        EXPECT_EQ(all_bytes(path), expected);
      } else {
        EXPECT_EQ(result.error().code, ErrorCode::kCancelled) << result.error().message;
      }
    }
    remove_output(path);
    EXPECT_TRUE(folder_.is_empty());
  }
}

TEST_P(Writer, SlabsOutOfOrderAreRefused) {
  const Sample sample{"long", make_grid({20, 140, 150}),
                      [](int i, int j, int k) { return random_voxel(i, j, k, 100); }};
  const VoxelIntervals set = intervals_of(sample, format().axis);
  const auto slabs = cut(set, 1);
  const auto attempt = [&](const std::vector<const VoxelIntervals*>& order) {
    auto writer = open_voxel_writer(folder_.file("out"), format().name, set.grid());
    EXPECT_TRUE(writer);
    for (const VoxelIntervals* slab : order) {
      if (auto added = (*writer)->add(*slab, {}); !added) return added.error().code;
    }
    auto finished = (*writer)->finish({});
    return finished ? ErrorCode::kCancelled : finished.error().code;
  };
  EXPECT_EQ(attempt({&slabs[0], &slabs[2]}), ErrorCode::kInternal);
  EXPECT_EQ(attempt({&slabs[0], &slabs[0]}), ErrorCode::kInternal);
  EXPECT_EQ(attempt({&slabs[0], &slabs[1]}), ErrorCode::kInternal);  // one is missing
  const Axis other = format().axis == Axis::kX ? Axis::kZ : Axis::kX;
  const VoxelIntervals other_axis = intervals_of(sample, other);
  const auto others = cut(other_axis, 1);
  EXPECT_EQ(attempt({&slabs[0], &others[1]}), ErrorCode::kInternal);
  EXPECT_EQ(attempt({&others[0], &slabs[1]}), ErrorCode::kInternal);
  EXPECT_EQ(attempt({&others[0], &others[0]}), ErrorCode::kInternal);
  EXPECT_EQ(attempt({&others[0]}), ErrorCode::kInternal);  // some are missing
  EXPECT_TRUE(folder_.is_empty());
}

TEST_P(Writer, FinishedWritersRefuseMore) {
  const VoxelIntervals set = intervals_of(small_samples().front(), format().axis);
  auto writer = open_voxel_writer(folder_.file("out"), format().name, set.grid());
  ASSERT_TRUE(writer);
  ASSERT_TRUE((*writer)->add(set, {}));
  ASSERT_TRUE((*writer)->finish({}));
  EXPECT_FALSE((*writer)->finish({}));
  EXPECT_FALSE((*writer)->add(set, {}));
  EXPECT_TRUE(std::filesystem::exists(folder_.file("out")));
}

TEST_P(Writer, GridsOfNoSizeAreRefused) {
  const auto code = [&](VoxelGrid grid) {
    const auto writer = open_voxel_writer(folder_.file("out"), format().name, grid);
    return writer ? ErrorCode::kInternal : writer.error().code;
  };
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(code(make_grid({0, 1, 1})), ErrorCode::kUsage);
  EXPECT_EQ(code(make_grid({1, -5, 1})), ErrorCode::kUsage);
  EXPECT_EQ(code(make_grid({1, 1, kMaxGridSide + 1})), ErrorCode::kUsage);
  EXPECT_EQ(code(make_grid({1, 1, 1}, {0, infinity, 0})), ErrorCode::kUsage);
  EXPECT_EQ(code(make_grid({1, 1, 1}, {0, 0, 0}, glm::dvec3(0.0))), ErrorCode::kUsage);
  EXPECT_TRUE(folder_.is_empty());
}

// --- single files -------------------------------------------------------------------------------

/// Sends standard output elsewhere while it lives.
class StandardOutputTo {
 public:
  explicit StandardOutputTo(int descriptor) : kept_(dup(STDOUT_FILENO)) {
    fflush(stdout);
    dup2(descriptor, STDOUT_FILENO);
  }
  ~StandardOutputTo() {
    dup2(kept_, STDOUT_FILENO);
    close(kept_);
  }
  StandardOutputTo(const StandardOutputTo&) = delete;
  StandardOutputTo& operator=(const StandardOutputTo&) = delete;

 private:
  int kept_;
};

class OnPipes : public Writer {};
INSTANTIATE_TEST_SUITE_P(Formats, OnPipes, ::testing::ValuesIn(single_files()), name_of);

TEST_P(OnPipes, StandardOutputGetsTheFile) {
  for (const Sample& sample : small_samples()) {
    SCOPED_TRACE(sample.name);
    const VoxelIntervals set = intervals_of(sample, format().axis);
    std::array<int, 2> ends;
    ASSERT_EQ(pipe(ends.data()), 0);
    std::string piped;
    std::jthread reader([&] {
      std::array<char, 1000> buffer;
      for (ssize_t got; (got = ::read(ends[0], buffer.data(), buffer.size())) > 0;) {
        piped.append(buffer.data(), static_cast<std::size_t>(got));
      }
    });
    Result<void> written;
    {
      const StandardOutputTo redirected(ends[1]);
      close(ends[1]);
      written = write("-", format().name, set, 3, 1);
    }
    reader.join();
    close(ends[0]);
    ASSERT_TRUE(written) << written.error().message;
    const std::string path = folder_.file(sample.name);
    constexpr std::array<std::string_view, 4> kFilledIn = {"vti", "npz", "mha", "tif"};
    if (std::count(kFilledIn.begin(), kFilledIn.end(), format().name) !=
        0) {  // not filled in later on a pipe
      std::ofstream(path, std::ios::binary) << piped;
      const ReadVoxels voxels = read(path, format().name, set.grid().dims);
      std::uint64_t solid = 0;
      for (const std::uint8_t voxel : voxels.solid) solid += voxel;
      EXPECT_EQ(solid, set.solid_voxels());
    } else {
      ASSERT_TRUE(write(path, format().name, set));
      EXPECT_EQ(piped, testkit::bytes_of(path));
    }
  }
}

TEST_P(OnPipes, FullDeviceIsAnOutputError) {
  if (access("/dev/full", W_OK) != 0) GTEST_SKIP() << "no /dev/full";
  const VoxelIntervals set = intervals_of(small_samples().front(), format().axis);
  const auto written = write("/dev/full", format().name, set);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::kOutput);
  EXPECT_NE(written.error().message.find("/dev/full"), std::string::npos);
}

// --- names and limits ---------------------------------------------------------------------------

TEST(VoxelFormats, FollowTheExtension) {
  const auto name = [](const std::string& path, const std::string& format = "") {
    const auto found = voxel_format_for(path, format);
    return found ? found->name : "error " + std::to_string(static_cast<int>(found.error().code));
  };
  EXPECT_EQ(name("a.vdb"), "vdb");
  EXPECT_EQ(name("dir.npy/a.VDB"), "vdb");
  EXPECT_EQ(name("a.npy"), "npy");
  EXPECT_EQ(name("a.npz"), "npz");
  EXPECT_EQ(name("a.nrrd"), "nrrd");
  EXPECT_EQ(name("a.vti"), "vti");
  EXPECT_EQ(name("a.nii"), "nii");
  EXPECT_EQ(name("a.nii.gz"), "nii.gz");
  EXPECT_EQ(name("a.mha"), "mha");
  EXPECT_EQ(name("a.mhd"), "mha");
  EXPECT_EQ(name("a.raw"), "raw");
  EXPECT_EQ(name("a.nhdr"), "raw");
  EXPECT_EQ(name("a.tif"), "tif");
  EXPECT_EQ(name("a.TIFF"), "tif");
#ifdef STRATA_HAVE_HDF5
  EXPECT_EQ(name("a.h5"), "h5");
  EXPECT_EQ(name("a.HDF5"), "h5");
#endif
  EXPECT_EQ(name("a.binvox"), "binvox");
  EXPECT_EQ(name("a.vox"), "vox");
  EXPECT_EQ(name("a.zarr"), "zarr");
  EXPECT_EQ(name("a.ome.zarr"), "ome.zarr");
  EXPECT_EQ(name("a.zarr/"), "zarr");
  EXPECT_EQ(name("slices/"), "png");
  EXPECT_EQ(name("a.npy", "vdb"), "vdb");
  EXPECT_EQ(name("-", "vdb"), "vdb");
  EXPECT_EQ(name("-", "NPY"), "npy");
  EXPECT_EQ(name("-"), "error 2");
  EXPECT_EQ(name("-", "png"), "error 2");
  EXPECT_EQ(name("-", "zarr"), "error 2");
  EXPECT_EQ(name("a"), "error 2");
  EXPECT_EQ(name("a.obj"), "error 2");
  EXPECT_EQ(name("a.vdb", "gif"), "error 2");
  EXPECT_EQ(name(""), "error 2");
}

TEST(VoxelFormats, AllAreListed) {
  std::string names;
  for (const VoxelFormat& format : voxel_formats()) {
    if (format.name != "h5") names += format.name + " ";  // where HDF5 is there
    EXPECT_FALSE(format.description.empty());
  }
  EXPECT_EQ(names,
            "vdb npy npz nrrd vti nii nii.gz mha raw tif binvox vox png sl1 ome.zarr zarr ply xyz "
            "schem ");
}

TEST(BinvoxWriter, RefusesVoxelsThatAreNotCubes) {
  const TemporaryFolder folder;
  const auto writer =
      open_voxel_writer(folder.file("a.binvox"), "", make_grid({4, 4, 4}, {0, 0, 0}, {1, 1, 2}));
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().code, ErrorCode::kUsage);
  EXPECT_TRUE(folder.is_empty());
}

/// Names of the files of a folder.
std::set<std::string> names_in(const TemporaryFolder& folder) {
  std::set<std::string> names;
  const std::filesystem::path inside(folder.file("x"));
  for (const auto& entry : std::filesystem::directory_iterator(inside.parent_path())) {
    names.insert(entry.path().filename().string());
  }
  return names;
}

TEST(VoxWriter, AGridBeyondASceneIsSeveralFilesThatAreTheSetTogether) {
  for (const glm::ivec3 dims :
       {glm::ivec3(2001, 3, 2), glm::ivec3(3, 3600, 2), glm::ivec3(2, 1793, 2100)}) {
    const TemporaryFolder folder;
    const Sample sample{"long", make_grid(dims),
                        [](int i, int j, int k) { return random_voxel(i, j, k, 40); }};
    ASSERT_TRUE(write(folder.file("a.b.VOX"), "", intervals_of(sample, Axis::kZ)));
    std::set<std::string> files;
    int wrong = 0, solid = 0;
    const auto side = [](int length) { return length > 2000 ? 1792 : length; };
    for (int z = 0; z < dims.z; z += side(dims.z)) {
      for (int y = 0; y < dims.y; y += side(dims.y)) {
        for (int x = 0; x < dims.x; x += side(dims.x)) {
          const glm::ivec3 begin(x, y, z);
          const glm::ivec3 size =
              glm::min(dims - begin, glm::ivec3(side(dims.x), side(dims.y), side(dims.z)));
          const std::string name = fmt::format("a.b_{}_{}_{}.VOX", x / 1792, y / 1792, z / 1792);
          files.insert(name);
          const ReadVoxels voxels = read_vox(folder.file(name), size);
          for (int k = 0; k < size.z; ++k) {
            for (int j = 0; j < size.y; ++j) {
              for (int i = 0; i < size.x; ++i) {
                const bool there = voxels.solid[voxels.index(i, j, k)] != 0;
                wrong += there != sample.solid(x + i, y + j, z + k) ? 1 : 0;
                solid += there ? 1 : 0;
              }
            }
          }
        }
      }
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(solid, 400);
    EXPECT_EQ(names_in(folder), files);
  }
}

TEST(VoxWriter, PiecesWithoutVoxelsAreNoFiles) {
  const TemporaryFolder folder;
  const auto written = [&](int i, int begin) {
    const Sample one{"one", make_grid({6000, 1, 2}),
                     [=](int x, int, int) { return x >= begin && x % 2000 == i; }};
    auto writer = open_voxel_writer(folder.file("a.vox"), "", one.grid);
    EXPECT_TRUE(writer && (*writer)->add(intervals_of(one, Axis::kZ), {}) && (*writer)->finish({}));
    return (*writer)->pieces();
  };
  // 10, 2010 and 4010 lie in the first, second and third of 4.
  EXPECT_EQ(written(10, 2000),
            (std::vector{folder.file("a_1_0_0.vox"), folder.file("a_2_0_0.vox")}));
  EXPECT_EQ(names_in(folder), (std::set<std::string>{"a_1_0_0.vox", "a_2_0_0.vox"}));
  EXPECT_EQ(written(0, 7000), std::vector{folder.file("a_0_0_0.vox")});  // an empty set
}

TEST(VoxWriter, PiecesAppearTogetherOrNotAtAll) {
  const TemporaryFolder folder;
  const Sample sample{"all", make_grid({4000, 1, 1}), [](int, int, int) { return true; }};
  const VoxelIntervals set = intervals_of(sample, Axis::kZ);
  std::filesystem::create_directory(folder.file("a_1_0_0.vox"));
  std::ofstream(folder.file("a_1_0_0.vox/mine.txt")) << "keep";
  std::ofstream(folder.file("a_0_0_0.vox")) << "old";
  EXPECT_FALSE(write(folder.file("a.vox"), "", set));
  EXPECT_EQ(names_in(folder), (std::set<std::string>{"a_0_0_0.vox", "a_1_0_0.vox"}));
  EXPECT_EQ(testkit::bytes_of(folder.file("a_0_0_0.vox")), "old");
  EXPECT_TRUE(std::filesystem::exists(folder.file("a_1_0_0.vox/mine.txt")));
}

TEST(VoxWriter, PiecesNeedAPathAndAreNotCountless) {
  const TemporaryFolder folder;
  EXPECT_TRUE(open_voxel_writer(folder.file("a.vox"), "", make_grid({2000, 1, 1})));
  const auto stream = open_voxel_writer("-", "vox", make_grid({1, 2001, 1}));
  ASSERT_FALSE(stream);
  EXPECT_EQ(stream.error().code, ErrorCode::kUsage);
  EXPECT_NE(stream.error().message.find("1 x 2001 x 1 voxels are 2 .vox files"), std::string::npos)
      << stream.error().message;
  const auto many = open_voxel_writer(folder.file("a.vox"), "", make_grid({60000, 20000, 1}));
  ASSERT_FALSE(many);
  EXPECT_EQ(many.error().code, ErrorCode::kUsage);
  EXPECT_TRUE(folder.is_empty());
}

TEST(VoxWriter, RefusesMoreVoxelsThanItsSizesCount) {
  const TemporaryFolder folder;
  const VoxelGrid grid = make_grid({1024, 1024, 1024});
  VoxelIntervals set(grid, Axis::kZ);
  std::vector<std::uint32_t> offsets(VoxelIntervals::kTileColumns + 1);
  for (std::uint32_t i = 0; i < offsets.size(); ++i) offsets[i] = i;
  const std::vector<Interval> items(VoxelIntervals::kTileColumns, Interval{0, 1023});
  for (int tv = 0; tv < set.tiles_v(); ++tv) {
    for (int tu = 0; tu < set.tiles_u(); ++tu) set.set_tile(tu, tv, offsets, items);
  }
  const auto written = write(folder.file("a.vox"), "", set);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::kLimit);
  EXPECT_TRUE(folder.is_empty());
}

TEST(VoxWriter, ModelsOfALargeGridStandInTheirPlaces) {
  const TemporaryFolder folder;
  for (const glm::ivec3 dims : {glm::ivec3(600, 5, 270), glm::ivec3(4, 530, 300)}) {
    // Nothing in the first model, which is therefore left out.
    const Sample sample{"large", make_grid(dims), [](int i, int j, int k) {
                          return random_voxel(i, j, k, 30) && (i >= 256 || j >= 256 || k >= 256);
                        }};
    const std::string path = folder.file("a.vox");
    ASSERT_TRUE(write(path, "", intervals_of(sample, Axis::kZ)));
    const ReadVoxels voxels = read_vox(path, dims);
    int wrong = 0;
    for (int k = 0; k < dims.z; ++k) {
      for (int j = 0; j < dims.y; ++j) {
        for (int i = 0; i < dims.x; ++i) {
          wrong += (voxels.solid[voxels.index(i, j, k)] != 0) != sample.solid(i, j, k) ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(wrong, 0);
  }
}

TEST(VoxWriter, TheLargestGridLiesInTheEditorsRange) {
  const TemporaryFolder folder;
  for (const glm::ivec3 dims : {glm::ivec3(2000, 1, 3), glm::ivec3(2, 1999, 257)}) {
    const Sample sample{"corners", make_grid(dims), [dims](int i, int j, int k) {
                          return (i == 0 || i == dims.x - 1) && (j == 0 || j == dims.y - 1) &&
                                 (k == 0 || k == dims.z - 1);
                        }};
    const std::string path = folder.file("a.vox");
    ASSERT_TRUE(write(path, "", intervals_of(sample, Axis::kZ)));
    const ReadVoxels voxels = read_vox(path, dims);  // refuses what lies beyond
    EXPECT_EQ(std::count(voxels.solid.begin(), voxels.solid.end(), 1),
              intervals_of(sample, Axis::kZ).solid_voxels());
  }
}

TEST(PngWriter, ALayerIsSeenUprightFromAbove) {
  // An F: its stem on the left, the long bar on top.
  const TemporaryFolder folder;
  const Sample sample{"F", make_grid({8, 5, 1}), [](int i, int j, int) {
                        return i == 0 || (j == 4 && i < 4) || (j == 2 && i < 3);
                      }};
  ASSERT_TRUE(write(folder.file("f/"), "", intervals_of(sample, Axis::kX)));
  const std::string file = testkit::bytes_of(folder.file("f/slice_00000.png"));
  const std::size_t data = file.find("IDAT") + 4;
  const std::size_t end = file.find("IEND") - 8;
  const std::string rows = inflate_all(file.substr(data, end - data), 15, 10);
  EXPECT_EQ(rows, std::string("\0\xf0\0\x80\0\xe0\0\x80\0\x80", 10));
}

TEST(PngWriter, AFolderWithContentIsNotReplaced) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.file("slices"));
  std::ofstream(folder.file("slices/mine.txt")) << "keep";
  const auto writer = open_voxel_writer(folder.file("slices/"), "", make_grid({4, 4, 4}));
  EXPECT_FALSE(writer && (*writer)->finish({}));
  EXPECT_EQ(testkit::bytes_of(folder.file("slices/mine.txt")), "keep");
}

// Sizes of 32 bits end at 4 GiB; the file itself is small.
TEST(NpzWriter, AnArrayOfTwoGibibytesHasSizesOf64Bits) {
  const TemporaryFolder folder;
  const VoxelGrid grid = make_grid({2048, 1024, 1024});
  const VoxelIntervals set(grid, Axis::kX);
  ASSERT_TRUE(write(folder.file("a.npz"), "", set));
  const std::string file = testkit::bytes_of(folder.file("a.npz"));
  const auto number = [&](std::size_t at) {
    std::uint64_t value = 0;
    std::memcpy(&value, file.data() + at, sizeof value);
    return value;
  };
  const std::string name = "voxels.npy";
  std::size_t at = 0;
  for (int place = 0; place < 2; ++place) {  // the local head, the directory
    at = file.find(name, at) + name.size();
    ASSERT_LT(at, file.size());
    EXPECT_EQ(file.substr(at, 4), std::string("\1\0\x10\0", 4));
    EXPECT_EQ(number(at + 4), (std::uint64_t{1} << 31) + 128);
    EXPECT_LT(number(at + 12), file.size());
    EXPECT_GT(number(at + 12), file.size() - 1000);
  }
  const std::size_t end = file.rfind("PK\x05\x06");
  EXPECT_EQ(file.substr(end - 20, 4), "PK\x06\x07");
  const std::size_t record = number(end - 12);
  ASSERT_LT(record, end);
  EXPECT_EQ(file.substr(record, 4), "PK\x06\x06");
  EXPECT_EQ(file.substr(number(record + 48), 4), "PK\x01\x02");
}

TEST(VtiWriter, NamesAreEscaped) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.vti");
  const VoxelIntervals set(make_grid({4, 4, 4}), Axis::kX);
  VoxelWriterOptions options;
  options.name = "a \"<&>\" b";
  auto writer = open_voxel_writer(path, "", set.grid(), options);
  ASSERT_TRUE(writer && (*writer)->add(set, {}) && (*writer)->finish({}));
  EXPECT_NE(testkit::bytes_of(path).find("Name=\"a &quot;&lt;&amp;&gt;&quot; b\""),
            std::string::npos);
}

TEST(NrrdWriter, NamesCannotEndTheHeader) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.nrrd");
  const VoxelIntervals set(make_grid({4, 4, 4}), Axis::kX);
  VoxelWriterOptions options;
  options.name = "a\n\nb";
  auto writer = open_voxel_writer(path, "", set.grid(), options);
  ASSERT_TRUE(writer && (*writer)->add(set, {}) && (*writer)->finish({}));
  EXPECT_EQ(read_nrrd(path).dims, glm::ivec3(4));
}

}  // namespace
}  // namespace strata::testing
