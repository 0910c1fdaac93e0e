#include "strata/csg/solid_lists.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

#include "csg/geometry.h"
#include "strata/hashbuffer/build_ldi.h"
#include "strata/mesh/shapes.h"
#include "strata/voxelize/voxelize.h"
#include "tests/csg/random_tree.h"
#include "tests/support/predicate_intervals.h"

namespace strata::csg {
namespace {

const VoxelGrid kGrid{glm::ivec3(28), glm::dvec3(-10.5), glm::dvec3(0.75)};

/// The depths where rays enter and leave a set, pixel by pixel: its canonical form.
using Lists = std::vector<std::vector<std::uint32_t>>;

Lists lists_of(const Tree& tree, Tree::NodeId node, Axis axis = Axis::kZ) {
  const SolidLists solids(tree, node);
  const auto snapped = snap_to_lattice(solids.soup(), kGrid);
  EXPECT_TRUE(snapped.has_value());
  const auto image = build_ldi(*snapped, raster_target(kGrid, axis), {}, {}, &solids.filter());
  EXPECT_TRUE(image.has_value());
  Lists lists;
  for (int v = 0; v < image->height; ++v) {
    for (int u = 0; u < image->width; ++u) {
      lists.emplace_back();
      bool inside = false;
      for (const DepthItem item : image->list(u, v)) {
        EXPECT_EQ(item.exit(), inside);  // entries and exits alternate
        inside = !inside;
        EXPECT_TRUE(lists.back().empty() || lists.back().back() < item.depth());
        lists.back().push_back(item.depth());
      }
      EXPECT_FALSE(inside);
    }
  }
  return lists;
}

std::uint64_t length(const Lists& lists) {
  std::uint64_t sum = 0;
  for (const auto& list : lists) {
    for (std::size_t i = 0; i + 1 < list.size(); i += 2) sum += list[i + 1] - list[i];
  }
  return sum;
}

/// Two sets and a tree that can be built over them any number of times: operands are copied.
class Pair {
 public:
  Pair(std::uint64_t seed, int solids, bool on_grid) {
    RandomTree random(seed);
    a_root_ = random.grow(a_, solids, on_grid);
    b_root_ = random.grow(b_, solids, on_grid);
  }
  Tree::NodeId a(Tree& to) const { return to.append(a_, a_root_); }
  Tree::NodeId b(Tree& to) const { return to.append(b_, b_root_); }

