#include <gtest/gtest.h>

#include <glm/ext/matrix_transform.hpp>
#include <random>

#include "strata/csg/boundary/boundary_mesh.h"
#include "strata/mesh/shapes.h"

namespace strata::csg {
namespace {

Tree box(const glm::dvec3& low, const glm::dvec3& high) { return Tree(make_box(low, high)); }

ExactMeasures measured(const Tree& tree, const BoundaryOptions& options = {}) {
  auto result = exact_measures(tree, tree.root(), options);
  EXPECT_TRUE(result.has_value()) << result.error().message;
  return result ? *result : ExactMeasures{};
}

TEST(ExactMeasures, OfABoxAreItsFormulas) {
  const ExactMeasures m = measured(box({1, 2, 3}, {3, 5, 7}));
  EXPECT_EQ(m.volume, 24);
  EXPECT_EQ(m.area, 52);
  EXPECT_EQ(m.centre, glm::dvec3(2, 3.5, 5));
  EXPECT_EQ(m.low, glm::dvec3(1, 2, 3));
  EXPECT_EQ(m.high, glm::dvec3(3, 5, 7));
  EXPECT_EQ(m.inertia, (std::array<double, 6>{50, 40, 26, 0, 0, 0}));
}

TEST(ExactMeasures, OfBoxesThatOverlapAreCounted) {
  const Tree a = box({0, 0, 0}, {4, 4, 4}), b = box({2, 2, 2}, {6, 6, 6});
  EXPECT_EQ(measured(a | b).volume, 64 + 64 - 8);
  EXPECT_EQ(measured(a & b).volume, 8);
  EXPECT_EQ(measured(a - b).volume, 56);
  EXPECT_EQ(measured(a | b).area, 192 - 24);
  EXPECT_EQ(measured(a - b).area, 96);
  EXPECT_TRUE(measured(a - a).empty);
  EXPECT_EQ(measured(a | a).volume, 64);
}

// Boxes on a lattice of 4 steps a side, where everything coincides; unit cells are counted.
TEST(ExactMeasures, OfRandomTreesOfBoxesEqualTheCellsThatAreInside) {
  std::mt19937_64 random(1);
  const auto below = [&](int end) {
    return static_cast<int>(random() % static_cast<unsigned>(end));
  };
  constexpr int kSide = 4;
  for (int round = 0; round < 400; ++round) {
    using Cells = std::array<bool, kSide * kSide * kSide>;
    Tree tree;
    Cells cells{};
    for (int n = 2 + below(6); n > 0; --n) {
      glm::ivec3 low, high;
      for (int k = 0; k < 3; ++k) {
        low[k] = below(kSide);
        high[k] = low[k] + 1 + below(kSide - low[k]);
      }
      const Tree part = box(low, high);
      Cells other{};
      for (int z = low.z; z < high.z; ++z)
        for (int y = low.y; y < high.y; ++y)
          for (int x = low.x; x < high.x; ++x)
            other[static_cast<std::size_t>((z * kSide + y) * kSide + x)] = true;
      const int operation = tree.root() == Tree::kNone ? 0 : below(3);
      if (operation == 0) tree |= part;
      if (operation == 1) tree &= part;
      if (operation == 2) tree -= part;
      for (std::size_t i = 0; i < cells.size(); ++i) {
        cells[i] = operation == 0   ? cells[i] || other[i]
                   : operation == 1 ? cells[i] && other[i]
                                    : cells[i] && !other[i];
      }
    }
    const auto result = exact_measures(tree, tree.root());
    ASSERT_TRUE(result.has_value()) << round << ": " << result.error().message;
    EXPECT_EQ(result->volume, static_cast<double>(std::ranges::count(cells, true))) << round;
  }
}

}  // namespace
}  // namespace strata::csg
