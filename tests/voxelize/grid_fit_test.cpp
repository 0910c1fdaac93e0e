#include "strata/voxelize/grid_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "strata/mesh/shapes.h"
#include "strata/raster/lattice_mesh.h"

namespace strata {
namespace {

Bounds box(const glm::dvec3& low, const glm::dvec3& high) {
  Bounds result;
  result.low = low;
  result.high = high;
  return result;
}

GridRequest resolution(std::int64_t n) {
  GridRequest request;
  request.resolution = n;
  return request;
}

GridRequest voxel_size(double x, double y, double z) {
  GridRequest request;
  request.voxel_size = glm::dvec3(x, y, z);
  return request;
}

GridRequest dims(std::int64_t x, std::int64_t y, std::int64_t z) {
  GridRequest request;
  request.dims = {x, y, z};
  return request;
}

void expect_failure(const Result<VoxelGrid>& grid, ErrorCode code, const std::string& part) {
  ASSERT_FALSE(grid.has_value());
  EXPECT_EQ(grid.error().code, code) << grid.error().message;
  EXPECT_NE(grid.error().message.find(part), std::string::npos) << grid.error().message;
}

TEST(GridFit, ResolutionIsTheVoxelsOfTheLongestSide) {
  const auto grid = fit_grid(box({1, 2, 3}, {5, 4, 4}), resolution(8));
  ASSERT_TRUE(grid.has_value()) << grid.error().message;
  EXPECT_EQ(grid->dims, glm::ivec3(8, 4, 2));
  EXPECT_EQ(grid->origin, glm::dvec3(1, 2, 3));
  EXPECT_EQ(grid->voxel_size, glm::dvec3(0.5));
}

TEST(GridFit, LongestSideHasExactlyTheResolutionWhateverTheRounding) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> extent(1e-3, 1e3), place(-1e3, 1e3);
  for (int i = 0; i < 20000; ++i) {
    const double length = extent(random);
    const glm::dvec3 low(place(random), place(random), place(random));
    const int n = 1 + static_cast<int>(random() % 5000);
    const auto grid =
        fit_grid(box(low, low + glm::dvec3(length, length * 0.3, length)), resolution(n));
    ASSERT_TRUE(grid.has_value()) << grid.error().message;
    EXPECT_EQ(grid->dims.x, n);
    EXPECT_EQ(grid->dims.z, n);
  }
}

TEST(GridFit, TheSnappedMeshLiesWithinTheGrid) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> extent(0.01, 100), place(-100, 100), size(0.01, 3);
  for (int i = 0; i < 2000; ++i) {
    const glm::dvec3 low(place(random), place(random), place(random));
    const glm::dvec3 high = low + glm::dvec3(extent(random), extent(random), extent(random));
    const TriangleSoup mesh = make_box(low, high);
    GridRequest request = voxel_size(size(random), size(random), size(random));
    request.align = i % 2 == 0;
    const auto grid = fit_grid(box(low, high), request);
    ASSERT_TRUE(grid.has_value()) << grid.error().message;
    const auto snapped = snap_to_lattice(mesh, *grid);
    ASSERT_TRUE(snapped.has_value());
    for (const glm::ivec3& vertex : snapped->vertices) {
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_GE(vertex[axis], 0);
        EXPECT_LE(vertex[axis], grid->dims[axis] * kLatticeSteps);
      }
    }
    // And no slice of voxels is without need.
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GT(high[axis], grid->origin[axis] + (grid->dims[axis] - 1) * grid->voxel_size[axis]);
      EXPECT_LT(low[axis], grid->origin[axis] + grid->voxel_size[axis]);
    }
  }
}

TEST(GridFit, ALengthThatIsAMultipleBarTheLastBitsGetsNoExtraVoxel) {
  // 0.1 + 0.2 is a little more than 0.3.
  const auto grid = fit_grid(box({0, 0, 0}, {0.1 + 0.2, 1, 1}), voxel_size(0.1, 0.1, 0.1));
  ASSERT_TRUE(grid.has_value());
  EXPECT_EQ(grid->dims, glm::ivec3(3, 10, 10));
}