 private:
  Tree a_, b_;
  Tree::NodeId a_root_, b_root_;
};

/// Lists of an expression: build(tree) adds its nodes.
template <class Build>
Lists lists_of(const Build& build) {
  Tree tree;
  const Tree::NodeId root = build(tree);
  return lists_of(tree, root);
}

// I11 to I14, in integers.
TEST(SetAlgebra, HoldsOnTheListsOfRandomTrees) {
  for (std::uint64_t seed = 0; seed < 120; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Pair p(seed, 1 + static_cast<int>(seed % 6), seed % 2 == 0);
    const auto node = [](Tree& t, Operation o, Tree::NodeId x, Tree::NodeId y) {
      return t.add(o, {x, y});
    };
    using enum Operation;
    const Lists a = lists_of([&](Tree& t) { return p.a(t); });
    const Lists b = lists_of([&](Tree& t) { return p.b(t); });
    const Lists both = lists_of([&](Tree& t) { return node(t, kIntersection, p.a(t), p.b(t)); });
    const Lists either = lists_of([&](Tree& t) { return node(t, kUnion, p.a(t), p.b(t)); });
    const Lists rest = lists_of([&](Tree& t) { return node(t, kDifference, p.a(t), p.b(t)); });
    const Lists other = lists_of([&](Tree& t) { return node(t, kDifference, p.b(t), p.a(t)); });

    EXPECT_EQ(lists_of([&](Tree& t) { return node(t, kUnion, p.a(t), p.a(t)); }), a);
    EXPECT_EQ(lists_of([&](Tree& t) { return node(t, kIntersection, p.a(t), p.a(t)); }), a);
    EXPECT_EQ(length(lists_of([&](Tree& t) { return node(t, kDifference, p.a(t), p.a(t)); })), 0u);
    EXPECT_EQ(lists_of([&](Tree& t) { return node(t, kUnion, p.a(t), t.add(kUnion, {})); }), a);
    EXPECT_EQ(length(lists_of(
                  [&](Tree& t) { return node(t, kIntersection, p.a(t), t.add(kUnion, {})); })),
              0u);
    // commutative
    EXPECT_EQ(lists_of([&](Tree& t) { return node(t, kUnion, p.b(t), p.a(t)); }), either);
    EXPECT_EQ(lists_of([&](Tree& t) { return node(t, kIntersection, p.b(t), p.a(t)); }), both);
    // absorption
    EXPECT_EQ(lists_of([&](Tree& t) {
                return node(t, kUnion, p.a(t), node(t, kIntersection, p.a(t), p.b(t)));
              }),
              a);
    // (A - B) or (A and B) = A; A - (A - B) = A and B
    EXPECT_EQ(lists_of([&](Tree& t) {
                return node(t, kUnion, node(t, kDifference, p.a(t), p.b(t)),
                            node(t, kIntersection, p.a(t), p.b(t)));
              }),
              a);
    EXPECT_EQ(lists_of([&](Tree& t) {
                return node(t, kDifference, p.a(t), node(t, kDifference, p.a(t), p.b(t)));
              }),
              both);
    // De Morgan below a universe: U - (A or B) = (U - A) and (U - B)
    const auto universe = [](Tree& t) {
      return t.add_solid(
          {std::make_shared<TriangleSoup>(make_box(glm::dvec3(-10.3), glm::dvec3(10.3)))});
    };
    EXPECT_EQ(lists_of([&](Tree& t) {
                return node(t, kDifference, universe(t), node(t, kUnion, p.a(t), p.b(t)));
              }),
              lists_of([&](Tree& t) {
                return node(t, kIntersection, node(t, kDifference, universe(t), p.a(t)),
                            node(t, kDifference, universe(t), p.b(t)));
              }));
    // inclusion and exclusion, exactly
    EXPECT_EQ(length(a) + length(b), length(either) + length(both));
    EXPECT_EQ(length(rest) + length(both), length(a));
    EXPECT_EQ(length(rest) + length(other) + length(both), length(either));
    if (HasFailure()) return;
  }
}

// The tree against brute force at the centres of voxels, along all axes. What is inside a solid
// alone the voxelizer tells, which CGAL holds (tests/voxelize/oracle_cgal_test.cpp).
TEST(SolidLists, AgreeWithRecursionAtVoxelCentres) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    RandomTree random(seed + 300);
    Tree tree;
    tree.set_root(random.grow(tree, random.pick(1, 10), seed % 2 == 0));
    std::vector<VoxelIntervals> of_solid;
    for (std::uint32_t solid = 0; solid < tree.solids().size(); ++solid) {
      Tree alone;
      alone.set_root(alone.add_solid(tree.solids()[solid]));
      const SolidLists lists(alone, alone.root());
      auto voxels = voxelize(lists.soup(), kGrid);
      ASSERT_TRUE(voxels.has_value());
      of_solid.push_back(std::move(*voxels));
    }
    const auto holds = [](const VoxelIntervals& voxels, int i, int j, int k) {
      for (const Interval run : voxels.column(i, j)) {
        if (run.first <= k && k <= run.last) return true;
      }
      return false;
    };
    const VoxelIntervals expected =
        intervals_from_predicate(kGrid, Axis::kZ, [&](int i, int j, int k) {
          return evaluate(tree, tree.root(),
                          [&](std::uint32_t solid) { return holds(of_solid[solid], i, j, k); });
        });
    VoxelizeReport reports[3];
    const SolidLists lists(tree, tree.root());
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      const VoxelizeOptions options{.axis = axis, .statistics = true, .filter = &lists.filter()};
      const auto found =
          voxelize(lists.soup(), kGrid, options, {}, &reports[static_cast<int>(axis)]);
      ASSERT_TRUE(found.has_value());
      EXPECT_EQ(found->solid_voxels(), expected.solid_voxels()) << "seed " << seed;
      if (axis != Axis::kZ) continue;
      for (int j = 0; j < kGrid.dims.y; ++j) {
        for (int i = 0; i < kGrid.dims.x; ++i) {
          const auto a = found->column(i, j), b = expected.column(i, j);
          ASSERT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end())) << "seed " << seed;
        }
      }
    }
    EXPECT_EQ(reports[0].checksum, reports[2].checksum) << "seed " << seed;
    EXPECT_EQ(reports[1].checksum, reports[2].checksum) << "seed " << seed;
  }
}

