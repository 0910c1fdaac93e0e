// The surface voxels of Boolean trees.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "csg/column_surface.h"
#include "strata/csg/solid_lists.h"
#include "strata/voxelize/voxelize.h"
#include "tests/csg/random_tree.h"
#include "voxelize/shell_voxels.h"

namespace strata::csg {
namespace {

constexpr int kSide = 28;
const VoxelGrid kGrid{glm::ivec3(kSide), glm::dvec3(-10.5), glm::dvec3(0.75)};

/// A set of voxels of the grid, by x + kSide (y + kSide z).
using Set = std::set<int>;

Set set_of(const VoxelIntervals& voxels) {
  const AxisFrame frame(voxels.axis());
  Set set;
  for (int v = voxels.v_begin(); v < voxels.v_end(); ++v) {
    for (int u = 0; u < voxels.columns(); ++u) {
      for (const Interval run : voxels.column(u, v)) {
        glm::ivec3 p(0);
        p[frame.u] = u, p[frame.v] = v;
        for (p[frame.w] = run.begin(); p[frame.w] < run.end(); ++p[frame.w]) {
          set.insert(p.x + kSide * (p.y + kSide * p.z));
        }
      }
    }
  }
  return set;
}

Set surface_of(const Tree& tree, Axis axis = Axis::kZ,
               SurfaceKind kind = SurfaceKind::kConservative, bool solid = false) {
  const SolidLists lists(tree, tree.root());
  const VoxelizeOptions options{.axis = axis,
                                .solid = solid,
                                .surface = true,
                                .surface_kind = kind,
                                .filter = &lists.filter()};
  const auto found = voxelize(lists.soup(), kGrid, options);
  EXPECT_TRUE(found.has_value()) << found.error().message;
  return set_of(*found);
}

Tree::NodeId add_box(Tree& tree, const glm::dvec3& low, const glm::dvec3& high) {
  return tree.add_solid({std::make_shared<TriangleSoup>(make_box(low, high))});
}

/// The voxels that hold a point of the grid's box [low, high], which has no faces on boundaries.
Set voxels_within(const glm::dvec3& low, const glm::dvec3& high) {
  Set set;
  for (int n = 0; n < kSide * kSide * kSide; ++n) {
    const glm::ivec3 p(n % kSide, n / kSide % kSide, n / (kSide * kSide));
    const glm::dvec3 from = kGrid.origin + glm::dvec3(p) * kGrid.voxel_size;
    bool meets = true;
    for (int i = 0; i < 3; ++i) meets = meets && from[i] < high[i] && from[i] + 0.75 > low[i];
    if (meets) set.insert(n);
  }
  return set;
}

TEST(TreeSurface, OfOneMeshIsTheMeshsOwn) {
  for (const SurfaceKind kind : {SurfaceKind::kConservative, SurfaceKind::k26, SurfaceKind::k6}) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      RandomTree random(seed + 40);
      Tree tree;
      tree.set_root(tree.add_solid(random.solid(seed % 2 == 0)));
      const SolidLists lists(tree, tree.root());
      for (const bool solid : {false, true}) {
        const auto own =
            voxelize(lists.soup(), kGrid, {.solid = solid, .surface = true, .surface_kind = kind});
        ASSERT_TRUE(own.has_value());
        for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
          EXPECT_EQ(surface_of(tree, axis, kind, solid), set_of(*own)) << "seed " << seed;
        }
      }
    }
  }
}

TEST(TreeSurface, OfAUnionHidesTheFacesWithin) {
  Tree tree;
  const auto a = add_box(tree, {-6.1, -5.2, -5.3}, {1.2, 5.2, 5.3});
  const auto b = add_box(tree, {-2.1, -3.2, -3.3}, {6.2, 3.2, 3.3});
  tree.set_root(tree.add(Operation::kUnion, {a, b}));
  const Set surface = surface_of(tree);
  // The end of b lies deep in a; so does the middle of a's side in b.
  for (const int n : voxels_within({-4, -4, -4}, {0, 4, 4})) EXPECT_FALSE(surface.contains(n));
  for (const int n : voxels_within({0.7, -2, -2}, {1.6, 2, 2})) EXPECT_FALSE(surface.contains(n));
  for (const int n : voxels_within({1.1, 4, -5}, {1.3, 5, 5})) EXPECT_TRUE(surface.contains(n));
  for (const int n : voxels_within({6.1, -3, -3}, {6.3, 3, 3})) EXPECT_TRUE(surface.contains(n));
}

TEST(TreeSurface, OfADifferenceShowsTheInsideWallOfWhatWasTakenAway) {
  Tree tree;
  const auto block = add_box(tree, {-6.1, -6.2, -6.3}, {6.1, 6.2, 6.3});
  const auto hole = add_box(tree, {-3.1, -3.2, -9.3}, {3.1, 3.2, 9.4});
  tree.set_root(tree.add(Operation::kDifference, {block, hole}));
  const Set surface = surface_of(tree);
  for (const int n : voxels_within({3.0, -2, -5}, {3.2, 2, 5})) EXPECT_TRUE(surface.contains(n));
  // The caps of the hole lie outside of the block, and the block's lid is gone above the hole.
  for (const int n : voxels_within({-9, -9, 7.5}, {9, 9, 10})) EXPECT_FALSE(surface.contains(n));
  for (const int n : voxels_within({-2, -2, 6}, {2, 2, 6.5})) EXPECT_FALSE(surface.contains(n));
}

