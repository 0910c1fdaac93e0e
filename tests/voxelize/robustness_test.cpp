// The solids that other converters get wrong (docs: the robustness table), 128 voxels a side.

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "tests/support/corpus.h"
#include "tests/support/trouble.h"
#include "tests/support/voxelized.h"

namespace strata {
namespace {

using namespace testkit;  // NOLINT: the tests' own vocabulary

constexpr int kSide = 128;
constexpr double kRadius = kSide / 2.0;
const VoxelGrid kGrid = unit_grid({kSide, kSide, kSide});

/// A sphere of about 16,000 triangles in the middle of the grid, `radius` voxels large.
TriangleSoup sphere(double radius = kRadius, const glm::dvec3& centre = glm::dvec3(kRadius)) {
  TriangleSoup mesh = make_uv_sphere(radius, 128, 64);
  for (auto& p : mesh.positions) p += centre;
  return mesh;
}

double centre_distance(const glm::ivec3& p) {
  return glm::length(glm::dvec3(p) + 0.5 - glm::dvec3(kRadius));
}

/// Runs along `axis` of `length` or more voxels that differ from their neighbours on all four
/// sides: the streaks that a wrong ray leaves, solid or empty.
std::int64_t stray_lines(const VoxelSet& set, Axis axis, int length = 4) {
  const AxisFrame frame(axis);
  std::int64_t lines = 0;
  glm::ivec3 du{}, dv{}, p{};
  du[frame.u] = 1, dv[frame.v] = 1;
  for (p[frame.v] = 0; p[frame.v] < set.dims()[frame.v]; ++p[frame.v]) {
    for (p[frame.u] = 0; p[frame.u] < set.dims()[frame.u]; ++p[frame.u]) {
      int run = 0;
      for (p[frame.w] = 0; p[frame.w] < set.dims()[frame.w]; ++p[frame.w]) {
        const bool solid = set.solid(p);
        int different = 0;
        for (const glm::ivec3& q : {p - du, p + du, p - dv, p + dv}) {
          different += set.solid(q) != solid;
        }
        run = different == 4 ? run + 1 : 0;
        if (run == length) ++lines;
      }
    }
  }
  return lines;
}

void expect_no_stray_lines(const VoxelSet& set) {
  for (const Axis axis : kAllAxes) EXPECT_EQ(stray_lines(set, axis), 0) << static_cast<int>(axis);
}

TEST(StrayLines, AreFoundWhereThereAreSome) {
  VoxelSet set = voxel_set(sphere(), kGrid);
  expect_no_stray_lines(set);
  for (int x = 0; x < kSide; ++x) set.at({x, 60, 61}) = x % 2 == 0 ? 1 : set.at({x, 60, 61});
  expect_no_stray_lines(set);  // no change inside, and single voxels outside
  for (int x = 50; x < 60; ++x) set.at({x, 60, 61}) = 0;
  EXPECT_EQ(stray_lines(set, Axis::kX), 1);
  for (int z = 0; z < 12; ++z) set.at({3, 3, z}) = 1;
  EXPECT_EQ(stray_lines(set, Axis::kZ), 1);
}

TEST(Robustness, CubeThatFillsTheGridHasEveryVoxel) {
  const TriangleSoup cube = make_box(glm::dvec3(0), glm::dvec3(kSide));
  for (const Axis axis : kAllAxes) {
    EXPECT_EQ(voxelized(cube, kGrid, {.axis = axis}).solid_voxels(), 2'097'152u);
  }
}

TEST(Robustness, TwoOverlappingSpheresAreTheirUnionWithoutAVoid) {
  const TriangleSoup a = sphere(36, {40, 64, 64}), b = sphere(36, {88, 64, 64});
  TriangleSoup both = a;
  append(both, b);
  const VoxelSet in_a = voxel_set(a, kGrid), in_b = voxel_set(b, kGrid);
  const VoxelSet expected =
      set_of(kGrid.dims, [&](const glm::ivec3& p) { return in_a.at(p) != 0 || in_b.at(p) != 0; });
  for (const Axis axis : kAllAxes) {
    VoxelizeReport report;
    const VoxelSet found = set_of(voxelized(both, kGrid, {.axis = axis}, {}, &report));
    EXPECT_EQ(found, expected);
    EXPECT_EQ(report.unbalanced_columns, 0u);
    EXPECT_EQ(report.negative_columns, 0u);
    expect_no_stray_lines(found);
  }
  EXPECT_TRUE(expected.solid({64, 64, 64}));  // where they overlap
}

TEST(Robustness, SphereWithACavityIsEmptyThere) {
  const TriangleSoup outer = sphere();
  TriangleSoup inner = sphere(32);
  const VoxelSet in_outer = voxel_set(outer, kGrid), in_inner = voxel_set(inner, kGrid);
  reverse_orientation(inner);
  TriangleSoup mesh = outer;
  append(mesh, inner);
  EXPECT_TRUE(diagnose(mesh).closed);
  EXPECT_FALSE(diagnose(mesh).inverted);
  const VoxelSet expected = set_of(
      kGrid.dims, [&](const glm::ivec3& p) { return in_outer.at(p) != 0 && in_inner.at(p) == 0; });
  for (const Axis axis : kAllAxes) EXPECT_EQ(voxel_set(mesh, kGrid, {.axis = axis}), expected);
  EXPECT_FALSE(expected.solid({64, 64, 64}));
  const double shell = 4 * std::numbers::pi / 3 * (64.0 * 64 * 64 - 32.0 * 32 * 32);
  EXPECT_NEAR(static_cast<double>(count(expected)), shell, 0.004 * shell);
}

/// What a vote makes of a sphere with holes, on all three axes: no streak outside, none inside.
void expect_nearly_whole(const TriangleSoup& open, double cut = 2 * kRadius) {
  EXPECT_FALSE(is_closed(open));
  const auto whole = static_cast<double>(count(voxel_set(sphere(), kGrid)));
  std::optional<VoxelSet> first;
  for (const Axis axis : kAllAxes) {
    VoxelizeReport report;
    const VoxelSet found = set_of(voxelized(
        open, kGrid, {.axis = axis, .open = OpenMode::kVote, .closedness = Closedness::kAssumeOpen},
        {}, &report));
    EXPECT_NEAR(static_cast<double>(count(found)), whole, 0.01 * whole);
    std::int64_t outside = 0, missing = 0;
    found.for_each([&](const glm::ivec3& p) {
      outside += found.solid(p) && centre_distance(p) > kRadius + 1;
      missing += !found.solid(p) && centre_distance(p) < kRadius - 2 && p.z + 1.5 < cut;
    });
    EXPECT_EQ(outside, 0) << "voxels outside the sphere, axis " << static_cast<int>(axis);
    EXPECT_EQ(missing, 0) << "voxels missing inside, axis " << static_cast<int>(axis);
    expect_no_stray_lines(found);
    if (!first) first = found;
    EXPECT_EQ(found, *first) << "the axis of the intervals may not matter";
  }
}

TEST(Robustness, SphereWithItsCapCutOffIsWholeWithoutStreaks) {
  // The cap is 0.64 % of the sphere's volume: six layers of voxels. On each side in turn.
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool low : {true, false}) {
      TriangleSoup open = sphere();
      const double cut = kRadius * 1.9065;
      std::erase_if(open.triangles, [&](const glm::uvec3& t) {
        const double middle =
            (open.positions[t.x] + open.positions[t.y] + open.positions[t.z])[axis] / 3;
        return (low ? kSide - middle : middle) > cut;
      });
      EXPECT_FALSE(is_closed(open));
      if (axis == 2 && !low) {
        expect_nearly_whole(open, cut);
        VoxelizeReport report;
        voxelized(open, kGrid, {.closedness = Closedness::kAssumeOpen}, {}, &report);
        // The columns through the cap's circle, radius sqrt(2 r d - d^2).
        const double opening = std::numbers::pi * (2 * kRadius - (kSide - cut)) * (kSide - cut);
        EXPECT_NEAR(static_cast<double>(report.unbalanced_columns), opening, 0.1 * opening);
      } else {
        const VoxelSet found = voxel_set(open, kGrid, {.closedness = Closedness::kAssumeOpen});
        const auto whole = static_cast<double>(count(voxel_set(sphere(), kGrid)));
        EXPECT_NEAR(static_cast<double>(count(found)), whole, 0.01 * whole);
        std::int64_t outside = 0;
        found.for_each([&](const glm::ivec3& p) {
          outside += found.solid(p) && centre_distance(p) > kRadius + 1;
        });
        EXPECT_EQ(outside, 0);
        expect_no_stray_lines(found);
      }
    }
  }
}