/// The solids below a node that are not taken away, by recursion.
void add_solids(const Tree& tree, Tree::NodeId node, bool adds, std::vector<std::uint32_t>& out) {
  const Tree::Node& at = tree.nodes()[node];
  if (at.operation == Operation::kSolid) {
    if (adds) out.push_back(at.first);
    return;
  }
  const auto operands = tree.operands(node);
  for (std::size_t i = 0; i < operands.size(); ++i) {
    add_solids(tree, operands[i], adds != (at.operation == Operation::kDifference && i > 0), out);
  }
}

bool holds(const VoxelIntervals& voxels, int i, int j, int k) {
  for (const Interval run : voxels.column(i, j)) {
    if (run.first <= k && k <= run.last) return true;
  }
  return false;
}

/// The voxels of each solid by itself, along z.
std::vector<VoxelIntervals> voxels_of_solids(const Tree& tree) {
  std::vector<VoxelIntervals> result;
  for (const Solid& solid : tree.solids()) {
    Tree alone;
    alone.set_root(alone.add_solid(solid));
    const SolidLists lists(alone, alone.root());
    result.push_back(voxelize(lists.soup(), kGrid).value());
  }
  return result;
}

TEST(Labels, AreOfTheFirstSolidThatHoldsTheVoxelAndIsNotTakenAway) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomTree random(seed + 900);
    Tree tree;
    tree.set_root(random.grow(tree, random.pick(1, 12), seed % 2 == 0));
    const auto of_solid = voxels_of_solids(tree);
    std::vector<std::uint32_t> added;
    add_solids(tree, tree.root(), true, added);
    const auto expected = [&](int i, int j, int k) -> std::uint32_t {
      const auto inside = [&](std::uint32_t solid) { return holds(of_solid[solid], i, j, k); };
      if (!evaluate(tree, tree.root(), inside)) return 0;
      return *std::find_if(added.begin(), added.end(), inside) + 1;
    };
    SolidLists lists(tree, tree.root());
    lists.set_labels(id_labels(tree));
    VoxelizeReport with, without;
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      const AxisFrame frame(axis);
      const VoxelizeOptions options{.axis = axis, .statistics = true, .filter = &lists.filter()};
      const auto found = voxelize(lists.soup(), kGrid, options, {}, &with);
      ASSERT_TRUE(found.has_value());
      std::vector<std::uint32_t> ids(28 * 28 * 28, 0);
      const auto at = [](const glm::ivec3& p) {
        return static_cast<std::size_t>((p.z * 28 + p.y) * 28 + p.x);
      };
      for (int v = 0; v < 28; ++v) {
        for (int u = 0; u < 28; ++u) {
          for_each_labelled(*found, u, v, [&](const Interval& run, std::uint32_t label) {
            glm::ivec3 p(0);
            p[frame.u] = u, p[frame.v] = v;
            for (p[frame.w] = run.begin(); p[frame.w] < run.end(); ++p[frame.w]) ids[at(p)] = label;
          });
        }
      }
      int wrong = 0;
      for (int n = 0; n < 28 * 28 * 28; ++n) {
        const glm::ivec3 p(n % 28, n / 28 % 28, n / 784);
        wrong += ids[at(p)] != expected(p.x, p.y, p.z) ? 1 : 0;
      }
      ASSERT_EQ(wrong, 0);
      // Statistics do not see labels.
      const SolidLists plain(tree, tree.root());
      const VoxelizeOptions same{.axis = axis, .statistics = true, .filter = &plain.filter()};
      ASSERT_TRUE(voxelize(plain.soup(), kGrid, same, {}, &without).has_value());
      EXPECT_EQ(with.solid_voxels, without.solid_voxels);
      EXPECT_EQ(with.intervals, without.intervals);
      EXPECT_EQ(with.checksum, without.checksum);
    }
  }
}

