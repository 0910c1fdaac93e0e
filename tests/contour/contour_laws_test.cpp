#include <gtest/gtest.h>

#include <random>

#include "strata/mesh/check/mesh_check.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "strata/voxelize/checksum.h"
#include "strata/voxelize/grid_fit.h"
#include "tests/contour/contour_testing.h"
#include "tests/support/voxelized.h"

namespace strata {
namespace {

using testkit::checked_contour;

VoxelGrid unit_grid(const glm::ivec3& dims) { return {dims, glm::dvec3(0.0), glm::dvec3(1.0)}; }

/// Boxes around voxel centres, each with sides of its own that reach up to 255/256 of the way to
/// the next centre. So any set of voxels, and any places where grid edges are cut.
class Noise {
 public:
  explicit Noise(unsigned seed) : random_(seed) {}

  /// @param extremes  only the nearest and farthest places
  void add(TriangleSoup& soup, const glm::ivec3& voxel, bool extremes) {
    glm::dvec3 low, high;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = voxel[axis] + 0.5 - reach(extremes);
      high[axis] = voxel[axis] + 0.5 + reach(extremes);
    }
    append(soup, make_box(low, high));
  }
  bool chance(double part) { return std::uniform_real_distribution<>(0.0, 1.0)(random_) < part; }

 private:
  double reach(bool extremes) {
    if (extremes) return chance(0.5) ? 1.0 / 256 : 255.0 / 256;
    return std::uniform_int_distribution<>(1, 255)(random_) / 256.0;
  }
  std::mt19937 random_;
};

TEST(ContourLaws, HoldForEveryCellWhereverItsEdgesAreCut) {
  for (unsigned corners = 1; corners < 256; ++corners) {
    Noise noise(corners);
    for (int run = 0; run < 12; ++run) {
      TriangleSoup soup;
      for (unsigned c = 0; c < 8; ++c) {
        if ((corners >> c & 1) == 0) continue;
        noise.add(soup, {c & 1, c >> 1 & 1, c >> 2}, run % 2 == 0);
      }
      SCOPED_TRACE(::testing::Message() << "corners " << corners << ", run " << run);
      checked_contour(soup, unit_grid(glm::ivec3(2)));
      if (HasFailure()) return;
    }
  }
}

TEST(ContourLaws, HoldForNoise) {
  for (unsigned seed = 0; seed < 24; ++seed) {
    Noise noise(seed);
    const glm::ivec3 dims(3 + seed % 5, 4 + seed % 3, 5 + seed % 7);
    TriangleSoup soup;
    for (int x = 0; x < dims.x; ++x) {
      for (int y = 0; y < dims.y; ++y) {
        for (int z = 0; z < dims.z; ++z) {
          if (noise.chance(0.2 + 0.2 * (seed % 4))) noise.add(soup, {x, y, z}, seed % 3 == 0);
        }
      }
    }
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    ContourReport report;
    checked_contour(soup, unit_grid(dims), {}, &report);
    EXPECT_GT(report.ambiguous_cells, 0u);
    EXPECT_GT(report.middle_vertices, 0u);
    EXPECT_EQ(report.guessed_crossings, 0u);
    if (HasFailure()) return;
  }
}

TEST(ContourLaws, HoldAcrossBlocks) {  // of 32 x 32 x 32 cells
  Noise noise(1);
  TriangleSoup soup;
  const glm::ivec3 dims(34, 66, 33);
  for (int n = 0; n < 2500; ++n) {
    glm::ivec3 voxel;
    for (int axis = 0; axis < 3; ++axis) {
      int at = 0;
      while (noise.chance(0.7)) ++at;
      voxel[axis] =
          (noise.chance(0.5) ? 31 - at : 32 + at) + (axis == 1 && noise.chance(0.5) ? 32 : 0);
      voxel[axis] = std::clamp(voxel[axis], 0, dims[axis] - 1);
    }
    noise.add(soup, voxel, false);
  }
  checked_contour(soup, unit_grid(dims), {.rule = InsideRule::kWinding});
}

/// What a brute-force search would take too long for.
void expect_sound(const TriangleSoup& soup, const VoxelGrid& grid) {
  const auto made = contour(soup, grid);
  ASSERT_TRUE(made.has_value());
  const auto check = check_mesh(made->mesh.positions, made->mesh.triangles);
  ASSERT_TRUE(check.has_value());
  EXPECT_TRUE(check->sound());
  EXPECT_TRUE(check->by_index);
  EXPECT_EQ(check->meeting_pairs(), 0u);
  EXPECT_GT(check->triangles, 10'000u);
  const auto wanted = testkit::voxelized(soup, grid);
  const auto given = testkit::voxelized(testkit::soup_of(made->mesh), grid);
  EXPECT_EQ(set_checksum(given), set_checksum(wanted));
}

TEST(ContourLaws, HoldForLargeMeshes) {
  Noise noise(77);
  TriangleSoup soup;
  const glm::ivec3 dims(40, 36, 70);
  for (int x = 0; x < dims.x; ++x) {
    for (int y = 0; y < dims.y; ++y) {
      for (int z = 0; z < dims.z; ++z) {
        if (noise.chance(x % 20 == 7 ? 0.95 : 0.1)) noise.add(soup, {x, y, z}, y > 20);
      }
    }
  }
  expect_sound(soup, unit_grid(dims));
  const TriangleSoup knot = make_torus_knot(3, 5, 0.15, 300, 24);
  expect_sound(knot, *fit_grid(bounds(knot), {.resolution = 150}));
}

TEST(ContourLaws, HoldForOverlappingBalls) {
  std::mt19937 random(5);
  for (int run = 0; run < 8; ++run) {
    TriangleSoup soup;
    std::uniform_real_distribution<> place(-1.0, 1.0), size(0.15, 0.7);
    for (int n = 0; n < 5 + 3 * run; ++n) {
      glm::dmat4 move(1.0);
      const double radius = size(random);
      for (int axis = 0; axis < 3; ++axis) {
        move[axis][axis] = radius;
        move[3][axis] = place(random);
      }
      append(soup, transform(make_icosphere(1.0, 2), move));
    }
    const auto grid = fit_grid(bounds(soup), {.resolution = 10 + 3 * run});
    ASSERT_TRUE(grid.has_value());
    for (const InsideRule rule : {InsideRule::kWinding, InsideRule::kParity}) {
      SCOPED_TRACE(::testing::Message() << "run " << run << ", rule " << static_cast<int>(rule));
      checked_contour(soup, *grid, {.rule = rule});
      if (HasFailure()) return;
    }
  }
}

}  // namespace
}  // namespace strata
