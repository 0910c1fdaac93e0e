#include "csg/program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/csg/random_tree.h"

namespace strata::csg {
namespace {

/// A tree of random shape whose solids have no meshes.
Tree bare_tree(RandomTree& random, int solids, bool with_empty_nodes) {
  Tree tree;
  std::vector<Tree::NodeId> loose;
  for (int i = 0; i < solids; ++i) loose.push_back(tree.add_solid({}));
  constexpr Operation kOperations[] = {Operation::kUnion, Operation::kIntersection,
                                       Operation::kDifference};
  while (loose.size() > 1) {
    const int count = std::min<int>(static_cast<int>(loose.size()), random.pick(1, 5));
    std::vector<Tree::NodeId> operands;
    for (int i = 0; i < count; ++i) {
      const int at = random.pick(0, static_cast<int>(loose.size()) - 1);
      operands.push_back(loose[static_cast<std::size_t>(at)]);
      loose.erase(loose.begin() + at);
    }
    if (with_empty_nodes && random.pick(0, 9) == 0) {
      operands.push_back(tree.add(kOperations[random.pick(0, 2)], {}));
    }
    loose.push_back(tree.add(kOperations[random.pick(0, 2)], operands));
  }
  tree.set_root(loose.front());
  return tree;
}

TEST(Program, AgreesWithRecursionAfterEachFlip) {
  for (int seed = 0; seed < 400; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed));
    const int solids = seed % 10 == 0 ? 1000 : random.pick(1, 40);
    const Tree tree = bare_tree(random, solids, true);
    const Program program = compile(tree, tree.root());
    ProgramState state(program);
    std::vector<bool> inside(static_cast<std::size_t>(solids), false);
    const auto expected = [&] {
      return evaluate(tree, tree.root(), [&](std::uint32_t solid) { return inside[solid]; });
    };
    ASSERT_EQ(state.value(), expected()) << "seed " << seed;
    for (int step = 0; step < (solids > 100 ? 200 : 300); ++step) {
      const auto solid = static_cast<std::uint32_t>(random.pick(0, solids - 1));
      state.toggle(solid);
      inside[solid] = !inside[solid];
      ASSERT_EQ(state.value(), expected()) << "seed " << seed << ", step " << step;
    }
  }
}

// Some solids vary, all others stay as they are. All choices of those that vary are tried.
TEST(Program, ASolidContributesIfTheValueRestsOnIt) {
  std::size_t contributing = 0, idle = 0;
  for (int seed = 0; seed < 300; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 1000);
    const int solids = random.pick(2, 12);
    const Tree tree = bare_tree(random, solids, false);
    const Program program = compile(tree, tree.root());
    ProgramState state(program);
    for (int step = 0; step < 20; ++step) {
      state.toggle(static_cast<std::uint32_t>(random.pick(0, solids - 1)));
      std::vector<std::uint32_t> varying;
      for (std::uint32_t solid = 0; solid < static_cast<std::uint32_t>(solids); ++solid) {
        if (varying.size() < 6 && random.pick(0, 1) == 0) varying.push_back(solid);
      }
      state.vary(varying);
      std::uint32_t contribute = 0;
      for (std::size_t i = 0; i < varying.size(); ++i) {
        contribute |= state.contributes(varying[i]) ? 1u << i : 0u;
      }
      std::vector<bool> values;
      for (std::uint32_t turned = 0; turned < 1u << varying.size(); ++turned) {
        values.push_back(evaluate(tree, tree.root(), [&](std::uint32_t solid) {
          const auto at = std::find(varying.begin(), varying.end(), solid) - varying.begin();
          return state.inside(solid) != ((turned >> at & 1) != 0);
        }));
      }
      for (std::uint32_t turned = 0; turned < values.size(); ++turned) {
        if ((turned & contribute) != 0) continue;
        ASSERT_EQ(values[turned], state.value()) << "seed " << seed << ", step " << step;
      }
      for (std::size_t i = 0; i < varying.size(); ++i) {
        bool matters = false;
        for (std::uint32_t turned = 0; turned < values.size(); ++turned) {
          matters = matters || values[turned] != values[turned ^ 1u << i];
        }
        const bool contributes = (contribute >> i & 1) != 0;
        ASSERT_TRUE(matters || !contributes) << "seed " << seed << ", step " << step;
        (contributes ? contributing : idle) += 1;
      }
    }
  }
  EXPECT_GT(contributing, 3000u);
  EXPECT_GT(idle, 3000u);
}