// More solids than one word, and one word of words, of the set that tells the first one holds.
TEST(Labels, OfManySolids) {
  Tree tree;
  std::vector<Tree::NodeId> boxes;
  for (int i = 0; i < 5000; ++i) {
    const double x = -10 + 20.0 * i / 5000;
    boxes.push_back(tree.add_solid(
        {std::make_shared<TriangleSoup>(make_box({x, -5, -5 - i * 1e-4}, {x + 2, 5, 5}))}));
  }
  tree.set_root(tree.add(Operation::kUnion, boxes));
  SolidLists lists(tree, tree.root());
  lists.set_labels(id_labels(tree));
  const auto found = voxelize(lists.soup(), kGrid, {.axis = Axis::kX, .filter = &lists.filter()});
  ASSERT_TRUE(found.has_value());
  for (int i = 0; i < 28; ++i) {
    const double centre = kGrid.origin.x + (i + 0.5) * kGrid.voxel_size.x;
    std::uint32_t first = 0;
    for (int b = 4999; b >= 0; --b) {
      const double x = -10 + 20.0 * b / 5000;
      if (x < centre && centre < x + 2) first = static_cast<std::uint32_t>(b) + 1;
    }
    std::uint32_t label = 0;
    for_each_labelled(*found, 14, 14, [&](const Interval& run, std::uint32_t l) {
      if (run.first <= i && i <= run.last) label = l;
    });
    EXPECT_NEAR(label, first, 1) << i;  // snapped to 1/256 of a voxel
  }
}

TEST(Labels, OfColoursFollowTheirFirstAppearance) {
  const auto box = [](double x0, double x1, std::optional<glm::vec4> colour) {
    Solid solid;
    solid.mesh = std::make_shared<TriangleSoup>(make_box({x0, -5, -5}, {x1, 5, 5}));
    solid.colour = colour;
    return solid;
  };
  const glm::vec4 red(1, 0, 0, 1), blue(0, 0, 1, 1), none(1, 1, 0, 1);
  Tree tree;
  const auto a = tree.add_solid(box(-6, 0, red)), b = tree.add_solid(box(-3, 6, {}));
  const auto taken = tree.add_solid(box(4, 9, blue)), c = tree.add_solid(box(0, 1, red));
  const auto both = tree.add(Operation::kUnion, {a, b, c});
  const auto root = tree.add(Operation::kDifference, {both, taken});
  const ColourLabels found = colour_labels(tree, root, none);
  EXPECT_EQ(found.colours, (std::vector<glm::vec4>{red, none}));
  EXPECT_EQ(found.labels[0], 1u);
  EXPECT_EQ(found.labels[1], 2u);
  EXPECT_EQ(found.labels[3], 1u);
  EXPECT_TRUE(colour_labels(Tree(), Tree::kNone, none).colours.empty());
}

// In time that does not grow with their square: that would be a minute here.
TEST(Labels, OfColoursMayBeMany) {
  constexpr std::uint32_t kCount = 250'000;
  Tree tree;
  std::vector<Tree::NodeId> solids;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    Solid solid;
    const std::uint32_t n = i % (kCount - 1000);  // the last 1000 have the first ones' again
    solid.colour = glm::vec4(float(n % 512) / 512, float(n / 512) / 512, 0, 1);
    solids.push_back(tree.add_solid(std::move(solid)));
  }
  const auto root = tree.add(Operation::kUnion, solids);
  const auto start = std::chrono::steady_clock::now();
  const ColourLabels found = colour_labels(tree, root, glm::vec4(1));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));
  ASSERT_EQ(found.colours.size(), kCount - 1000);
  for (std::uint32_t i = 0; i < kCount; ++i) {
    ASSERT_EQ(found.labels[i], i % (kCount - 1000) + 1);
  }
  EXPECT_EQ(found.colours[513], glm::vec4(1.0f / 512, 1.0f / 512, 0, 1));
}

}  // namespace
}  // namespace strata::csg
