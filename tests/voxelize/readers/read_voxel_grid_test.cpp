// Heads of voxel files, made here byte by byte: where their voxels lie.

#include "strata/voxelize/readers/read_voxel_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "strata/voxelize/formats/voxel_writer.h"
#include "tests/support/predicate_intervals.h"
#include "tests/support/temporary_folder.h"

namespace strata::testing {
namespace {

class VoxelGridHeads : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& bytes) {
    const std::string path = folder_.file(name);
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }
  /// The centre of a voxel in the world.
  static glm::dvec3 centre(const VoxelFileGrid& file, const glm::dvec3& index) {
    return file.frame.direction * (file.grid.origin + (index + 0.5) * file.grid.voxel_size);
  }
  static void expect_near(const glm::dvec3& a, const glm::dvec3& b, double most = 1e-9) {
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(a[axis], b[axis], most) << "axis " << axis;
  }
  void expect_error(const std::string& path, const std::string& text) {
    const auto grid = read_voxel_grid(path);
    ASSERT_FALSE(grid.has_value()) << path;
    EXPECT_NE(grid.error().message.find(text), std::string::npos) << grid.error().message;
  }

  testkit::TemporaryFolder folder_;
};

/// A NIfTI-1 or -2 head of either byte order.
class NiftiBytes {
 public:
  NiftiBytes(bool second, bool swapped) : second_(second), swapped_(swapped) {
    bytes_.resize(second ? 544 : 352);
    put<std::int32_t>(0, second ? 540 : 348);
    bytes_.replace(second ? 4 : 344, 3, second ? "n+2" : "n+1");
  }
  template <class T>
  void put(std::size_t at, T value) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (swapped_) std::reverse(raw, raw + sizeof(T));
    bytes_.replace(at, sizeof(T), raw, sizeof(T));
  }
  void real(std::size_t first, std::size_t second, std::size_t index, double value) {
    if (second_) return put(second + 8 * index, value);
    put(first + 4 * index, static_cast<float>(value));
  }
  void sizes(const std::vector<int>& list) {
    for (std::size_t i = 0; i <= list.size(); ++i) {
      const int size = i == 0 ? static_cast<int>(list.size()) : list[i - 1];
      if (second_) {
        put<std::int64_t>(16 + 8 * i, size);
      } else {
        put<std::int16_t>(40 + 2 * i, static_cast<std::int16_t>(size));
      }
    }
    put<std::int16_t>(second_ ? 12 : 70, 2);
  }
  void code(std::size_t first, std::size_t second, int value) {
    if (second_) return put<std::int32_t>(second, value);
    put<std::int16_t>(first, static_cast<std::int16_t>(value));
  }
  void unit(int value) {
    if (second_) return put<std::int32_t>(500, value);
    put<std::int8_t>(123, static_cast<std::int8_t>(value));
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  bool second_, swapped_;
  std::string bytes_;
};

TEST_F(VoxelGridHeads, NiftiIsReadInBothVersionsAndByteOrders) {
  for (const bool second : {false, true}) {
    for (const bool swapped : {false, true}) {
      NiftiBytes head(second, swapped);
      head.sizes({5, 6, 7});
      head.code(254, 348, 1);
      // A quarter turn about z with spacings 0.5, 2, 4: x of the file is y of the world.
      const double rows[3][4] = {{0, -2, 0, 10}, {0.5, 0, 0, -20}, {0, 0, 4, 30}};
      for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t i = 0; i < 4; ++i) {
          head.real(280 + 16 * row, 400 + 32 * row, i, rows[row][i]);
        }
      }
      head.unit(2 + 8);  // millimetres, seconds
      const auto grid = read_voxel_grid(write("a.nii", head.bytes()));
      ASSERT_TRUE(grid.has_value()) << grid.error().message;
      EXPECT_EQ(grid->grid.dims, glm::ivec3(5, 6, 7));
      EXPECT_EQ(grid->grid.voxel_size, glm::dvec3(0.5, 2, 4));
      EXPECT_EQ(grid->frame.direction[0], glm::dvec3(0, 1, 0));
      EXPECT_EQ(grid->frame.direction[1], glm::dvec3(-1, 0, 0));
      EXPECT_EQ(grid->frame.unit_metres, 1e-3);
      EXPECT_EQ(centre(*grid, {0, 0, 0}), glm::dvec3(10, -20, 30));
      EXPECT_EQ(centre(*grid, {1, 2, 3}), glm::dvec3(10 - 4, -20 + 0.5, 30 + 12));
    }
  }
}

