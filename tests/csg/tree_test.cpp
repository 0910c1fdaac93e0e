#include "strata/csg/tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/ext/matrix_transform.hpp>
#include <string>

#include "strata/csg.h"
#include "tests/csg/random_tree.h"

namespace strata::csg {
namespace {

/// The box [low, high] as a tree.
Tree box(double low, double high) { return Tree(make_box(glm::dvec3(low), glm::dvec3(high))); }

/// One voxel a unit, centres at 0.5, 1.5, ...
const VoxelGrid kUnits{glm::ivec3(20), glm::dvec3(-10), glm::dvec3(1)};

std::uint64_t voxels_of(const Tree& tree) {
  const auto voxels = voxelize(tree, kUnits);
  EXPECT_TRUE(voxels.has_value()) << voxels.error().message;
  return voxels ? voxels->solid_voxels() : 0;
}

std::uint64_t cube(std::uint64_t side) { return side * side * side; }

TEST(TreeValue, OperatorsAreSetOperations) {
  const Tree a = box(0, 6), b = box(4, 9);
  EXPECT_EQ(voxels_of(a), cube(6));
  EXPECT_EQ(voxels_of(a | b), cube(6) + cube(5) - cube(2));
  EXPECT_EQ(voxels_of(a & b), cube(2));
  EXPECT_EQ(voxels_of(a - b), cube(6) - cube(2));
  EXPECT_EQ(voxels_of(b - a), cube(5) - cube(2));
}

TEST(TreeValue, ATreeMayBeUsedAnyNumberOfTimes) {
  const Tree a = box(0, 6), b = box(4, 9);
  const Tree both = (a - b) | (b - a);
  EXPECT_EQ(voxels_of(both), cube(6) + cube(5) - 2 * cube(2));
  EXPECT_EQ(voxels_of(both | both), voxels_of(both));
  EXPECT_EQ(voxels_of(both - both), 0u);
  Tree grown = a;
  const Tree& same = grown;
  grown |= same;
  grown -= b;
  grown &= same;
  EXPECT_EQ(voxels_of(grown), cube(6) - cube(2));
  // The meshes are shared.
  for (const Solid& solid : grown.solids()) {
    EXPECT_TRUE(solid.mesh == a.solids()[0].mesh || solid.mesh == b.solids()[0].mesh);
  }
}

TEST(TreeValue, TransformMovesATree) {
  const Tree part = box(0, 3) - box(1, 2);
  const glm::dmat4 move = glm::translate(glm::dmat4(1.0), glm::dvec3(-5, 0, 4));
  const Tree two = part | transform(move, part);
  EXPECT_EQ(voxels_of(two), 2 * (cube(3) - 1));
  const Bounds all = bounds(two);
  EXPECT_EQ(all.low, glm::dvec3(-5, 0, 0));
  EXPECT_EQ(all.high, glm::dvec3(3, 3, 7));
}

TEST(TreeValue, TheEmptyTreeIsTheEmptySet) {
  const Tree a = box(0, 6), empty;
  EXPECT_EQ(voxels_of(a | empty), cube(6));
  EXPECT_EQ(voxels_of(empty | a), cube(6));
  EXPECT_EQ(voxels_of(a - empty), cube(6));
  EXPECT_EQ(voxels_of(empty - a), 0u);
  EXPECT_EQ(voxels_of(a & empty), 0u);
  EXPECT_EQ(voxels_of(empty), 0u);
}

TEST(TreeValue, UnitesManyPartsInALoop) {
  Tree all;
  for (int i = 0; i < 2000; ++i) {
    const glm::dvec3 low(i % 20 - 10, i / 20 % 20 - 10, i / 400 * 3 - 10);
    all |= Tree(make_box(low, low + 1.0));
  }
  EXPECT_EQ(voxels_of(all), 2000u);
}

TEST(TreeValue, IsPicturedAndMeasuredInOneCall) {
  const Tree tree = (box(0, 6) - box(4, 9)) | box(-3, -1);
  const auto measures = measure(tree);
  ASSERT_TRUE(measures.has_value()) << measures.error().message;
  EXPECT_NEAR(measures->volume, 216.0 - 8.0 + 8.0, measures->volume_error);
  EXPECT_LT(measures->volume_error, 1.0);
  const auto image = picture(tree);
  ASSERT_TRUE(image.has_value()) << image.error().message;
  EXPECT_EQ(image->width, 512);
  const Rgba background = image->pixels[0];
  const auto at = [&](std::size_t x, std::size_t y) { return image->pixels[y * 512 + x]; };
  const auto shown = std::count_if(image->pixels.begin(), image->pixels.end(),
                                   [&](Rgba pixel) { return pixel != background; });
  EXPECT_GT(shown, 512 * 512 / 20);
  for (std::size_t i = 0; i < 512; ++i) {  // all in view
    for (const Rgba pixel : {at(i, 0), at(i, 511), at(0, i), at(511, i)}) {
      ASSERT_EQ(pixel, background);
    }
  }
  // A camera may be said.
  Camera far_away;
  far_away.distance = 5000;
  const auto small = picture(tree, far_away, {64, 48});
  ASSERT_TRUE(small.has_value()) << small.error().message;
  EXPECT_EQ(small->height, 48);
}

TEST(Tree, AppendCopiesSubtreesOfAnyTree) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomTree random(seed);
    Tree from, to;
    const Tree::NodeId first = random.grow(from, 1 + static_cast<int>(seed % 7), true);
    const Tree::NodeId second = random.grow(from, 1 + static_cast<int>(seed % 3), true);
    random.grow(to, 3, true);
    const Tree::NodeId nodes[] = {second, first, second};
    const auto copies = to.append(from, nodes);
    ASSERT_EQ(copies.size(), 3u);
    EXPECT_EQ(copies[0], copies[2]);
    const Tree::NodeId again = to.append(to, copies[1]);
    for (int point = 0; point < 200; ++point) {
      const glm::dvec3 p(random.real(-6, 6), random.real(-6, 6), random.real(-6, 6));
      const auto in = [&](const Tree& tree) {
        return [&tree, p](std::uint32_t solid) {
          const Bounds reach = bounds(tree.solids()[solid]);
          return glm::all(glm::lessThan(reach.low, p)) && glm::all(glm::lessThan(p, reach.high));
        };
      };
      EXPECT_EQ(evaluate(to, copies[0], in(to)), evaluate(from, second, in(from)));
      EXPECT_EQ(evaluate(to, copies[1], in(to)), evaluate(from, first, in(from)));
      EXPECT_EQ(evaluate(to, again, in(to)), evaluate(from, first, in(from)));
    }
    EXPECT_TRUE(check_tree(to, to.add(Operation::kUnion, {copies[0], copies[1], again})));
  }
}