TEST(Robustness, SphereWithFortyTrianglesMissingIsWholeWithoutStreaks) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    std::mt19937_64 random(seed);
    TriangleSoup open = sphere();
    ASSERT_NEAR(static_cast<double>(open.triangles.size()), 16'000, 200);
    shuffle(open, random);
    open.triangles.resize(open.triangles.size() - 40);
    SCOPED_TRACE(seed);
    expect_nearly_whole(open);
    VoxelizeReport report;
    voxelized(open, kGrid, {.closedness = Closedness::kAssumeOpen}, {}, &report);
    EXPECT_GT(report.unbalanced_columns, 0u);
  }
}

TEST(Robustness, InvertedSphereIsReportedAndSolidOnceTurned) {
  TriangleSoup mesh = sphere();
  const VoxelSet expected = voxel_set(mesh, kGrid);
  reverse_orientation(mesh);
  const MeshDiagnosis found = diagnose(mesh);
  EXPECT_TRUE(found.closed);
  EXPECT_TRUE(found.inverted);
  VoxelizeReport report;
  EXPECT_EQ(voxelized(mesh, kGrid, {}, {}, &report).solid_voxels(), 0u);
  EXPECT_GT(report.negative_columns, 10'000u);  // most of the sphere's circle
  EXPECT_EQ(voxel_set(mesh, kGrid, {.rule = InsideRule::kNonzero}), expected);
  reverse_orientation(mesh);
  EXPECT_EQ(voxel_set(mesh, kGrid), expected);
}

TEST(Robustness, PlateATenthOfAVoxelThickIsHeldByItsSurface) {
  // Level, on each axis, between voxel centres and off voxel boundaries: no centre is inside.
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 low(0), high(kSide);
    low[axis] = 60.7, high[axis] = 60.8;
    const TriangleSoup plate = make_box(low, high);
    const VoxelSet expected =
        set_of(kGrid.dims, [&](const glm::ivec3& p) { return p[axis] == 60; });
    for (const Axis ray : kAllAxes) {
      EXPECT_EQ(voxelized(plate, kGrid, {.axis = ray}).solid_voxels(), 0u);
      EXPECT_EQ(voxel_set(plate, kGrid, {.axis = ray, .solid = false, .surface = true}), expected);
      EXPECT_EQ(voxel_set(plate, kGrid, {.axis = ray, .surface = true}), expected);
    }
  }
  // Slanted: some centres are inside. All of it is held, nothing but it, and no line is stray.
  TriangleSoup plate = make_box({-50, -50, -0.05}, {50, 50, 0.05});
  std::mt19937_64 random(7);
  plate = randomly_rotated(plate, random);
  for (auto& p : plate.positions) p += glm::dvec3(kRadius);
  const VoxelSet solid = voxel_set(plate, kGrid);
  const VoxelSet held = voxel_set(plate, kGrid, {.surface = true});
  EXPECT_TRUE(includes(held, solid));
  EXPECT_NEAR(static_cast<double>(count(solid)), 1000, 400);
  // Points all over the plate lie in voxels of the set.
  std::uniform_real_distribution<double> share(0, 1);
  const auto& corner = plate.positions;
  for (int i = 0; i < 20'000; ++i) {
    const glm::dvec3 p = corner[0] + share(random) * (corner[1] - corner[0]) +
                         share(random) * (corner[2] - corner[0]) +
                         share(random) * (corner[4] - corner[0]);
    EXPECT_TRUE(held.solid(glm::ivec3(glm::floor(p))));
  }
  // The plate's plane touches at most a few voxels on each line across it.
  EXPECT_LT(count(held), 4 * 100 * 100);
  for (const Axis axis : kAllAxes) EXPECT_EQ(voxel_set(plate, kGrid, {.axis = axis}), solid);
}

