// The laws that hold without tolerance: what a closed mesh does to a ray, that nothing but the
// snapped triangles decides a bit, that the three axes agree, and that a set of voxels is its own
// voxelization. These tests must never be weakened.

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "strata/voxelize/checksum.h"
#include "tests/support/corpus.h"
#include "tests/support/predicate_intervals.h"
#include "tests/support/reference_lists.h"
#include "tests/support/trouble.h"
#include "tests/support/voxelized.h"

namespace strata {
namespace {

using namespace testkit;  // NOLINT: the tests' own vocabulary

const VoxelGrid kTroubleGrid = unit_grid({25, 24, 27});

LatticeMesh snapped(const TriangleSoup& mesh, const VoxelGrid& grid) {
  auto result = snap_to_lattice(mesh, grid);
  EXPECT_TRUE(result.has_value()) << result.error().message;
  return result ? std::move(*result) : LatticeMesh{};
}

/// Closed meshes with a grid each: the trouble, simple solids, and real ones.
struct Scene {
  std::string name;
  TriangleSoup mesh;
  VoxelGrid grid;
};

std::vector<Scene> closed_scenes() {
  std::vector<Scene> scenes;
  for (auto& [name, mesh] : closed_trouble()) {
    scenes.push_back({name, std::move(mesh), kTroubleGrid});
  }
  for (auto& [name, mesh] : simple_solids()) {
    VoxelGrid grid = grid_around(mesh, 40, 1);
    scenes.push_back({name, mesh, grid});
    // Voxels that are no cubes, and a grid that cuts the mesh.
    grid.voxel_size *= glm::dvec3(0.7, 1.3, 1.0);
    scenes.push_back({name + ", flat voxels", std::move(mesh), grid});
  }
  return scenes;
}

/// Real meshes that are closed once snapped to their grid, `longest` voxels along the longest side.
std::vector<Scene> closed_real_scenes(int longest, std::size_t max_triangles) {
  std::vector<Scene> scenes;
  for (auto& [name, mesh] : real_meshes(max_triangles)) {
    const glm::dvec3 extent = bounds(mesh).high - bounds(mesh).low;
    if (!(std::max({extent.x, extent.y, extent.z}) > 0)) continue;
    const VoxelGrid grid = grid_around(mesh, longest, 1);
    const auto lattice = snap_to_lattice(mesh, grid);
    if (!lattice || !is_closed(lattice->vertices, lattice->triangles)) continue;
    scenes.push_back({name, std::move(mesh), grid});
  }
  return scenes;
}

TEST(ClosedMesh, IsClosedInEverySceneOfTheseTests) {
  for (const Scene& scene : closed_scenes()) {
    EXPECT_TRUE(is_closed(scene.mesh)) << scene.name;
  }
}

// I1, I2
TEST(ClosedMesh, EveryRayEntersAsOftenAsItLeaves) {
  for (const Scene& scene : closed_scenes()) {
    SCOPED_TRACE(scene.name);
    const LatticeMesh lattice = snapped(scene.mesh, scene.grid);
    for (const Axis axis : kAllAxes) {
      const auto target = target_of(scene.grid, axis);
      const auto exact = reference_lists<DepthItem>(lattice, target);
      EXPECT_EQ(unbalanced_lists(exact), 0u);
      EXPECT_EQ(odd_lists(exact), 0u);
      EXPECT_EQ(built_lists<DepthItem>(lattice, target), exact);
    }
  }
}

TEST(ClosedMesh, EveryRayEntersAsOftenAsItLeavesInTheRealOnes) {
  const auto scenes = closed_real_scenes(100, 300'000);
  if (scenes.empty()) GTEST_SKIP() << kNoMeshes;
  for (const Scene& scene : scenes) {
    for (const Axis axis : kAllAxes) {
      VoxelizeReport report;
      voxelized(scene.mesh, scene.grid, {.axis = axis}, {}, &report);
      EXPECT_EQ(report.unbalanced_columns, 0u) << scene.name << ", axis " << static_cast<int>(axis);
    }
  }
}

// I5
TEST(SameBits, NeitherOrderNorThreadsNorStoreNorOffsetsChangeAnInterval) {
  std::mt19937_64 random(5);
  constexpr OffsetKind kOffsets[] = {OffsetKind::kRandom, OffsetKind::kFarthestPoint,
                                     OffsetKind::kPlaneFirst};
  auto scenes = closed_scenes();
  for (Scene& scene : scenes) {
    SCOPED_TRACE(scene.name);
    for (const Axis axis : kAllAxes) {
      const VoxelIntervals first = voxelized(scene.mesh, scene.grid, {.axis = axis});
      const std::uint64_t checksum = set_checksum(first);
      for (int threads = 1; threads <= 8; ++threads) {
        shuffle(scene.mesh, random);
        const VoxelizeOptions options{
            .axis = axis,
            .store = threads % 2 == 0 ? StoreKind::kHaBuffer : StoreKind::kCountScan,
            .offsets = kOffsets[threads % 3],
            .statistics = true};
        VoxelizeReport report;
        Execution execution;
        execution.threads = threads;
        const auto again = voxelized(scene.mesh, scene.grid, options, execution, &report);
        EXPECT_TRUE(same_intervals(first, again)) << threads << " threads";
        EXPECT_EQ(report.checksum, checksum) << threads << " threads";
        if (HasFailure()) return;
      }
    }
  }
}

TEST(SameBits, SlabsAreThePiecesOfTheWhole) {
  const TriangleSoup mesh = make_torus_knot(2, 3, 0.4, 200, 16);
  VoxelGrid grid = grid_around(mesh, 200, 3);
  for (const Axis axis : kAllAxes) {
    const VoxelIntervals whole = voxelized(mesh, grid, {.axis = axis});
    for (const Closedness closedness : kAllClosedness) {
      Execution execution;
      execution.memory_limit = 1 << 20;  // one tile row a slab
      int slabs = 0, next_row = 0;
      const auto done =
          voxelize_slabs(mesh, grid, {.axis = axis, .closedness = closedness}, execution,
                         [&](const VoxelIntervals& slab) -> Result<void> {
                           ++slabs;
                           EXPECT_EQ(slab.v_begin(), next_row);
                           next_row = slab.v_end();
                           for (int v = slab.v_begin(); v < slab.v_end(); ++v) {
                             for (int u = 0; u < slab.columns(); ++u) {
                               const auto a = slab.column(u, v), b = whole.column(u, v);
                               EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end()));
                             }
                           }
                           return {};
                         });
      ASSERT_TRUE(done.has_value()) << done.error().message;
      EXPECT_GT(slabs, 1);
      EXPECT_EQ(next_row, grid.dims[AxisFrame(axis).v]);
    }
  }
}

// I6. Zero differences. Never to be weakened.
TEST(ThreeAxes, GiveTheSameWindingNumberAtEveryVoxelCentre) {
  for (const Scene& scene : closed_scenes()) {
    SCOPED_TRACE(scene.name);
    const LatticeMesh lattice = snapped(scene.mesh, scene.grid);
    const Winding along_x = reference_winding(lattice, scene.grid, Axis::kX);
    EXPECT_EQ(along_x, reference_winding(lattice, scene.grid, Axis::kY));
    EXPECT_EQ(along_x, reference_winding(lattice, scene.grid, Axis::kZ));
    for (const Axis axis : kAllAxes) {
      const auto lists = built_lists<DepthItem>(lattice, target_of(scene.grid, axis));
      EXPECT_EQ(along_x, winding_of(lists, scene.grid, axis));
    }
    for (const InsideRule rule : kAllRules) {
      const VoxelSet expected = set_of(scene.grid.dims, [&](const glm::ivec3& p) {
        const int winding = along_x.at(p);
        if (rule == InsideRule::kWinding) return winding > 0;
        return rule == InsideRule::kNonzero ? winding != 0 : winding % 2 != 0;
      });
      for (const Axis axis : kAllAxes) {
        const auto found = voxelized(scene.mesh, scene.grid, {.rule = rule, .axis = axis});
        EXPECT_EQ(set_of(found), expected)
            << "rule " << static_cast<int>(rule) << ", axis " << static_cast<int>(axis) << ": "
            << differences(set_of(found), expected) << " voxels";
        EXPECT_EQ(set_checksum(found), set_checksum(intervals_from_predicate(
                                           scene.grid, Axis::kY, [&](int x, int y, int z) {
                                             return expected.at({x, y, z}) != 0;
                                           })));
      }
    }
    if (HasFailure()) return;
  }
}

TEST(ThreeAxes, AgreeOnThousandsOfRandomClosedSoups) {
  std::mt19937_64 random(66);
  for (int round = 0; round < 3000; ++round) {
    constexpr int kSteps[] = {256, 128, 64, 32, 7, 1};
    const int step = kSteps[random() % std::size(kSteps)];
    const int shift = random() % 2 == 0 ? 128 % step : 0;
    const VoxelGrid grid = unit_grid({5, 6, 4});
    const TriangleSoup mesh =
        round % 2 == 0
            ? random_tetrahedra(random, 1 + static_cast<int>(random() % 12), step, shift, 6 * 256)
            : random_bipyramid(random, 3 + static_cast<int>(random() % 8), step, 6 * 256);
    const LatticeMesh lattice = snapped(mesh, grid);
    const Winding along_x = reference_winding(lattice, grid, Axis::kX);
    ASSERT_EQ(along_x, reference_winding(lattice, grid, Axis::kY)) << "round " << round;
    ASSERT_EQ(along_x, reference_winding(lattice, grid, Axis::kZ)) << "round " << round;
    if (round % 10 == 0) {
      const auto expected = set_checksum(voxelized(mesh, grid, {.axis = Axis::kX}));
      ASSERT_EQ(expected, set_checksum(voxelized(mesh, grid, {.axis = Axis::kY})));
      ASSERT_EQ(expected, set_checksum(voxelized(mesh, grid, {.axis = Axis::kZ})));
    }
  }
}

TEST(ThreeAxes, AgreeOnRealMeshes) {
  for (const int longest : {64, 100}) {
    const auto scenes = closed_real_scenes(longest, 300'000);
    if (scenes.empty()) GTEST_SKIP() << kNoMeshes;
    std::uint64_t voxels = 0;
    for (const Scene& scene : scenes) {
      for (const InsideRule rule : {InsideRule::kWinding, InsideRule::kParity}) {
        std::set<std::uint64_t> checksums;
        for (const Axis axis : kAllAxes) {
          VoxelizeReport report;
          voxelized(scene.mesh, scene.grid, {.rule = rule, .axis = axis, .statistics = true}, {},
                    &report);
          checksums.insert(report.checksum);
          voxels += report.solid_voxels;
        }
        EXPECT_EQ(checksums.size(), 1u) << scene.name << " at " << longest;
      }
    }
    EXPECT_GT(voxels, 0u);
  }
}

// I16. Zero differences. Never to be weakened.
TEST(VoxelSetBoundary, VoxelizesToTheSetItself) {
  std::mt19937_64 random(16);
  for (int round = 0; round < 400; ++round) {
    glm::ivec3 dims;
    for (int i = 0; i < 3; ++i) dims[i] = 1 + static_cast<int>(random() % 12);
    if (round % 40 == 0) dims = {70, 3, 66};  // more than a tile
    VoxelGrid grid = unit_grid(dims);
    // Voxel sizes and origins that decimal numbers do not hold exactly: the snap must.
    if (round % 3 == 1) {
      grid.voxel_size = {0.1, 0.3, 7.7};
      grid.origin = {-123.4, 0.7, 1e6};
    }
    const unsigned sparse = 1 + static_cast<unsigned>(random() % 8);
    const VoxelSet set = set_of(dims, [&](const glm::ivec3&) {
      return random() % (sparse + 1) != 0 ? round % 2 == 0 : round % 2 == 1;
    });
    const TriangleSoup mesh = boundary_mesh(set, grid, random);
    ASSERT_TRUE(is_closed(mesh));
    for (const InsideRule rule : kAllRules) {
      for (const Axis axis : kAllAxes) {
        const auto store = round % 2 == 0 ? StoreKind::kHaBuffer : StoreKind::kCountScan;
        const auto found = voxelized(mesh, grid, {.rule = rule, .axis = axis, .store = store});
        ASSERT_EQ(set_of(found), set) << "round " << round << ", axis " << static_cast<int>(axis);
      }
    }
    const auto voted =
        voxelized(mesh, grid, {.open = OpenMode::kVote, .closedness = Closedness::kAssumeOpen});
    ASSERT_EQ(set_of(voted), set) << "round " << round << ", by vote";
  }
}

TEST(VoxelSetBoundary, VoxelizesToTheSetForThePatternsWithTheWorstEdges) {
  std::mt19937_64 random(17);
  const glm::ivec3 dims{67, 20, 21};
  const VoxelGrid grid = unit_grid(dims);
  const auto check = [&](const char* name, auto&& solid) {
    const VoxelSet set = set_of(dims, solid);
    const TriangleSoup mesh = boundary_mesh(set, grid, random);
    for (const Axis axis : kAllAxes) {
      VoxelizeReport report;
      const auto found = voxelized(mesh, grid, {.axis = axis, .statistics = true}, {}, &report);
      EXPECT_EQ(set_of(found), set) << name << ", axis " << static_cast<int>(axis);
      EXPECT_EQ(report.solid_voxels, static_cast<std::uint64_t>(count(set))) << name;
      EXPECT_EQ(report.unbalanced_columns, 0u) << name;
      EXPECT_EQ(report.negative_columns, 0u) << name;
    }
  };
  check("everything", [](const glm::ivec3&) { return true; });
  check("nothing", [](const glm::ivec3&) { return false; });
  check("checkerboard", [](const glm::ivec3& p) { return (p.x + p.y + p.z) % 2 == 0; });
  check("chains along edges", [](const glm::ivec3& p) { return p.x % 2 == p.y % 2; });
  check("corner to corner", [](const glm::ivec3& p) { return p.x == p.y && p.y == p.z; });
  check("shells", [](const glm::ivec3& p) {
    const glm::ivec3 d = glm::ivec3(33, 10, 10) - p;
    return std::max({std::abs(d.x) / 3, std::abs(d.y), std::abs(d.z)}) % 2 == 0;
  });
  check("every other column", [](const glm::ivec3& p) { return p.x % 2 == 0 && p.y % 2 == 1; });
  check("slanted plane", [](const glm::ivec3& p) { return p.x == 2 * p.y + p.z; });
}

// The same, through the real thing: a solid's voxels are a set whose boundary gives them back.
TEST(VoxelSetBoundary, OfAVoxelizedMeshGivesItsVoxelsBack) {
  std::mt19937_64 random(18);
  for (const auto& [name, mesh] : simple_solids()) {
    const VoxelGrid grid = grid_around(mesh, 48);
    const VoxelIntervals voxels = voxelized(mesh, grid);
    const TriangleSoup skin = boundary_mesh(set_of(voxels), grid, random);
    for (const Axis axis : kAllAxes) {
      EXPECT_EQ(set_checksum(voxelized(skin, grid, {.axis = axis})), set_checksum(voxels)) << name;
    }
  }
}

}  // namespace
}  // namespace strata