TEST(GridFit, AHundredthOfAVoxelBeyondTheBorderIsCovered) {
  const auto grid = fit_grid(box({0, 0, 0}, {3.01, 1, 1}), voxel_size(1, 1, 1));
  ASSERT_TRUE(grid.has_value());
  EXPECT_EQ(grid->dims, glm::ivec3(4, 1, 1));
}

TEST(GridFit, GivenDimsStretchTheVoxels) {
  const auto grid = fit_grid(box({0, 0, 0}, {1, 2, 3}), dims(10, 10, 10));
  ASSERT_TRUE(grid.has_value());
  EXPECT_EQ(grid->dims, glm::ivec3(10, 10, 10));
  EXPECT_DOUBLE_EQ(grid->voxel_size.x, 0.1);
  EXPECT_DOUBLE_EQ(grid->voxel_size.y, 0.2);
  EXPECT_DOUBLE_EQ(grid->voxel_size.z, 0.3);
}

TEST(GridFit, PaddingIsAddedToAResolutionAndTakenOutOfGivenDims) {
  GridRequest request = resolution(4);
  request.padding = 2;
  auto grid = fit_grid(box({0, 0, 0}, {1, 1, 0.5}), request);
  ASSERT_TRUE(grid.has_value());
  EXPECT_EQ(grid->dims, glm::ivec3(8, 8, 6));
  EXPECT_EQ(grid->origin, glm::dvec3(-0.5));

  request = dims(8, 8, 8);
  request.padding = 2;
  grid = fit_grid(box({0, 0, 0}, {1, 1, 1}), request);
  ASSERT_TRUE(grid.has_value());
  EXPECT_EQ(grid->dims, glm::ivec3(8));
  EXPECT_EQ(grid->voxel_size, glm::dvec3(0.25));
  EXPECT_EQ(grid->origin, glm::dvec3(-0.5));
}

TEST(GridFit, AlignedOriginsAreMultiplesOfTheVoxelSize) {
  GridRequest request = voxel_size(0.25, 0.25, 0.25);
  request.align = true;
  const auto grid = fit_grid(box({-0.3, 0.3, 0.5}, {0.6, 0.6, 1.0}), request);
  ASSERT_TRUE(grid.has_value());
  EXPECT_EQ(grid->origin, glm::dvec3(-0.5, 0.25, 0.5));
  EXPECT_EQ(grid->dims, glm::ivec3(5, 2, 2));
}

TEST(GridFit, AFlatMeshGetsOneVoxelWithTheMeshInItsMiddle) {
  auto grid = fit_grid(box({0, 0, 5}, {4, 4, 5}), resolution(4));
  ASSERT_TRUE(grid.has_value());
  EXPECT_EQ(grid->dims, glm::ivec3(4, 4, 1));
  EXPECT_EQ(grid->origin, glm::dvec3(0, 0, 4.5));
  grid = fit_grid(box({0, 0, 5}, {4, 8, 5}), dims(4, 4, 2));
  ASSERT_TRUE(grid.has_value());
  EXPECT_EQ(grid->dims, glm::ivec3(4, 4, 2));
  EXPECT_EQ(grid->voxel_size, glm::dvec3(1, 2, 1));
  EXPECT_EQ(grid->origin, glm::dvec3(0, 0, 4));
}

TEST(GridFit, GivenBoundsTakeThePlaceOfTheMesh) {
  GridRequest request = resolution(10);
  request.bounds = box({0, 0, 0}, {10, 5, 5});
  const auto grid = fit_grid(box({2, 2, 2}, {3, 3, 3}), request);
  ASSERT_TRUE(grid.has_value());
  EXPECT_EQ(grid->dims, glm::ivec3(10, 5, 5));
  EXPECT_EQ(grid->origin, glm::dvec3(0));
}

TEST(GridFit, AGivenOriginIsTheLowerCorner) {
  GridRequest request = voxel_size(1, 1, 1);
  request.origin = glm::dvec3(-1, 0, 0.5);
  const auto grid = fit_grid(box({0, 0, 0}, {2, 2, 2}), request);
  ASSERT_TRUE(grid.has_value());
  EXPECT_EQ(grid->origin, *request.origin);
  EXPECT_EQ(grid->dims, glm::ivec3(3, 2, 2));
}