TEST(Program, ASolidThatDecidesTurnsTheValue) {
  for (int seed = 0; seed < 200; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 2000);
    const int solids = random.pick(1, 20);
    const Tree tree = bare_tree(random, solids, false);
    const Program program = compile(tree, tree.root());
    ProgramState state(program);
    for (int step = 0; step < 20; ++step) {
      state.toggle(static_cast<std::uint32_t>(random.pick(0, solids - 1)));
      const bool value = state.value();
      for (std::uint32_t solid = 0; solid < static_cast<std::uint32_t>(solids); ++solid) {
        const bool decides = state.decides(solid);
        state.toggle(solid);
        ASSERT_EQ(decides, state.value() != value) << "seed " << seed << ", step " << step;
        state.toggle(solid);
      }
    }
  }
}

TEST(Program, FlipsTogetherAreThoseOneAfterAnother) {
  for (int seed = 0; seed < 200; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 3000);
    const int solids = random.pick(1, seed % 10 == 0 ? 500 : 20);
    const Tree tree = bare_tree(random, solids, false);
    const Program program = compile(tree, tree.root());
    ProgramState together(program), single(program);
    for (int step = 0; step < 20; ++step) {
      std::vector<std::uint32_t> turned(static_cast<std::size_t>(random.pick(0, solids)));
      for (std::uint32_t& solid : turned) {
        solid = static_cast<std::uint32_t>(random.pick(0, solids - 1));
        single.toggle(solid);
      }
      together.toggle_all(turned);
      std::vector<std::uint32_t> all(static_cast<std::size_t>(solids));
      std::iota(all.begin(), all.end(), 0u);
      together.vary(all), single.vary(all);
      for (std::uint32_t solid = 0; solid < static_cast<std::uint32_t>(solids); ++solid) {
        ASSERT_EQ(together.inside(solid), single.inside(solid));
        ASSERT_EQ(together.contributes(solid), single.contributes(solid));
      }
      ASSERT_EQ(together.value(), single.value()) << "seed " << seed << ", step " << step;
      if (step == 10) together.reset(), single.reset();
    }
  }
}

TEST(Program, ADeepTreeNeedsNoStack) {
  Tree tree;
  Tree::NodeId node = tree.add_solid({});
  constexpr int kDeep = 300'000;
  for (int i = 0; i < kDeep; ++i) {
    node = tree.add(Operation::kDifference, {tree.add_solid({}), node});
  }
  tree.set_root(node);
  const Program program = compile(tree, node);
  ProgramState state(program);
  for (std::uint32_t solid = 0; solid <= kDeep; ++solid) state.toggle(solid);
  // A1 - (A2 - (A3 - ...)) with all inside: true for an odd number of solids.
  EXPECT_EQ(state.value(), (kDeep + 1) % 2 == 1);
  std::vector<std::uint32_t> all(kDeep + 1);
  std::iota(all.begin(), all.end(), 0u);
  state.toggle_all(all);
  EXPECT_FALSE(state.value());
}

TEST(Program, NestedUnionsAndDifferencesMelt) {
  Tree tree;
  Tree::NodeId node = tree.add_solid({});
  for (int i = 0; i < 100; ++i) {
    node = tree.add(Operation::kDifference, {node, tree.add_solid({})});
  }
  tree.set_root(node);
  EXPECT_LE(compile(tree, node).nodes.size(), 2u);
}

}  // namespace
}  // namespace strata::csg
