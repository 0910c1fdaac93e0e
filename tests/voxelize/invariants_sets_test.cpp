// What must come out when meshes are turned around, moved, joined, nested, refined or opened:
// metamorphic laws, all without tolerance.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "strata/voxelize/checksum.h"
#include "tests/support/reference_lists.h"
#include "tests/support/simd_targets.h"
#include "tests/support/trouble.h"
#include "tests/support/voxelized.h"

namespace strata {
namespace {

using namespace testkit;  // NOLINT: the tests' own vocabulary

const VoxelGrid kTroubleGrid = unit_grid({25, 24, 27});

TriangleSoup joined(const TriangleSoup& a, const TriangleSoup& b) {
  TriangleSoup both = a;
  append(both, b);
  return both;
}

TriangleSoup reversed(const TriangleSoup& mesh) {
  TriangleSoup result = mesh;
  reverse_orientation(result);
  return result;
}

TriangleSoup ball(const glm::dvec3& centre, double radius) {
  TriangleSoup mesh = make_icosphere(radius, 3);
  for (auto& p : mesh.positions) p += centre;
  return mesh;
}

struct Scene {
  std::string name;
  TriangleSoup mesh;
  VoxelGrid grid;
};

/// The trouble on its grid, and simple solids of `longest` voxels.
std::vector<Scene> scenes_at(int longest) {
  std::vector<Scene> scenes;
  for (auto& [name, mesh] : closed_trouble()) {
    scenes.push_back({name, std::move(mesh), kTroubleGrid});
  }
  for (auto& [name, mesh] : simple_solids()) {
    const VoxelGrid grid = grid_around(mesh, longest, 1);
    scenes.push_back({name, std::move(mesh), grid});
  }
  return scenes;
}

/// Voxel by voxel: keep(in_a, in_b).
template <class Keep>
VoxelSet combined(const VoxelSet& a, const VoxelSet& b, Keep&& keep) {
  return set_of(a.dims(), [&](const glm::ivec3& p) { return keep(a.at(p) != 0, b.at(p) != 0); });
}

// I3
TEST(OutwardSolid, IsEnteredBeforeItIsLeft) {
  for (const auto& [name, mesh] : simple_solids()) {
    for (const int longest : {7, 40, 97}) {
      const VoxelGrid grid = grid_around(mesh, longest, 1);
      for (const Axis axis : kAllAxes) {
        VoxelizeReport report;
        voxelized(mesh, grid, {.axis = axis}, {}, &report);
        EXPECT_EQ(report.negative_columns, 0u) << name << " at " << longest;
        EXPECT_EQ(report.unbalanced_columns, 0u) << name << " at " << longest;
      }
    }
  }
}

// I7
TEST(TurnedAround, MeshNegatesEveryWindingNumber) {
  for (const auto& [name, mesh] : closed_trouble()) {
    SCOPED_TRACE(name);
    const TriangleSoup back = reversed(mesh);
    const auto lattice = snap_to_lattice(mesh, kTroubleGrid);
    const auto back_lattice = snap_to_lattice(back, kTroubleGrid);
    for (const Axis axis : kAllAxes) {
      const auto target = target_of(kTroubleGrid, axis);
      const auto lists = built_lists<DepthItem>(*lattice, target);
      auto back_lists = built_lists<DepthItem>(*back_lattice, target);
      EXPECT_EQ(lists.offsets, back_lists.offsets);
      // The same crossings with entries and exits exchanged.
      for (auto& item : back_lists.keys) {
        item = DepthItem(item.depth(), !item.exit(), item.triangle());
      }
      for (std::size_t pixel = 0; pixel + 1 < back_lists.offsets.size(); ++pixel) {
        std::sort(
            back_lists.keys.begin() + static_cast<std::ptrdiff_t>(back_lists.offsets[pixel]),
            back_lists.keys.begin() + static_cast<std::ptrdiff_t>(back_lists.offsets[pixel + 1]));
      }
      EXPECT_EQ(lists, back_lists);
      for (const InsideRule rule : {InsideRule::kParity, InsideRule::kNonzero}) {
        EXPECT_EQ(voxel_set(mesh, kTroubleGrid, {.rule = rule, .axis = axis}),
                  voxel_set(back, kTroubleGrid, {.rule = rule, .axis = axis}));
      }
      const VoxelSet positive = voxel_set(mesh, kTroubleGrid, {.axis = axis});
      const VoxelSet negative = voxel_set(back, kTroubleGrid, {.axis = axis});
      const VoxelSet any = voxel_set(mesh, kTroubleGrid, {.rule = InsideRule::kNonzero});
      EXPECT_EQ(combined(positive, negative, [](bool p, bool n) { return p || n; }), any);
      EXPECT_EQ(count(combined(positive, negative, [](bool p, bool n) { return p && n; })), 0);
    }
  }
}

// I8
TEST(MovedByWholeVoxels, MeshGivesTheShiftedSet) {
  const glm::ivec3 shift{3, 5, 2};
  VoxelGrid larger = kTroubleGrid;
  larger.dims += glm::ivec3(8);
  for (const auto& [name, mesh] : closed_trouble()) {
    TriangleSoup moved = mesh;
    for (auto& p : moved.positions) p += glm::dvec3(shift);
    for (const Axis axis : kAllAxes) {
      const VoxelSet before = voxel_set(mesh, kTroubleGrid, {.axis = axis});
      const VoxelSet after = voxel_set(moved, larger, {.axis = axis});
      const VoxelSet cut =
          set_of(kTroubleGrid.dims, [&](const glm::ivec3& p) { return after.at(p + shift) != 0; });
      EXPECT_EQ(cut, before) << name;
      // The grid's origin moved with the mesh changes nothing at all.
      VoxelGrid along = kTroubleGrid;
      along.origin = glm::dvec3(shift);
      EXPECT_EQ(voxel_set(moved, along, {.axis = axis}), before) << name;
    }
  }
}

TEST(ScaledByPowersOfTwo, MeshAndGridGiveTheSameSet) {
  for (const auto& [name, mesh] : closed_trouble()) {
    const VoxelSet before = voxel_set(mesh, kTroubleGrid);
    for (const int power : {-30, -1, 4, 100}) {
      const double factor = std::ldexp(1.0, power);
      TriangleSoup scaled = mesh;
      for (auto& p : scaled.positions) p *= factor;
      VoxelGrid grid = kTroubleGrid;
      grid.voxel_size *= factor;
      EXPECT_EQ(voxel_set(scaled, grid, {.axis = Axis::kY}), before) << name << ", 2^" << power;
    }
    // Each axis by its own factor: voxels need not be cubes.
    TriangleSoup stretched = mesh;
    for (auto& p : stretched.positions) p *= glm::dvec3(0.25, 8, 2);
    VoxelGrid grid = kTroubleGrid;
    grid.voxel_size = {0.25, 8, 2};
    EXPECT_EQ(voxel_set(stretched, grid, {.axis = Axis::kX}), before) << name;
  }
}

/// True when the lattice point lies on a triangle of the mesh.
bool on_surface(const LatticeMesh& mesh, const glm::ivec3& point) {
  using Wide = glm::vec<3, std::int64_t>;
  const auto cross = [](const Wide& a, const Wide& b) {
    return Wide(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  };
  const auto dot = [](const Wide& a, const Wide& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
  for (const auto& t : mesh.triangles) {
    const Wide p(point), a(mesh.vertices[t.x]), b(mesh.vertices[t.y]), c(mesh.vertices[t.z]);
    const Wide n = cross(b - a, c - a);
    if (dot(n, p - a) != 0) continue;
    if (dot(n, cross(b - a, p - a)) >= 0 && dot(n, cross(c - b, p - b)) >= 0 &&
        dot(n, cross(a - c, p - c)) >= 0) {
      return true;
    }
  }
  return false;
}

// I9
TEST(PermutedAxes, ChangeOnlyVoxelCentresOnTheSurface) {
  const auto turned = [](const glm::dvec3& p) { return glm::dvec3(p.y, p.z, p.x); };
  int touched = 0;
  for (const auto& [name, mesh] : closed_trouble()) {
    if (name == "huge tetrahedra") continue;  // on_surface() would overflow
    SCOPED_TRACE(name);
    TriangleSoup other = mesh;
    for (auto& p : other.positions) p = turned(p);
    const VoxelGrid grid = unit_grid({24, 27, 25});
    const VoxelSet before = voxel_set(mesh, kTroubleGrid, {.rule = InsideRule::kNonzero});
    const VoxelSet after = voxel_set(other, grid, {.rule = InsideRule::kNonzero});
    const auto lattice = snap_to_lattice(mesh, kTroubleGrid);
    before.for_each([&](const glm::ivec3& p) {
      if (before.at(p) == after.at({p.y, p.z, p.x})) return;
      ++touched;
      EXPECT_TRUE(on_surface(*lattice, p * 256 + 128)) << p.x << ", " << p.y << ", " << p.z;
    });
  }
  EXPECT_GT(touched, 0) << "no centre lies on a surface: nothing was tested";
}

TEST(Mirrored, MeshChangesOnlyVoxelCentresOnTheSurface) {
  for (const auto& [name, mesh] : closed_trouble()) {
    if (name == "huge tetrahedra") continue;
    for (int axis = 0; axis < 3; ++axis) {
      SCOPED_TRACE(name);
      TriangleSoup other = reversed(mesh);
      const int side = kTroubleGrid.dims[axis];
      for (auto& p : other.positions) p[axis] = side - p[axis];
      const VoxelSet before = voxel_set(mesh, kTroubleGrid);
      const VoxelSet after = voxel_set(other, kTroubleGrid);
      const auto lattice = snap_to_lattice(mesh, kTroubleGrid);
      before.for_each([&](const glm::ivec3& p) {
        glm::ivec3 q = p;
        q[axis] = side - 1 - p[axis];
        if (before.at(p) != after.at(q)) {
          EXPECT_TRUE(on_surface(*lattice, p * 256 + 128)) << p.x << ", " << p.y << ", " << p.z;
        }
      });
    }
  }
}

// I11
TEST(SetAlgebra, OfAMeshWithItselfAndWithNothing) {
  const TriangleSoup nothing;
  EXPECT_EQ(count(voxel_set(nothing, kTroubleGrid)), 0);
  for (const auto& [name, mesh] : closed_trouble()) {
    SCOPED_TRACE(name);
    {
      const Axis axis = kAllAxes[name.size() % 3];
      const auto set = [&](const TriangleSoup& soup, InsideRule rule) {
        return voxel_set(soup, kTroubleGrid, {.rule = rule, .axis = axis});
      };
      const VoxelSet a = set(mesh, InsideRule::kWinding);
      EXPECT_EQ(set(joined(mesh, mesh), InsideRule::kWinding), a);
      EXPECT_EQ(set(joined(mesh, nothing), InsideRule::kWinding), a);
      EXPECT_EQ(set(joined(nothing, mesh), InsideRule::kWinding), a);
      EXPECT_EQ(count(set(joined(mesh, mesh), InsideRule::kParity)), 0);
      for (const InsideRule rule : kAllRules) {
        EXPECT_EQ(count(set(joined(mesh, reversed(mesh)), rule)), 0);
        EXPECT_EQ(count(set(joined(reversed(mesh), mesh), rule)), 0);
      }
    }
  }
}

TEST(SetAlgebra, JoinedSolidsAreUnionDifferenceAndSymmetricDifference) {
  // Solids whose faces coincide, touch and cross; winding numbers of each are 0 or 1.
  const std::vector<TriangleSoup> solids = {make_box({4, 4, 4}, {14, 14, 14}),
                                            make_box({4, 4, 4}, {14, 14, 20}),
                                            make_box({14, 4, 4}, {20, 14, 14}),
                                            make_box({9.5, 9.5, 9.5}, {17.5, 17.5, 17.5}),
                                            ball({12, 12, 12}, 8),
                                            ball({15.5, 12.25, 11}, 6.1),
                                            make_box({-3, 6.7, 8.1}, {30, 9.3, 11.9})};
  for (const TriangleSoup& a : solids) {
    for (const TriangleSoup& b : solids) {
      const VoxelSet in_a = voxel_set(a, kTroubleGrid), in_b = voxel_set(b, kTroubleGrid);
      for (const Axis axis : kAllAxes) {
        EXPECT_EQ(voxel_set(joined(a, b), kTroubleGrid, {.axis = axis}),
                  combined(in_a, in_b, [](bool p, bool q) { return p || q; }));
        EXPECT_EQ(voxel_set(joined(a, reversed(b)), kTroubleGrid, {.axis = axis}),
                  combined(in_a, in_b, [](bool p, bool q) { return p && !q; }));
        EXPECT_EQ(
            voxel_set(joined(a, b), kTroubleGrid, {.rule = InsideRule::kParity, .axis = axis}),
            combined(in_a, in_b, [](bool p, bool q) { return p != q; }));
        EXPECT_EQ(voxel_set(joined(a, reversed(b)), kTroubleGrid,
                            {.rule = InsideRule::kNonzero, .axis = axis}),
                  combined(in_a, in_b, [](bool p, bool q) { return p != q; }));
      }
    }
  }
}

// I15
TEST(Monotone, SmallerSolidsHaveFewerVoxels) {
  for (const auto& [name, mesh] : simple_solids()) {
    if (name.find("knot") != std::string::npos || name.find("torus") != std::string::npos) {
      continue;  // scaled about its centre, a ring does not hold its smaller self
    }
    const Bounds box = bounds(mesh);
    const glm::dvec3 middle = (box.low + box.high) * 0.5;
    TriangleSoup smaller = mesh;
    for (auto& p : smaller.positions) p = middle + (p - middle) * 0.9;
    const VoxelGrid grid = grid_around(mesh, 50, 1);
    EXPECT_TRUE(includes(voxel_set(mesh, grid), voxel_set(smaller, grid))) << name;
  }
}

TEST(Monotone, SolidAndSurfaceNestAsTheyShould) {
  for (const Scene& scene : scenes_at(40)) {
    if (scene.name == "huge tetrahedra") continue;  // its surface is most of the grid, many times
    SCOPED_TRACE(scene.name);
    const TriangleSoup& mesh = scene.mesh;
    const VoxelGrid& grid = scene.grid;
    const VoxelSet solid = voxel_set(mesh, grid);
    const auto skin = [&](SurfaceKind kind) {
      return voxel_set(mesh, grid, {.solid = false, .surface = true, .surface_kind = kind});
    };
    const VoxelSet thin = skin(SurfaceKind::k6), thick = skin(SurfaceKind::k26),
                   all = skin(SurfaceKind::kConservative);
    EXPECT_TRUE(includes(thick, thin));
    EXPECT_TRUE(includes(all, thick));
    const VoxelSet both = voxel_set(mesh, grid, {.surface = true});
    EXPECT_EQ(both, combined(solid, all, [](bool p, bool q) { return p || q; }));
    // Between neighbours of which one is solid there is surface, in one of the two.
    std::int64_t leaks = 0;
    solid.for_each([&](const glm::ivec3& p) {
      for (int axis = 0; axis < 3; ++axis) {
        glm::ivec3 q = p;
        ++q[axis];
        if (!solid.contains(q) || solid.at(p) == solid.at(q)) continue;
        leaks += thin.at(p) == 0 && thin.at(q) == 0;
      }
    });
    EXPECT_EQ(leaks, 0);
  }
}

// I17
TEST(ThreeTimesFinerGrid, HasTheCoarseVoxelsAtItsMiddleChildren) {
  std::mt19937_64 random(17);
  for (int round = 0; round < 40; ++round) {
    constexpr int kSteps[] = {1, 64, 128, 256};
    const int step = kSteps[round % 4];
    TriangleSoup mesh = random_tetrahedra(random, 10, step, step == 1 ? 0 : 128 % step, 9 * 256);
    // Coarse lattice steps are three fine ones: both grids snap to themselves.
    for (auto& p : mesh.positions) p *= 3.0;
    VoxelGrid coarse = unit_grid({9, 8, 10});
    coarse.voxel_size = glm::dvec3(3);
    const VoxelGrid fine = unit_grid(coarse.dims * 3);
    for (const Axis axis : kAllAxes) {
      const VoxelSet parents = voxel_set(mesh, coarse, {.axis = axis});
      const VoxelSet children = voxel_set(mesh, fine, {.axis = axis});
      EXPECT_EQ(
          set_of(coarse.dims, [&](const glm::ivec3& p) { return children.at(p * 3 + 1) != 0; }),
          parents)
          << "round " << round;
    }
  }
}

// I25
TEST(ClosingCap, ChangesOnlyTheColumnsUnderIt) {
  std::mt19937_64 random(25);
  for (const auto& [name, closed] : simple_solids()) {
    SCOPED_TRACE(name);
    const VoxelGrid grid = grid_around(closed, 50, 1);
    // A random share of the triangles is the cap.
    TriangleSoup open = closed, cap = closed;
    open.triangles.clear(), cap.triangles.clear();
    for (const auto& t : closed.triangles) {
      (random() % 9 == 0 ? cap : open).triangles.push_back(t);
    }
    VoxelArray<std::uint8_t> untouched(grid.dims);  // a bit for each axis without cap
    for (const Axis axis : kAllAxes) {
      const AxisFrame frame(axis);
      const auto target = target_of(grid, axis);
      const auto lattice = snap_to_lattice(cap, grid);
      const auto crossed = reference_lists<DepthKey>(*lattice, target);
      const VoxelSet before =
          voxel_set(open, grid, {.axis = axis, .closedness = Closedness::kAssumeClosed});
      const VoxelSet after = voxel_set(closed, grid, {.axis = axis});
      std::int64_t changed = 0;
      before.for_each([&](const glm::ivec3& p) {
        const auto pixel = static_cast<std::size_t>(p[frame.v] * target.width + p[frame.u]);
        if (!crossed.list(pixel).empty()) return;
        untouched.at(p) = static_cast<std::uint8_t>(untouched.at(p) | 1 << frame.w);
        changed += before.at(p) != after.at(p);
      });
      EXPECT_EQ(changed, 0);
    }
    // Where two columns know, the vote is right, too, but in dents of holes that are not flat.
    const VoxelSet voted =
        voxel_set(open, grid, {.open = OpenMode::kVote, .closedness = Closedness::kAssumeOpen});
    const VoxelSet whole = voxel_set(closed, grid);
    std::int64_t wrong = 0, decided = 0;
    voted.for_each([&](const glm::ivec3& p) {
      const int known = untouched.at(p);
      if (known != 3 && known != 5 && known != 6 && known != 7) return;
      ++decided;
      wrong += voted.at(p) != whole.at(p);
    });
    EXPECT_LE(wrong, decided / 1000);
    EXPECT_GT(decided, 1000);
  }
}

// I26
TEST(NestedShells, FollowTheInsideRule) {
  const VoxelGrid grid = unit_grid({24, 24, 24});
  const glm::dvec3 middle(12);
  const TriangleSoup outer = ball(middle, 10), inner = ball(middle, 6), core = ball(middle, 3);
  const VoxelSet in_outer = voxel_set(outer, grid), in_inner = voxel_set(inner, grid),
                 in_core = voxel_set(core, grid);
  const VoxelSet shell = combined(in_outer, in_inner, [](bool o, bool i) { return o && !i; });
  for (const Axis axis : kAllAxes) {
    const auto set = [&](const TriangleSoup& mesh, InsideRule rule) {
      return voxel_set(mesh, grid, {.rule = rule, .axis = axis});
    };
    const TriangleSoup twice = joined(outer, inner), cavity = joined(outer, reversed(inner));
    EXPECT_EQ(set(twice, InsideRule::kWinding), in_outer);  // winding 2 inside
    EXPECT_EQ(set(twice, InsideRule::kNonzero), in_outer);
    EXPECT_EQ(set(twice, InsideRule::kParity), shell);
    for (const InsideRule rule : kAllRules) EXPECT_EQ(set(cavity, rule), shell);
    // A core within the cavity is solid again.
    const VoxelSet with_core = combined(shell, in_core, [](bool s, bool c) { return s || c; });
    for (const InsideRule rule : kAllRules) {
      EXPECT_EQ(set(joined(cavity, core), rule), with_core);
    }
    // An outward shell in an inward one: winding -1 outside the inner, 0 inside it.
    const TriangleSoup inside_out = joined(reversed(outer), inner);
    EXPECT_EQ(count(set(inside_out, InsideRule::kWinding)), 0);
    EXPECT_EQ(set(inside_out, InsideRule::kNonzero), shell);
    EXPECT_EQ(set(inside_out, InsideRule::kParity), shell);
    // Both inward: nothing is inside but by the other rules.
    const TriangleSoup both_inward = reversed(twice);
    EXPECT_EQ(count(set(both_inward, InsideRule::kWinding)), 0);
    EXPECT_EQ(set(both_inward, InsideRule::kNonzero), in_outer);
  }
}

// I5, the part of it that is the processor's
TEST(SameBits, OnEverySimdTarget) {
  Execution one_thread;
  one_thread.threads = 1;
  for (const Scene& scene : scenes_at(130)) {
    for (const InsideRule rule : kAllRules) {
      const Axis axis = kAllAxes[scene.name.size() % 3];
      // The count/scan store's lists are walked plainly, one column at a time.
      VoxelizeReport plain;
      const auto expected = voxelized(
          scene.mesh, scene.grid,
          {.rule = rule, .axis = axis, .store = StoreKind::kCountScan, .statistics = true},
          one_thread, &plain);
      for_each_simd_target([&](const std::string& target) {
        SCOPED_TRACE(scene.name + ", " + target + ", rule " +
                     std::to_string(static_cast<int>(rule)));
        VoxelizeReport report;
        const auto found = voxelized(
            scene.mesh, scene.grid,
            {.rule = rule, .axis = axis, .store = StoreKind::kHaBuffer, .statistics = true},
            one_thread, &report);
        EXPECT_TRUE(same_intervals(found, expected));
        EXPECT_EQ(report.solid_voxels, plain.solid_voxels);
        EXPECT_EQ(report.intervals, plain.intervals);
        EXPECT_EQ(report.crossings, plain.crossings);
        EXPECT_EQ(report.max_depth_complexity, plain.max_depth_complexity);
        EXPECT_EQ(report.depth_histogram, plain.depth_histogram);
        EXPECT_EQ(report.unbalanced_columns, plain.unbalanced_columns);
        EXPECT_EQ(report.negative_columns, plain.negative_columns);
        EXPECT_EQ(report.checksum, plain.checksum);
      });
      if (HasFailure()) return;
    }
  }
}

}  // namespace
}  // namespace strata