TEST_F(VoxelGridHeads, AQuaternionOfNiftiTurnsAndMirrors) {
  NiftiBytes head(true, false);
  head.sizes({4, 4, 4, 1});
  head.code(252, 344, 1);
  // 90 degrees about x: (b, c, d) = (sin 45, 0, 0); pixdim[0] = -1 mirrors the third axis.
  head.real(256, 352, 0, std::sqrt(0.5));
  const double pixdim[] = {-1, 1, 2, 3};
  for (std::size_t i = 0; i < 4; ++i) head.real(76, 104, i, pixdim[i]);
  head.real(268, 376, 0, 7);
  const auto grid = read_voxel_grid(write("q.nii", head.bytes()));
  ASSERT_TRUE(grid.has_value()) << grid.error().message;
  expect_near(centre(*grid, {0, 0, 0}), {7, 0, 0});
  expect_near(centre(*grid, {1, 0, 0}), {8, 0, 0});
  expect_near(centre(*grid, {0, 1, 0}), {7, 0, 2});  // y goes to z
  expect_near(centre(*grid, {0, 0, 1}), {7, 3, 0});  // z to -y, mirrored
}

TEST_F(VoxelGridHeads, AMetaImageListsTheDirectionOfOneAxisAfterTheOther) {
  const auto grid = read_voxel_grid(write("a.mhd",
                                          "ObjectType = Image\nNDims = 3\nBinaryData = True\n"
                                          "TransformMatrix = 0 1 0 -1 0 0 0 0 1\n"
                                          "Offset = 1 2 3\nCenterOfRotation = 0 0 0\n"
                                          "ElementSpacing = 0.1 0.2 0.3\nDimSize = 10 20 30\n"
                                          "ElementType = MET_UCHAR\nElementDataFile = a.raw\n"));
  ASSERT_TRUE(grid.has_value()) << grid.error().message;
  EXPECT_EQ(grid->grid.dims, glm::ivec3(10, 20, 30));
  EXPECT_EQ(grid->grid.voxel_size, glm::dvec3(0.1, 0.2, 0.3));
  expect_near(centre(*grid, {0, 0, 0}), {1, 2, 3});
  expect_near(centre(*grid, {5, 0, 0}), {1, 2.5, 3});
  expect_near(centre(*grid, {0, 5, 0}), {0, 2, 3});
}

TEST_F(VoxelGridHeads, NrrdMayBeDetachedAndHaveAnAxisOfColours) {
  const auto grid = read_voxel_grid(
      write("a.nhdr",
            "NRRD0004\ntype: uchar\ndimension: 4\nspace: left-posterior-superior\n"
            "sizes: 3 8 9 10\nspace directions: none (-0.5,0,0) (0,-0.5,0) (0,0,2)\n"
            "kinds: RGB-color domain domain domain\nspace origin: (4,5,6)\n"
            "space units: \"mm\" \"mm\" \"mm\"\nencoding: gzip\ndata file: a.raw.gz\n"));
  ASSERT_TRUE(grid.has_value()) << grid.error().message;
  EXPECT_EQ(grid->grid.dims, glm::ivec3(8, 9, 10));
  EXPECT_EQ(grid->frame.space, "left-posterior-superior");
  EXPECT_EQ(grid->frame.unit_metres, 1e-3);
  EXPECT_EQ(centre(*grid, {0, 0, 0}), glm::dvec3(4, 5, 6));
  EXPECT_EQ(centre(*grid, {2, 4, 1}), glm::dvec3(3, 3, 8));
}

TEST_F(VoxelGridHeads, ATurnOfVtkIsAboutItsOrigin) {
  const auto grid = read_voxel_grid(
      write("a.vti",
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" "
            "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<ImageData "
            "WholeExtent=\"0 4 0 5 0 6\" Origin=\"1 2 3\" Spacing=\"0.5 0.5 2\" Direction=\"0 -1 0 "
            "1 0 0 0 0 1\">\n<Piece Extent=\"0 4 0 5 0 6\"><PointData/><CellData Scalars=\"a\">"
            "<DataArray type=\"UInt8\" Name=\"a\" format=\"appended\" offset=\"0\"/></CellData>"
            "</Piece></ImageData></VTKFile>\n"));
  ASSERT_TRUE(grid.has_value()) << grid.error().message;
  EXPECT_EQ(grid->grid.dims, glm::ivec3(4, 5, 6));
  // Cells: the corner is the origin. x of the file is y of the world, y is -x.
  EXPECT_EQ(centre(*grid, {-0.5, -0.5, -0.5}), glm::dvec3(1, 2, 3));
  EXPECT_EQ(centre(*grid, {1.5, 3.5, -0.5}), glm::dvec3(1 - 2, 2 + 1, 3));
}

TEST_F(VoxelGridHeads, AnArrayHasItsPlaceInAFileBesideIt) {
  VoxelGrid made{{3, 4, 5}, {1, 2, 3}, {0.5, 0.25, 2}};
  const VoxelIntervals set =
      intervals_from_predicate(made, Axis::kZ, [](int i, int, int) { return i == 1; });
  const std::string path = folder_.file("a.npy");
  ASSERT_TRUE(write_voxels(set, path).has_value());
  expect_error(path, "a.npy.json with origin and spacing would");
  write("a.npy.json",
        R"({"origin": [1, 2, 3], "spacing": [0.5, 0.25, 2],
            "direction": [[0, -1, 0], [1, 0, 0], [0, 0, 1]], "unit": "mm"})");
  const auto grid = read_voxel_grid(path);
  ASSERT_TRUE(grid.has_value()) << grid.error().message;
  EXPECT_EQ(grid->grid, made);
  EXPECT_EQ(grid->frame.unit_metres, 1e-3);
  EXPECT_EQ(grid->frame.direction * glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0));
}

