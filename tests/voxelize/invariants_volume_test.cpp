// How many voxels a solid has: exact for boxes, bounded by its surface for everything else, and
// closer the finer the grid.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "tests/support/corpus.h"
#include "tests/support/reference_lists.h"
#include "tests/support/trouble.h"
#include "tests/support/voxelized.h"

namespace strata {
namespace {

using namespace testkit;  // NOLINT: the tests' own vocabulary

constexpr double kPi = std::numbers::pi;

double voxel_volume(const TriangleSoup& mesh, const VoxelGrid& grid, Axis axis = Axis::kZ) {
  const auto voxels = voxelized(mesh, grid, {.axis = axis});
  return static_cast<double>(voxels.solid_voxels()) * grid.voxel_size.x * grid.voxel_size.y *
         grid.voxel_size.z;
}

/// The volume between entries and exits, in whole lattice steps along the rays. Depths are floors:
/// what they cut off cancels.
double list_volume(const TriangleSoup& mesh, const VoxelGrid& grid, Axis axis) {
  const auto lattice = snap_to_lattice(mesh, grid);
  EXPECT_TRUE(lattice.has_value());
  std::int64_t steps = 0;
  for (const DepthItem item : built_lists<DepthItem>(*lattice, target_of(grid, axis)).keys) {
    steps += item.exit() ? std::int64_t{item.depth()} : -std::int64_t{item.depth()};
  }
  return static_cast<double>(steps) / kLatticeSteps * std::pow(grid.voxel_size.x, 3);
}

// I19
TEST(AlignedBox, HasExactlyItsVoxels) {
  for (const unsigned n : {1u, 2u, 3u, 7u, 8u, 63u, 64u, 65u, 128u}) {
    // A cube that fills the grid, on every side at the grid's border.
    const VoxelGrid grid = unit_grid(glm::ivec3(static_cast<int>(n)));
    const TriangleSoup cube = make_box(glm::dvec3(0), glm::dvec3(n));
    for (const Axis axis : kAllAxes) {
      for (const Closedness closedness : kAllClosedness) {
        const auto voxels = voxelized(cube, grid, {.axis = axis, .closedness = closedness});
        EXPECT_EQ(voxels.solid_voxels(), std::uint64_t{n} * n * n) << n;
        EXPECT_EQ(voxels.interval_count(), std::uint64_t{n} * n) << n;
      }
    }
  }
}

TEST(AlignedBox, OfEightVoxelsASideHasFiveHundredAndTwelve) {
  // On a larger grid, at any whole place, with a world that decimal numbers do not hold exactly.
  for (const double size : {1.0, 0.1, 1.0 / 3.0, 1e-9, 12345.678}) {
    for (const glm::ivec3 corner : {glm::ivec3(0), glm::ivec3(1, 2, 3), glm::ivec3(8, 8, 8)}) {
      VoxelGrid grid = unit_grid({16, 16, 16});
      grid.voxel_size = glm::dvec3(size);
      grid.origin = glm::dvec3(-7.7, 0.3, 100) * size;
      const glm::dvec3 low = grid.origin + glm::dvec3(corner) * size;
      const TriangleSoup cube = make_box(low, low + glm::dvec3(8 * size));
      for (const Axis axis : kAllAxes) {
        const VoxelSet found = voxel_set(cube, grid, {.axis = axis});
        EXPECT_EQ(count(found), 512) << size;
        EXPECT_TRUE(found.solid(corner) && found.solid(corner + 7)) << size;
      }
    }
  }
}

TEST(AlignedBox, BeyondTheGridFillsAllOfIt) {
  const VoxelGrid grid = unit_grid({9, 70, 5});
  for (const double reach : {0.25, 1.0, 100.0, 1e5, 1e6}) {
    const TriangleSoup box = make_box(glm::dvec3(-reach), glm::dvec3(grid.dims) + reach);
    for (const Axis axis : kAllAxes) {
      EXPECT_EQ(voxelized(box, grid, {.axis = axis}).solid_voxels(), 9u * 70 * 5) << reach;
    }
  }
}

TEST(AlignedBox, OnVoxelCentresIsHalfOpenOnAllAxes) {
  // The centres on its low faces are in, those on its high faces are out.
  const VoxelGrid grid = unit_grid({12, 12, 12});
  const TriangleSoup box = make_box({2.5, 3.5, 4.5}, {7.5, 8.5, 9.5});
  const VoxelSet expected = set_of(grid.dims, [](const glm::ivec3& p) {
    return p.x >= 2 && p.x < 7 && p.y >= 3 && p.y < 8 && p.z >= 4 && p.z < 9;
  });
  for (const Axis axis : kAllAxes) EXPECT_EQ(voxel_set(box, grid, {.axis = axis}), expected);
}

// I18
TEST(Volume, DiffersFromTheMeshsByLessThanItsSurfaceTimesAVoxel) {
  std::vector<NamedMesh> meshes = simple_solids();
  for (auto& scan : scans({"bunny00", "cow", "fandisk", "man"})) {
    EXPECT_TRUE(is_closed(scan.mesh)) << scan.name;
    meshes.push_back(std::move(scan));
  }
  for (const auto& [name, mesh] : meshes) {
    const MeshDiagnosis known = diagnose(mesh);
    for (const int longest : {20, 64}) {
      const VoxelGrid grid = grid_around(mesh, longest, 1);
      const double bound = known.area * grid.voxel_size.x;
      double volume[3];
      for (const Axis axis : kAllAxes) {
        double& v = volume[static_cast<int>(axis)];
        v = voxel_volume(mesh, grid, axis);
        EXPECT_LE(std::abs(v - std::abs(known.volume)), bound) << name << " at " << longest;
      }
      EXPECT_EQ(volume[0], volume[1]) << name;
      EXPECT_EQ(volume[0], volume[2]) << name;
    }
  }
}

TEST(Volume, OfTheListsConvergesAtLeastAsFastAsTheVoxelsShrink) {
  std::mt19937_64 random(180);
  for (const auto& [name, mesh] :
       {NamedMesh{"sphere", make_icosphere(1, 4)}, NamedMesh{"torus", make_torus(2, 0.7, 80, 40)},
        NamedMesh{"knot", make_torus_knot(2, 3, 0.4, 200, 20)}}) {
    const MeshDiagnosis known = diagnose(mesh);
    // A single error may be small by chance: the mean square of many, in a line through
    // (log h, log error) of four halvings.
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    constexpr int kSizes[] = {10, 20, 40, 80, 160};
    for (const int longest : kSizes) {
      const double h = 6.5 / longest;
      double squares = 0;
      for (int round = 0; round < 6; ++round) {
        const TriangleSoup turned = randomly_rotated(mesh, random);
        VoxelGrid grid = unit_grid(glm::ivec3(longest + 2));
        grid.voxel_size = glm::dvec3(h);
        grid.origin = glm::dvec3(-0.5 * h * (longest + 2));
        const double error = list_volume(turned, grid, kAllAxes[round % 3]) - known.volume;
        EXPECT_LE(std::abs(error), known.area * h) << name;
        squares += error * error;
      }
      const double x = std::log(h), y = std::log(squares) / 2;
      sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    constexpr double kCount = std::size(kSizes);
    const double slope = (kCount * sxy - sx * sy) / (kCount * sxx - sx * sx);
    EXPECT_GE(slope, 0.8) << name;
  }
}

// I20
TEST(Volume, OfRoundShapesIsThatOfTheirFormulas) {
  struct Shape {
    const char* name;
    TriangleSoup mesh;
    double volume, area;
  };
  const std::vector<Shape> shapes = {
      {"sphere", make_icosphere(1, 6), 4 * kPi / 3, 4 * kPi},
      {"uv sphere", make_uv_sphere(1, 256, 128), 4 * kPi / 3, 4 * kPi},
      {"torus", make_torus(2, 0.6, 256, 128), 2 * kPi * kPi * 2 * 0.36, 4 * kPi * kPi * 2 * 0.6},
      {"cone", make_cone(1, 2, 512), 2 * kPi / 3, kPi * (1 + std::sqrt(5.0))},
      {"cylinder", make_cylinder(1, 2, 512), 2 * kPi, 6 * kPi}};
  for (const auto& [name, mesh, volume, area] : shapes) {
    for (const int longest : {31, 100}) {
      const VoxelGrid grid = grid_around(mesh, longest, 1);
      const double h = grid.voxel_size.x;
      // A tenth of the bound, and what the faceted shape lacks of the round one.
      EXPECT_NEAR(voxel_volume(mesh, grid), volume, 0.1 * area * h + 0.001 * volume)
          << name << " at " << longest;
    }
  }
}

TEST(Volume, OfASphereStaysWithinTheBoundOfTheCircleProblem) {
  // Gauss: the lattice points in a sphere of radius r are those of its volume, give or take its
  // surface. Known far better: the error is below 6 r^(3/2) for these r.
  for (const double radius : {5.0, 10.0, 20.5, 40.25}) {
    const int side = 2 * static_cast<int>(std::ceil(radius)) + 2;
    TriangleSoup mesh = make_icosphere(radius, 6);
    for (auto& p : mesh.positions) p += glm::dvec3(side / 2.0);
    const double exact = signed_volume(mesh);
    const VoxelGrid grid = unit_grid({side, side, side});
    EXPECT_NEAR(voxel_volume(mesh, grid), exact, 6 * std::pow(radius, 1.5)) << radius;
  }
}

// I23
TEST(Volume, StaysWhenTheMeshIsTurned) {
  std::mt19937_64 random(23);
  std::vector<NamedMesh> meshes;
  for (auto& solid : simple_solids()) meshes.push_back(std::move(solid));
  for (auto& scan : scans({"cow", "homer", "fandisk"})) meshes.push_back(std::move(scan));
  for (const auto& [name, mesh] : meshes) {
    const MeshDiagnosis known = diagnose(mesh);
    const double size = grid_around(mesh, 40).voxel_size.x;
    for (int round = 0; round < 3; ++round) {
      const TriangleSoup turned = randomly_rotated(mesh, random);
      VoxelGrid grid = grid_around(turned, 40, 1);
      const glm::dvec3 extent = glm::dvec3(grid.dims) * grid.voxel_size;
      grid.voxel_size = glm::dvec3(size);
      for (int i = 0; i < 3; ++i) grid.dims[i] = static_cast<int>(std::ceil(extent[i] / size)) + 1;
      EXPECT_NEAR(voxel_volume(turned, grid), known.volume, 2 * known.area * size) << name;
    }
  }
}

// --- deep and flat grids
// --------------------------------------------------------------------------

TEST(DeepGrid, HasTheSameVoxelsOnAllAxes) {
  // Deeper than 32768 voxels, lists are kept in 64-bit records along that axis and in 32-bit ones
  // along the others.
  std::mt19937_64 random(64);
  for (int deep = 0; deep < 3; ++deep) {
    for (const int depth : {32767, 32768, 32769, 40001, 65536}) {
      glm::ivec3 dims(3, 4, 5);
      dims[deep] = depth;
      const VoxelGrid grid = unit_grid(dims);
      TriangleSoup mesh = random_tetrahedra(random, 8, 1, 0, 5 * 256);
      for (auto& p : mesh.positions) p[deep] *= depth / 5.0;
      append(mesh, make_box(glm::dvec3(1), glm::dvec3(dims) - 1.0));
      TriangleSoup last = make_box(glm::dvec3(dims) - 1.0, glm::dvec3(dims));
      append(mesh, last);
      for (const InsideRule rule : {InsideRule::kWinding, InsideRule::kParity}) {
        VoxelizeReport reports[3];
        for (const Axis axis : kAllAxes) {
          VoxelizeReport& report = reports[static_cast<int>(axis)];
          const auto store = axis == Axis::kX ? StoreKind::kCountScan : StoreKind::kHaBuffer;
          voxelized(mesh, grid, {.rule = rule, .axis = axis, .store = store, .statistics = true},
                    {}, &report);
          EXPECT_EQ(report.unbalanced_columns, 0u);
          EXPECT_GT(report.solid_voxels, 0u);
          EXPECT_EQ(report.checksum, reports[0].checksum) << depth << " deep along " << deep;
          EXPECT_EQ(report.solid_voxels, reports[0].solid_voxels);
        }
      }
    }
  }
}

TEST(DeepGrid, FilledByABoxHasEveryVoxel) {
  for (int deep = 0; deep < 3; ++deep) {
    glm::ivec3 dims(2, 2, 2);
    dims[deep] = kMaxGridSide;
    const TriangleSoup box = make_box(glm::dvec3(0), glm::dvec3(dims));
    for (const Axis axis : kAllAxes) {
      const auto voxels = voxelized(box, unit_grid(dims), {.axis = axis});
      EXPECT_EQ(voxels.solid_voxels(), 4u * kMaxGridSide);
    }
  }
}

TEST(DeepGrid, HoldsThousandsOfLayersInAColumn) {
  // Plates of one voxel with gaps of one: 20 to 20,000 intervals a column, on tables that start
  // with 8 planes.
  for (const int plates : {20, 33, 64, 65, 300, 657, 20'000}) {
    const VoxelGrid grid = unit_grid({3, 2, 2 * plates});
    TriangleSoup mesh;
    for (int i = 0; i < plates; ++i) append(mesh, make_box({0, 0, 2 * i}, {3, 2, 2 * i + 1}));
    for (const StoreKind store : {StoreKind::kHaBuffer, StoreKind::kCountScan}) {
      VoxelizeReport report;
      const auto voxels = voxelized(mesh, grid, {.store = store, .statistics = true}, {}, &report);
      EXPECT_EQ(report.solid_voxels, 6u * static_cast<unsigned>(plates));
      EXPECT_EQ(report.intervals, 6u * static_cast<unsigned>(plates));
      EXPECT_EQ(report.max_depth_complexity, 2u * static_cast<unsigned>(plates));
      for (int u = 0; u < 3; ++u) {
        const auto column = voxels.column(u, 1);
        ASSERT_EQ(column.size(), static_cast<std::size_t>(plates));
        EXPECT_EQ(column[0], (Interval{0, 0}));
        EXPECT_EQ(column.back().first, 2 * plates - 2);
      }
    }
    // Across the plates: as many columns, an interval each.
    VoxelizeReport report;
    voxelized(mesh, grid, {.axis = Axis::kX, .statistics = true}, {}, &report);
    EXPECT_EQ(report.solid_voxels, 6u * static_cast<unsigned>(plates));
  }
}

TEST(DeepGrid, JoinsPlatesThatTouch) {
  // Each plate ends where the next begins: one interval, whatever the number of crossings.
  for (const int plates : {3, 40, 70, 500}) {
    const VoxelGrid grid = unit_grid({67, 2, plates});
    TriangleSoup mesh;
    for (int i = 0; i < plates; ++i) append(mesh, make_box({0, 0, i}, {67, 2, i + 1}));
    for (const InsideRule rule : kAllRules) {
      const auto voxels = voxelized(mesh, grid, {.rule = rule});
      EXPECT_EQ(voxels.interval_count(), 67u * 2);
      EXPECT_EQ(voxels.solid_voxels(), 67u * 2 * static_cast<unsigned>(plates));
    }
  }
}

}  // namespace
}  // namespace strata