TEST(GridFit, SizesOutOfRangeNameTheNumber) {
  const Bounds unit = box({0, 0, 0}, {1, 1, 1});
  expect_failure(fit_grid(unit, resolution(0)), ErrorCode::kUsage, "0");
  expect_failure(fit_grid(unit, resolution(-5)), ErrorCode::kUsage, "-5");
  expect_failure(fit_grid(unit, resolution(1000000000)), ErrorCode::kLimit, "1000000000");
  expect_failure(fit_grid(unit, resolution(std::numeric_limits<std::int64_t>::max())),
                 ErrorCode::kLimit, "9223372036854775807");
  expect_failure(fit_grid(unit, voxel_size(1, 0, 1)), ErrorCode::kUsage, "along y");
  expect_failure(fit_grid(unit, voxel_size(1, 1, -2)), ErrorCode::kUsage, "-2");
  expect_failure(fit_grid(unit, voxel_size(1e-9, 1, 1)), ErrorCode::kLimit, "1000000000");
  expect_failure(fit_grid(unit, voxel_size(NAN, 1, 1)), ErrorCode::kUsage, "nan");
  expect_failure(fit_grid(unit, voxel_size(INFINITY, 1, 1)), ErrorCode::kUsage, "inf");
  expect_failure(fit_grid(unit, dims(1, 0, 1)), ErrorCode::kUsage,
                 "at least 1 voxel along y, got 0");
  expect_failure(fit_grid(unit, dims(1, 1, 65537)), ErrorCode::kLimit, "65537");
  GridRequest padded = resolution(65536);
  padded.padding = 1;
  expect_failure(fit_grid(unit, padded), ErrorCode::kLimit, "padding of 1");
  padded = dims(4, 4, 4);
  padded.padding = 2;
  expect_failure(fit_grid(unit, padded), ErrorCode::kUsage, "padding");
  padded.padding = -1;
  expect_failure(fit_grid(unit, padded), ErrorCode::kUsage, "-1");
}

TEST(GridFit, ExactlyOneSizeIsNeeded) {
  const Bounds unit = box({0, 0, 0}, {1, 1, 1});
  expect_failure(fit_grid(unit, {}), ErrorCode::kUsage, "must be given, got 0");
  GridRequest both = resolution(4);
  both.voxel_size = glm::dvec3(1);
  expect_failure(fit_grid(unit, both), ErrorCode::kUsage, "must be given, got 2");
}

TEST(GridFit, RequestsThatContradictThemselvesAreRefused) {
  const Bounds unit = box({0, 0, 0}, {1, 1, 1});
  GridRequest request = dims(4, 4, 4);
  request.align = true;
  expect_failure(fit_grid(unit, request), ErrorCode::kUsage, "align");
  request = resolution(4);
  request.origin = glm::dvec3(0);
  request.align = true;
  expect_failure(fit_grid(unit, request), ErrorCode::kUsage, "align");
  request.align = false;
  request.bounds = unit;
  expect_failure(fit_grid(unit, request), ErrorCode::kUsage, "bounds and an origin");
  request = resolution(4);
  request.bounds = box({0, 0, 0}, {1, -1, 1});
  expect_failure(fit_grid(unit, request), ErrorCode::kUsage, "-1");
  request = resolution(4);
  request.origin = glm::dvec3(0, 2, 0);
  expect_failure(fit_grid(unit, request), ErrorCode::kGeometry, "y = 1");
}

TEST(GridFit, MeshesWithoutUsableExtentAreRefused) {
  expect_failure(fit_grid({}, resolution(4)), ErrorCode::kGeometry, "no triangles");
  expect_failure(fit_grid(box({1, 2, 3}, {1, 2, 3}), resolution(4)), ErrorCode::kGeometry,
                 "(1, 2, 3)");
  expect_failure(fit_grid(box(glm::dvec3(-1.5e308), glm::dvec3(1.5e308)), resolution(4)),
                 ErrorCode::kGeometry, "1.5e+308");
  expect_failure(fit_grid(box(glm::dvec3(1e17), glm::dvec3(1e17 + 64)), resolution(64)),
                 ErrorCode::kGeometry, "precision");
  expect_failure(fit_grid(box(glm::dvec3(0), glm::dvec3(5e-324)), resolution(64)),
                 ErrorCode::kGeometry, "");
}

}  // namespace
}  // namespace strata
