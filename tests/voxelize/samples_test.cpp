// The filled fraction of voxels: how many samples of each are solid.

#include <gtest/gtest.h>

#include <cmath>

#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "strata/voxelize/voxelize.h"
#include "tests/support/trouble.h"

namespace strata {
namespace {

using namespace testkit;  // NOLINT: the tests' own vocabulary

VoxelizeOptions with_samples(int samples, Axis axis = Axis::kZ) {
  VoxelizeOptions options;
  options.samples = samples;
  options.axis = axis;
  return options;
}

std::uint32_t label_at(const VoxelIntervals& set, glm::ivec3 voxel) {
  const AxisFrame frame(set.axis());
  std::uint32_t label = 0;
  for_each_labelled(set, voxel[frame.u], voxel[frame.v],
                    [&](const Interval& interval, std::uint32_t value) {
                      const int w = voxel[frame.w];
                      if (w >= interval.begin() && w < interval.end()) label = value;
                    });
  return label;
}

/// A mesh, and the same grid with `samples` voxels for one: what is solid there, one by one.
/// @return how many samples are solid
std::uint64_t expect_counts(const TriangleSoup& mesh, const VoxelGrid& grid, int samples,
                            VoxelizeOptions options) {
  options.samples = 1;
  VoxelGrid fine = grid;
  fine.dims *= samples;
  fine.voxel_size /= samples;
  const VoxelIntervals solid = voxelize(mesh, fine, options).value();
  std::vector<std::uint32_t> counts(
      static_cast<std::size_t>(grid.dims.x * grid.dims.y * grid.dims.z));
  const auto place = [&](int i, int j, int k) {
    return static_cast<std::size_t>((k * grid.dims.y + j) * grid.dims.x + i);
  };
  std::uint64_t total = 0;
  for (int v = 0; v < solid.v_end(); ++v) {
    for (int u = 0; u < solid.columns(); ++u) {
      for (const Interval& interval : solid.column(u, v)) {
        for (int w = interval.begin(); w < interval.end(); ++w, ++total) {
          const AxisFrame frame(options.axis);
          glm::ivec3 at(0);
          at[frame.u] = u, at[frame.v] = v, at[frame.w] = w;
          at /= samples;
          ++counts[place(at.x, at.y, at.z)];
        }
      }
    }
  }
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    options.axis = axis;
    options.samples = samples;
    const VoxelIntervals set = voxelize(mesh, grid, options).value();
    EXPECT_EQ(set.grid(), grid);
    int wrong = 0;
    for (int k = 0; k < grid.dims.z; ++k) {
      for (int j = 0; j < grid.dims.y; ++j) {
        for (int i = 0; i < grid.dims.x; ++i) {
          wrong += label_at(set, {i, j, k}) != counts[place(i, j, k)] ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(wrong, 0) << samples << " along "
                        << "xyz"[static_cast<int>(axis)];
  }
  return total;
}

TEST(Samples, AreTheVoxelsOfAFinerGridForEveryAxis) {
  std::uint64_t total = 0;
  for (auto& [name, mesh] : simple_solids()) {
    SCOPED_TRACE(name);
    VoxelGrid grid = grid_around(mesh, 30, 1);
    grid.voxel_size *= glm::dvec3(0.7, 1.3, 1.0);
    for (const int samples : {2, 3, 5}) total += expect_counts(mesh, grid, samples, {});
  }
  EXPECT_GT(total, 100000u);
}

TEST(Samples, OfOpenMeshesAndSurfacesAreTheSame) {
  TriangleSoup ball = make_icosphere(1.0, 3);
  const VoxelGrid grid = grid_around(ball, 21, 1);
  VoxelizeOptions surface;
  surface.surface = true;
  EXPECT_GT(expect_counts(ball, grid, 4, surface), 10000u);
  ball.triangles.resize(ball.triangles.size() - 5);
  VoxelizeOptions open;
  open.closedness = Closedness::kAssumeOpen;
  EXPECT_GT(expect_counts(ball, grid, 4, open), 10000u);
}

TEST(Samples, FillAxisAlignedBoxesByTheirShare) {
  // Faces at quarters of voxels, between the samples.
  const TriangleSoup box = make_box({1.25, 2.5, 3.75}, {6.5, 5.75, 5.25});
  VoxelGrid grid;
  grid.dims = glm::ivec3(8);
  const VoxelIntervals set = voxelize(box, grid, with_samples(4)).value();
  const auto share = [](int voxel, double low, double high) {
    return std::max(0.0, std::min(voxel + 1.0, high) - std::max<double>(voxel, low));
  };
  for (int k = 0; k < 8; ++k) {
    for (int j = 0; j < 8; ++j) {
      for (int i = 0; i < 8; ++i) {
        const double expected =
            64 * share(i, 1.25, 6.5) * share(j, 2.5, 5.75) * share(k, 3.75, 5.25);
        EXPECT_EQ(label_at(set, {i, j, k}), expected) << i << " " << j << " " << k;
      }
    }
  }
}

TEST(Samples, OfABallAddUpToItsVolume) {
  const TriangleSoup ball = make_icosphere(10.0, 5);
  const VoxelGrid grid = grid_around(ball, 20, 1);
  const VoxelIntervals set = voxelize(ball, grid, with_samples(4)).value();
  double sum = 0;
  int soft = 0;
  for (int v = 0; v < set.v_end(); ++v) {
    for (int u = 0; u < set.columns(); ++u) {
      for_each_labelled(set, u, v, [&](const Interval& interval, std::uint32_t label) {
        EXPECT_TRUE(label >= 1 && label <= 64);
        sum += label / 64.0 * interval.length();
        soft += label < 64 ? interval.length() : 0;
      });
    }
  }
  const glm::dvec3 s = grid.voxel_size;
  const double volume = 4.0 / 3 * 3.14159265358979 * 1000;
  EXPECT_NEAR(sum * s.x * s.y * s.z, volume, 0.003 * volume);
  EXPECT_GT(soft, 1000);  // about the area, 1257
  EXPECT_LT(soft, 2500);
}

TEST(Samples, OfSlabsAreThoseOfThePiece) {
  const TriangleSoup ball = make_icosphere(1.0, 3);
  const VoxelGrid grid = grid_around(ball, 150, 0);
  for (const int samples : {2, 3}) {
    const VoxelIntervals whole = voxelize(ball, grid, with_samples(samples)).value();
    Execution execution;
    execution.memory_limit = 1;  // the smallest slabs
    int rows = 0, slabs = 0, wrong = 0;
    const auto report = voxelize_slabs(
        ball, grid, with_samples(samples), execution, [&](const VoxelIntervals& slab) {
          EXPECT_EQ(slab.v_begin(), rows);
          EXPECT_EQ(slab.v_begin() % VoxelIntervals::kTileSide, 0);
          rows = slab.v_end();
          ++slabs;
          for (int v = slab.v_begin(); v < slab.v_end(); ++v) {
            for (int u = 0; u < slab.columns(); ++u) {
              wrong += std::ranges::equal(slab.column(u, v), whole.column(u, v)) ? 0 : 1;
              wrong +=
                  std::ranges::equal(slab.column_labels(u, v), whole.column_labels(u, v)) ? 0 : 1;
            }
          }
          return Result<void>();
        });
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(rows, grid.dims.y);
    EXPECT_EQ(slabs, 3);
    EXPECT_EQ(wrong, 0);
  }
}

TEST(Samples, MayBeMoreThanARowOfTilesHolds) {
  const TriangleSoup box = make_box({0, 0, 0}, {1, 1, 1});
  VoxelGrid grid;
  grid.dims = {1, 1, 1};
  grid.voxel_size = glm::dvec3(1.0);
  std::uint32_t label = 0;
  ASSERT_TRUE(voxelize_slabs(box, grid, with_samples(1100), {}, [&](const VoxelIntervals& slab) {
    EXPECT_EQ(slab.v_end(), 1);  // with 0 rows it would go on for ever
    label = label_at(slab, {0, 0, 0});
    return slab.v_end() == 1 ? Result<void>() : fail(ErrorCode::kInternal, "no rows");
  }));
  EXPECT_EQ(label, 1100u * 1100u * 1100u);
}

TEST(Samples, BeyondTheLargestGridAreRefused) {
  const TriangleSoup box = make_box({0, 0, 0}, {1, 1, 1});
  VoxelGrid grid;
  grid.dims = {20000, 1, 1};
  grid.voxel_size = glm::dvec3(1.0 / 20000);
  EXPECT_TRUE(voxelize(box, grid, with_samples(3)));
  for (const int samples : {4, 1 << 30, 0, -1}) {
    const auto refused = voxelize(box, grid, with_samples(samples));
    ASSERT_FALSE(refused) << samples;
    EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
    EXPECT_NE(refused.error().message.find("1 to 3"), std::string::npos) << refused.error().message;
  }
}

}  // namespace
}  // namespace strata