TEST(Robustness, AScanWithHolesHasTheVolumeOfTheWholeOne) {
  const auto read = scans({"bunny00"});
  if (read.empty()) GTEST_SKIP() << kNoScans;
  const TriangleSoup& whole = read[0].mesh;
  ASSERT_TRUE(is_closed(whole));
  const VoxelGrid grid = grid_around(whole, 256);
  const auto exact = static_cast<double>(count(voxel_set(whole, grid)));
  // Five holes of a twentieth of the length, as the Stanford scan has where it stood.
  TriangleSoup scan = whole;
  const Bounds box = bounds(whole);
  const double radius = 0.05 * (box.high - box.low).x;
  for (std::size_t i = 0; i < 5; ++i) {
    const glm::dvec3 middle = whole.positions[i * whole.positions.size() / 5];
    std::erase_if(scan.triangles, [&](const glm::uvec3& t) {
      return glm::distance(scan.positions[t.x], middle) < radius;
    });
  }
  EXPECT_FALSE(is_closed(scan));
  EXPECT_LT(scan.triangles.size(), whole.triangles.size() - 500);
  std::optional<VoxelSet> first;
  for (const Axis axis : kAllAxes) {
    const VoxelSet found =
        voxel_set(scan, grid, {.axis = axis, .closedness = Closedness::kAssumeOpen});
    EXPECT_NEAR(static_cast<double>(count(found)), exact, 0.001 * exact);
    if (!first) first = found;
    EXPECT_EQ(found, *first);
  }
}