TEST_F(VoxelGridHeads, OmeZarrNamesItsAxes) {
  std::filesystem::create_directories(folder_.file("a.zarr") + "/0");
  write("a.zarr/.zattrs",
        R"({"multiscales": [{"version": "0.4", "axes": [{"name": "c", "type": "channel"},
            {"name": "z", "type": "space", "unit": "micrometer"},
            {"name": "y", "type": "space", "unit": "micrometer"},
            {"name": "x", "type": "space", "unit": "micrometer"}],
            "datasets": [{"path": "0", "coordinateTransformations": [
            {"type": "scale", "scale": [1, 3, 2, 1]},
            {"type": "translation", "translation": [0, 30, 20, 10]}]}]}]})");
  write("a.zarr/0/.zarray", R"({"zarr_format": 2, "shape": [1, 7, 6, 5]})");
  const auto grid = read_voxel_grid(folder_.file("a.zarr"));
  ASSERT_TRUE(grid.has_value()) << grid.error().message;
  EXPECT_EQ(grid->grid.dims, glm::ivec3(5, 6, 7));
  EXPECT_EQ(grid->grid.voxel_size, glm::dvec3(1, 2, 3));
  EXPECT_EQ(centre(*grid, {0, 0, 0}), glm::dvec3(10, 20, 30));
  EXPECT_EQ(grid->frame.unit_metres, 1e-6);
}

TEST_F(VoxelGridHeads, WhatTheWritersWriteLiesWhereTheyPutIt) {
  const VoxelGrid made{{9, 10, 11}, {1, -2, 3}, {0.5, 0.5, 0.5}};
  const VoxelIntervals set = intervals_from_predicate(made, Axis::kZ, [](int i, int j, int k) {
    return (i == 0 && j == 0 && k == 0) || (i == 8 && j == 9 && k == 10);
  });
  for (const char* name : {"a.vdb", "a.npz", "a.nrrd", "a.vti", "a.zarr/", "slices/"}) {
    const std::string path = folder_.file(name);
    ASSERT_TRUE(write_voxels(set, path).has_value()) << name;
    const auto grid = read_voxel_grid(path);
    ASSERT_TRUE(grid.has_value()) << grid.error().message;
    EXPECT_EQ(grid->grid, made) << name;
    EXPECT_FALSE(grid->frame.turned()) << name;
  }
}

TEST_F(VoxelGridHeads, WhatIsNoGridIsRefused) {
  expect_error(write("skew.mha",
                     "NDims = 3\nTransformMatrix = 1 0 0 0.5 1 0 0 0 1\nOffset = 0 0 0\n"
                     "ElementSpacing = 1 1 1\nDimSize = 4 4 4\nElementType = MET_UCHAR\n"
                     "ElementDataFile = LOCAL\n"),
               "axes 0 and 1 of the grid are at 63.435 degrees");
  expect_error(write("large.mha",
                     "NDims = 3\nDimSize = 4 70000 4\nElementType = MET_UCHAR\n"
                     "ElementDataFile = LOCAL\n"),
               "70000 voxels along axis 1; the limit is 65536");
  expect_error(write("few.mha",
                     "NDims = 3\nDimSize = 4 4\nElementType = MET_UCHAR\n"
                     "ElementDataFile = LOCAL\n"),
               "DimSize is '4 4'; it must be 3 numbers");
  expect_error(write("no.nii", std::string(352, 'x')), "not a NIfTI file");
  expect_error(write("no.mha", "hello\n"), "no.mha:1: not a MetaImage");
  expect_error(folder_.file("missing.nii"), "missing.nii");
  NiftiBytes flat(false, false);
  flat.sizes({4, 4, 4});
  flat.code(254, 348, 1);  // with rows of zeros
  expect_error(write("flat.nii", flat.bytes()), "its length must be above 0 and finite");
}

TEST_F(VoxelGridHeads, CutHeadsAreErrorsAndNotCrashes) {
  NiftiBytes nifti(true, false);
  nifti.sizes({4, 4, 4});
  const std::string mha =
      "NDims = 3\nOffset = 0 0 0\nDimSize = 4 4 4\nElementType = MET_UCHAR\n"
      "ElementDataFile = LOCAL";
  for (const auto& [name, bytes] : {std::pair(std::string("cut.nii"), nifti.bytes().substr(0, 540)),
                                    std::pair(std::string("cut.mha"), mha)}) {
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      if (name == "cut.mha" && length > mha.rfind('=')) break;
      EXPECT_FALSE(read_voxel_grid(write(name, bytes.substr(0, length))).has_value()) << length;
    }
  }
}

}  // namespace
}  // namespace strata::testing