/// The message with which all that takes trees refuses one.
std::string refusal_of(const Tree& tree) {
  const auto checked = check_tree(tree, tree.root());
  EXPECT_FALSE(checked.has_value());
  if (checked) return {};
  const auto expect_same = [&](const auto& result) {
    EXPECT_FALSE(result.has_value());
    if (result) return;
    EXPECT_EQ(result.error().code, ErrorCode::kUsage);
    EXPECT_EQ(result.error().message, checked.error().message);
  };
  expect_same(picture(tree));
  expect_same(measure(tree));
  expect_same(voxelize(tree, kUnits));
  return checked.error().message;
}

TEST(Tree, UnknownOperandsAndSecondUsesAreRefused) {
  Tree unknown = box(0, 1);
  unknown.set_root(unknown.add(Operation::kUnion, {0, 7}));
  EXPECT_EQ(refusal_of(unknown),
            "node 1 uses node 7; operands must be added before the node that uses them");
  Tree none = box(0, 1);
  none.set_root(none.add(Operation::kUnion, {Tree::kNone}));
  EXPECT_NE(refusal_of(none).find("node 1 uses node 4294967295"), std::string::npos);
  Tree itself = box(0, 1);
  itself.set_root(itself.add(Operation::kUnion, {1}));
  EXPECT_NE(refusal_of(itself).find("node 1 uses node 1"), std::string::npos);
  Tree twice = box(0, 1);
  const auto pair = twice.add(Operation::kUnion, {0, 0});
  twice.set_root(pair);
  EXPECT_EQ(refusal_of(twice),
            "node 0 is an operand twice, of node 1 and of node 1; append() copies it");
  Tree root;
  root.set_root(3);
  EXPECT_EQ(refusal_of(root), "node 3 is unknown; the tree has 0 nodes");
}

TEST(Tree, NodesThatTheRootDoesNotReachMayShareOperands) {
  Tree tree = box(0, 2);
  (void)tree.add(Operation::kUnion, {0});
  tree.set_root(tree.add(Operation::kIntersection, {0}));
  EXPECT_TRUE(check_tree(tree, tree.root()).has_value());
  EXPECT_EQ(voxels_of(tree), cube(2));
}

}  // namespace
}  // namespace strata::csg