TEST(TreeSurface, KeepsAWallThinnerThanAVoxel) {
  Tree tree;
  const auto block = add_box(tree, {-5.1, -5.2, -5.3}, {5.2, 5.2, 5.3});
  const auto inner = add_box(tree, {-5.05, -5.15, -5.27}, {5.15, 5.15, 5.27});
  tree.set_root(tree.add(Operation::kDifference, {block, inner}));
  const SolidLists lists(tree, tree.root());
  const auto solid = voxelize(lists.soup(), kGrid, {.filter = &lists.filter()});
  EXPECT_EQ(solid->solid_voxels(), 0u);  // between the centres
  Tree alone;
  alone.set_root(add_box(alone, {-5.1, -5.2, -5.3}, {5.2, 5.2, 5.3}));
  EXPECT_EQ(surface_of(tree), surface_of(alone));
}

/// What the definition says, with a set for each solid and all values of those unknown tried.
Set brute_force(const Tree& tree) {
  std::vector<Set> faces, inside;
  for (const Solid& solid : tree.solids()) {
    Tree alone;
    alone.set_root(alone.add_solid(solid));
    const SolidLists lists(alone, alone.root());
    const auto snapped = snap_to_lattice(lists.soup(), kGrid);
    faces.push_back(set_of(
        voxelize_shell(*snapped, kGrid, SurfaceKind::kConservative, Axis::kZ, 0, kSide).value()));
    inside.push_back(set_of(voxelize(lists.soup(), kGrid).value()));
  }
  Set result;
  for (int n = 0; n < kSide * kSide * kSide; ++n) {
    std::vector<std::uint32_t> unknown;
    for (std::uint32_t s = 0; s < faces.size(); ++s) {
      if (faces[s].contains(n)) unknown.push_back(s);
    }
    bool any = false, all = true;
    for (std::uint32_t bits = 0; bits < 1u << unknown.size(); ++bits) {
      const bool value = evaluate(tree, tree.root(), [&](std::uint32_t solid) {
        const auto at = std::find(unknown.begin(), unknown.end(), solid);
        if (at == unknown.end()) return inside[solid].contains(n);
        return (bits >> (at - unknown.begin()) & 1) != 0;
      });
      any = any || value;
      all = all && value;
    }
    if (any && !all) result.insert(n);
  }
  return result;
}

TEST(TreeSurface, OfRandomTreesIsWhatTheDefinitionSays) {
  std::size_t voxels = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    RandomTree random(seed + 70);
    Tree tree;
    tree.set_root(random.grow(tree, random.pick(2, 8), seed % 2 == 0));
    const Set expected = brute_force(tree);
    voxels += expected.size();
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      EXPECT_EQ(surface_of(tree, axis), expected) << "seed " << seed;
    }
  }
  EXPECT_GT(voxels, 10'000u);
}

TEST(TreeSurface, DoesNotDependOnSlabsOrThreads) {
  RandomTree random(5);
  Tree tree;
  tree.set_root(random.grow(tree, 8, false));
  const SolidLists lists(tree, tree.root());
  const VoxelGrid grid{glm::ivec3(200), glm::dvec3(-10), glm::dvec3(0.1)};
  const VoxelizeOptions options{.surface = true, .statistics = true, .filter = &lists.filter()};
  VoxelizeReport whole;
  ASSERT_TRUE(voxelize(lists.soup(), grid, options, {.threads = 1}, &whole).has_value());
  int slabs = 0;
  const auto sink = [&](const VoxelIntervals&) -> Result<void> {
    ++slabs;
    return {};
  };
  const Execution little{.threads = 3, .memory_limit = 3 << 20};
  const auto cut = voxelize_slabs(lists.soup(), grid, options, little, sink);
  ASSERT_TRUE(cut.has_value()) << cut.error().message;
  EXPECT_GT(slabs, 1);
  EXPECT_EQ(cut->checksum, whole.checksum);
  EXPECT_EQ(cut->solid_voxels, whole.solid_voxels);
}

TEST(TreeSurface, HasNoLabels) {
  Tree tree;
  tree.set_root(add_box(tree, glm::dvec3(-1), glm::dvec3(1)));
  SolidLists lists(tree, tree.root());
  lists.set_labels(id_labels(tree));
  const auto refused = voxelize(lists.soup(), kGrid, {.surface = true, .filter = &lists.filter()});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
}

TEST(TernaryState, IsUnknownExactlyWhereTheTreeDependsOnTheUnknown) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    RandomTree random(seed);
    Tree tree;
    const int solids = random.pick(1, 9);
    tree.set_root(random.grow(tree, solids, true));
    const Program program = compile(tree, tree.root());
    TernaryState state(program);
    std::vector<bool> inside(tree.solids().size()), unknown(inside.size());
    for (int step = 0; step < 60; ++step) {
      const auto solid = static_cast<std::uint32_t>(random.pick(0, solids - 1));
      if (random.pick(0, 1) == 0) {
        inside[solid] = !inside[solid];
        state.set_inside(solid, inside[solid]);
      } else {
        unknown[solid] = !unknown[solid];
        state.set_unknown(solid, unknown[solid]);
      }
      bool any = false, all = true;
      for (std::uint32_t bits = 0; bits < 1u << solids; ++bits) {
        const bool value = evaluate(tree, tree.root(), [&](std::uint32_t s) {
          return unknown[s] ? (bits >> s & 1) != 0 : inside[s];
        });
        any = any || value;
        all = all && value;
      }
      ASSERT_EQ(state.unknown(), any && !all) << "seed " << seed << " step " << step;
    }
  }
}

}  // namespace
}  // namespace strata::csg