TEST(OpenMesh, IsRefusedOrShownAsSurfaceWhenAskedFor) {
  TriangleSoup open = sphere();
  open.triangles.pop_back();
  const auto refused =
      voxelize(open, kGrid, {.open = OpenMode::kFail, .closedness = Closedness::kAssumeOpen});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kGeometry);
  EXPECT_EQ(
      voxel_set(open, kGrid, {.open = OpenMode::kSurface, .closedness = Closedness::kAssumeOpen}),
      voxel_set(open, kGrid, {.solid = false, .surface = true}));
}

TEST(Closedness, ACheckFindsWhatCouldBeAssumed) {
  TriangleSoup open = sphere();
  open.triangles.resize(open.triangles.size() - 7);
  TriangleSoup turned = sphere();  // every edge has two faces, some look opposite ways
  for (std::size_t t = 0; t < turned.triangles.size(); t += 3) {
    std::swap(turned.triangles[t].x, turned.triangles[t].y);
  }
  for (const InsideRule rule : kAllRules) {
    const bool parity = rule == InsideRule::kParity;
    for (const auto& [mesh, closed] :
         {std::pair(sphere(), true), std::pair(open, false), std::pair(turned, parity)}) {
      for (const OpenMode mode : {OpenMode::kVote, OpenMode::kSurface}) {
        VoxelizeReport report;
        const VoxelSet found =
            set_of(voxelized(mesh, kGrid, {.rule = rule, .open = mode}, {}, &report));
        EXPECT_EQ(report.closed, closed);
        const Closedness known = closed ? Closedness::kAssumeClosed : Closedness::kAssumeOpen;
        EXPECT_EQ(found, voxel_set(mesh, kGrid, {.rule = rule, .open = mode, .closedness = known}));
        EXPECT_GT(count(found), 0);
      }
      const auto strict = voxelize(mesh, kGrid, {.rule = rule, .open = OpenMode::kFail});
      EXPECT_EQ(strict.has_value(), closed);
      if (!closed) {
        EXPECT_EQ(strict.error().code, ErrorCode::kGeometry);
      }
    }
  }
}

TEST(Closedness, AnOpenMeshIsVoxelizedRightByItself) {
  TriangleSoup cup = make_box(glm::dvec3(-0.7), glm::dvec3(0.7));
  const VoxelSet solid = voxel_set(cup, kGrid);
  EXPECT_GT(count(solid), 0);
  cup.triangles.erase(cup.triangles.begin(), cup.triangles.begin() + 2);  // a side is missing
  EXPECT_EQ(voxel_set(cup, kGrid), solid);
  EXPECT_NE(voxel_set(cup, kGrid, {.closedness = Closedness::kAssumeClosed}), solid);
}

TEST(OpenMesh, ClosedMeshLosesNothingByAVote) {
  for (const auto& [name, mesh] : simple_solids()) {
    const VoxelGrid grid = grid_around(mesh, 70, 1);
    for (const Axis axis : kAllAxes) {
      EXPECT_EQ(voxel_set(mesh, grid, {.axis = axis, .closedness = Closedness::kAssumeOpen}),
                voxel_set(mesh, grid))
          << name;
    }
  }
}

}  // namespace
}  // namespace strata
