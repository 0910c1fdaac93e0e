// Walls between voxel centres: each is found, and nothing else is taken for one.

#include "voxelize/open/lost_walls.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "tests/support/trouble.h"
#include "tests/support/voxelized.h"

namespace strata {
namespace {

using namespace testkit;  // NOLINT: the tests' own vocabulary

LostWalls lost(const TriangleSoup& mesh, const VoxelGrid& grid, int threads = 2) {
  Execution execution;
  execution.threads = threads;
  auto found = find_lost_walls(mesh, grid, {}, execution);
  EXPECT_TRUE(found) << found.error().message;
  return found ? *found : LostWalls{};
}

/// A block of `side` voxels with `count` fins of `thickness` on it, half a voxel and a bit apart,
/// that stand out along `along` and are thin along `across`.
TriangleSoup finned(double side, int count, double thickness, int along, int across) {
  TriangleSoup mesh = make_box(glm::dvec3(0), glm::dvec3(side));
  for (int i = 0; i < count; ++i) {
    glm::dvec3 low(0.0), high(side);
    low[along] = side, high[along] = 2 * side;
    low[across] = 0.01 + 0.5 * i, high[across] = low[across] + thickness;
    append(mesh, make_box(low, high));
  }
  return mesh;
}

TEST(LostWalls, EveryFinIsCountedWithItsPlaceWhereverItIsThin) {
  for (int along = 0; along < 3; ++along) {
    for (int across = 0; across < 3; ++across) {
      if (across == along) continue;
      glm::ivec3 dims(40);
      dims[along] = 80;
      const LostWalls found = lost(finned(40, 60, 0.05, along, across), unit_grid(dims));
      EXPECT_EQ(found.count, 60u) << along << across;
      ASSERT_EQ(found.largest.size(), LostWalls::kMostTold);
      for (const LostWall& wall : found.largest) {
        EXPECT_EQ(static_cast<int>(wall.axis), across);
        EXPECT_EQ(wall.columns, 1600u);
        EXPECT_NEAR(wall.thickness, 0.05, 1e-6);
        EXPECT_EQ(wall.low[along], 40.0);
        EXPECT_EQ(wall.high[along], 80.0);
        EXPECT_NEAR(wall.high[across] - wall.low[across], 0.05, 0.01);
      }
      EXPECT_NEAR(found.largest[0].low[across], 0.01, 0.01);
    }
  }
}

TEST(LostWalls, OfLargeGridsEveryWallIsSeenByASample) {
  const TriangleSoup mesh = finned(100, 100, 0.05, 0, 1);
  for (const double size : {1.0, 0.5, 0.25}) {
    VoxelGrid grid = unit_grid(glm::ivec3(200 / size, 100 / size, 100 / size));
    grid.voxel_size = glm::dvec3(size);
    EXPECT_EQ(lost(mesh, grid).count, 100u) << size;
  }
  // Where their middles are hit nothing is lost.
  VoxelGrid grid = unit_grid({200, 1000, 100});
  grid.voxel_size.y = 0.1;
  grid.origin.y = -0.015;
  EXPECT_EQ(lost(mesh, grid).count, 0u);
}

TEST(LostWalls, TheResultDependsNeitherOnOrderNorThreads) {
  TriangleSoup mesh = finned(100, 30, 0.1, 2, 0);
  const VoxelGrid grid = unit_grid({100, 100, 200});
  const LostWalls first = lost(mesh, grid, 1);
  EXPECT_EQ(first.count, 30u);
  std::mt19937 random(7);
  for (int threads = 1; threads < 4; ++threads) {
    std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
    const LostWalls found = lost(mesh, grid, threads);
    EXPECT_EQ(found.count, first.count);
    for (std::size_t i = 0; i < first.largest.size(); ++i) {
      EXPECT_EQ(found.largest[i].low, first.largest[i].low);
      EXPECT_EQ(found.largest[i].high, first.largest[i].high);
    }
  }
}

TEST(LostWalls, SlantedAndCurvedWallsAreFound) {
  const TriangleSoup plate = make_box({-20, -20, -0.02}, {20, 20, 0.02});
  for (const double degrees : {3.0, 20.0, 45.0}) {
    for (const glm::dvec3& about :
         {glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(1, 1, 0)}) {
      glm::dmat4 m = glm::translate(glm::dmat4(1.0), glm::dvec3(32.3, 32.3, 32.6));
      m = glm::rotate(m, glm::radians(degrees), glm::normalize(about));
      const LostWalls found = lost(transform(plate, m), unit_grid(glm::ivec3(64)));
      EXPECT_EQ(found.count, 1u) << degrees;
    }
  }
  TriangleSoup shell = make_icosphere(30.0, 5), inner = make_icosphere(29.9, 5);
  reverse_orientation(inner);
  append(shell, inner);
  for (auto& p : shell.positions) p += 32.0;
  EXPECT_EQ(lost(shell, unit_grid(glm::ivec3(64))).count, 1u);
}

TEST(LostWalls, NothingIsSaidOfWhatIsThick) {
  // Balls, tubes and boxes of all sizes and places, and edges as sharp as 30 degrees.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> offset(0.0, 1.0);
  for (const double radius : {1.0, 2.5, 7.0, 15.0, 31.0}) {
    for (int round = 0; round < 4; ++round) {
      const glm::dvec3 at(32 + offset(random), 32 + offset(random), 32 + offset(random));
      const glm::dmat4 m =
          glm::rotate(glm::translate(glm::dmat4(1.0), at), 6 * offset(random),
                      glm::normalize(glm::dvec3(offset(random), offset(random), 1)));
      const VoxelGrid grid = unit_grid(glm::ivec3(65));
      for (const TriangleSoup& mesh :
           {make_icosphere(radius, 4), make_box(glm::dvec3(-radius / 2), glm::dvec3(radius / 2)),
            make_torus(radius * 0.7, radius * 0.3, 64, 24), make_cone(radius / 2, radius, 48)}) {
        if (radius < 2 && mesh.triangles.size() > 2000) continue;  // the small torus is thin
        const LostWalls found = lost(transform(mesh, m), grid);
        EXPECT_EQ(found.count, 0u) << radius << ' ' << mesh.triangles.size();
      }
    }
  }
  EXPECT_EQ(lost(make_box(glm::dvec3(0), glm::dvec3(2)), unit_grid(glm::ivec3(2))).count, 0u);
}

TEST(LostWalls, GapsAndWhatLiesWithinASolidAreNone) {
  // Two boxes with a gap thinner than a voxel.
  TriangleSoup mesh = make_box({0, 0, 0}, {20, 20, 10.1});
  append(mesh, make_box({0, 0, 10.2}, {20, 20, 20}));
  EXPECT_EQ(lost(mesh, unit_grid(glm::ivec3(20))).count, 0u);
  // A plate within a box, and one without thickness beside it.
  mesh = make_box({0, 0, 0}, {20, 20, 20});
  append(mesh, make_box({2, 2, 10.6}, {18, 18, 10.7}));
  EXPECT_EQ(lost(mesh, unit_grid(glm::ivec3(20))).count, 0u);
  mesh = make_box({0, 0, 0}, {20, 20, 10});
  mesh.positions.insert(mesh.positions.end(), {{0, 0, 15}, {20, 0, 15}, {0, 20, 15}});
  mesh.triangles.insert(mesh.triangles.end(), {{8, 9, 10}, {10, 9, 8}});
  EXPECT_EQ(lost(mesh, unit_grid(glm::ivec3(20))).count, 0u);
  // What lies outside of the grid.
  mesh = make_box({0, 0, 0}, {20, 20, 10});
  append(mesh, make_box({0, 0, 30.6}, {20, 20, 30.7}));
  append(mesh, make_box({0, 0, -9.4}, {20, 20, -9.3}));
  EXPECT_EQ(lost(mesh, unit_grid(glm::ivec3(20))).count, 0u);
}

TEST(LostWalls, AFineMeshIsSearchedAsWellAsACoarseOne) {
  TriangleSoup mesh = make_box({0, 0, 0}, {200, 100, 100});
  append(mesh, make_box({210, 0, 0}, {210.1, 100, 100}));
  for (int i = 0; i < 6; ++i) mesh = subdivide(mesh);
  LostWallOptions options;
  options.longest_edge = 3.99;
  const VoxelGrid grid = unit_grid({256, 128, 128});  // cells of 4 voxels
  const auto found = find_lost_walls(mesh, grid, options);
  ASSERT_TRUE(found);
  ASSERT_EQ(found->count, 1u);
  EXPECT_NEAR(found->largest[0].low.x, 210.0, 0.01);
  EXPECT_GT(found->largest[0].columns, 9000u);
}

}  // namespace
}  // namespace strata
