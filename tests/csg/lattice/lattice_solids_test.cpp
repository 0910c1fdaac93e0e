#include "csg/lattice/lattice_solids.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/ext/matrix_transform.hpp>
#include <random>

#include "exact/mesh_sums.h"
#include "strata/mesh/shapes.h"

namespace strata::csg {
namespace {

LatticeSolids snapped(const Tree& tree, int bits = kBoundaryBits) {
  auto result = snap_solids(tree, tree.root(), Geometry(tree), bits);
  EXPECT_TRUE(result.has_value());
  return *std::move(result);
}

double volume(const LatticeSolids& solids, std::size_t solid) {
  exact::VolumeSum sum;
  for (std::uint32_t t = solids.first_triangle[solid]; t < solids.first_triangle[solid + 1]; ++t) {
    const glm::uvec3& v = solids.triangles[t];
    sum.add(solids.vertices[v.x], solids.vertices[v.y], solids.vertices[v.z]);
  }
  return sum.volume() * solids.lattice.step * solids.lattice.step * solids.lattice.step;
}

std::int64_t farthest(const LatticeSolids& solids) {
  std::int64_t most = 0;
  for (const auto& p : solids.vertices) {
    for (int k = 0; k < 3; ++k) most = std::max(most, std::abs(std::int64_t{p[k]}));
  }
  return most;
}

TEST(LatticeSolids, TheResultSpansTheBitsAndStepsArePowersOfTwo) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0.1, 1);
  for (int i = 0; i < 300; ++i) {
    const double size = std::ldexp(unit(random), static_cast<int>(random() % 60) - 30);
    const glm::dvec3 low = glm::dvec3(unit(random), -unit(random), unit(random)) * size * 9.0;
    const glm::dvec3 high = low + glm::dvec3(unit(random), 1, unit(random)) * size;
    const int bits = 10 + static_cast<int>(random() % 17);
    const LatticeSolids solids = snapped(Tree(make_box(low, high)), bits);
    int exponent = 0;
    ASSERT_EQ(std::frexp(solids.lattice.step, &exponent), 0.5);
    const double steps = (high.y - low.y) / solids.lattice.step;
    ASSERT_GT(steps, std::ldexp(1.0, bits - 1));
    ASSERT_LE(steps, std::ldexp(1.0, bits));
    for (int k = 0; k < 3; ++k) {
      const double origin = solids.lattice.origin[k] / solids.lattice.step;
      ASSERT_EQ(origin, std::floor(origin));
    }
    ASSERT_EQ(solids.coarsened, 0);
    ASSERT_LE(farthest(solids), (std::int64_t{1} << (bits - 1)) + 1);
  }
}

TEST(LatticeSolids, AWholePowerOfTwoTakesAllItsBits) {
  const LatticeSolids solids = snapped(Tree(make_box({0, 0, 0}, {4, 4, 4})), 10);
  EXPECT_EQ(solids.lattice.step, 4.0 / 1024);
}

TEST(LatticeSolids, VerticesGoToTheNearestPointAndTiesUp) {
  // 2^4 steps of 1 in x; the others have halves, and doubles next to them.
  const double below = std::nextafter(2.5, 0);
  const LatticeSolids solids = snapped(Tree(make_box({0, -1.5, below}, {16, 2.5, 3.25})), 4);
  ASSERT_EQ(solids.lattice.step, 1);
  for (const auto& p : solids.vertices) {
    const glm::dvec3 at = solids.lattice.origin + glm::dvec3(p);
    EXPECT_TRUE(at.x == 0 || at.x == 16) << at.x;
    EXPECT_TRUE(at.y == -1 || at.y == 3) << at.y;
    EXPECT_TRUE(at.z == 2 || at.z == 3) << at.z;
  }
}

TEST(LatticeSolids, VolumesOfBoxesOnTheLatticeAreExact) {
  const TriangleSoup box = make_box({0.5, 1, 2}, {3, 5.25, 7.125});
  const double expected = 2.5 * 4.25 * 5.125;
  EXPECT_EQ(volume(snapped(Tree(box)), 0), expected);
  // A mirrored solid stays outward.
  Solid solid{std::make_shared<TriangleSoup>(box), glm::scale(glm::dmat4(1), glm::dvec3(-1, 1, 1))};
  EXPECT_EQ(volume(snapped(Tree(solid)), 0), expected);
}

TEST(LatticeSolids, CuttersFarOutsideMakeTheStepCoarser) {
  const Tree part(make_box({0, 0, 0}, {1, 1, 1}));
  const LatticeSolids near = snapped(part - Tree(make_box({0.5, 0, 0}, {1.9, 1, 1})));
  EXPECT_EQ(near.coarsened, 0);
  EXPECT_EQ(near.lattice.step, std::ldexp(1.0, -26));
  const LatticeSolids far = snapped(part - Tree(make_box({0.5, 0, 0}, {100, 1, 1})));
  EXPECT_EQ(far.coarsened, 5);  // 2^28 steps reach 100: 2^-21 each
  EXPECT_EQ(far.lattice.step, std::ldexp(1.0, -21));
  EXPECT_LE(farthest(far), 1 << 28);
  EXPECT_EQ(volume(far, 0), 1);
}

TEST(LatticeSolids, OnlySolidsBelowTheRootAreThere) {
  Tree tree;
  const auto solid = [&](double at) {
    return tree.add_solid(
        {std::make_shared<TriangleSoup>(make_box(glm::dvec3(at), glm::dvec3(at + 1)))});
  };
  const auto a = solid(0), off = solid(1000), b = solid(0.5);
  tree.set_root(tree.add(Operation::kUnion, {a, b}));
  const LatticeSolids solids = snapped(tree);
  ASSERT_EQ(solids.solid_count(), 3u);
  EXPECT_EQ(solids.first_triangle, (std::vector<std::uint32_t>{0, 12, 12, 24}));
  EXPECT_EQ(volume(solids, 0), 1);
  EXPECT_EQ(volume(solids, 2), 1);
  EXPECT_EQ(solids.coarsened, 0);
  static_cast<void>(off);
}

TEST(LatticeSolids, EmptyTreesHaveNone) {
  EXPECT_TRUE(snapped(Tree()).triangles.empty());
  const Tree a(make_box({0, 0, 0}, {1, 1, 1})), b(make_box({5, 5, 5}, {6, 6, 6}));
  EXPECT_TRUE(snapped(a & b).triangles.empty());
}

TEST(LatticeSolids, LimitsAndStopsAreKept) {
  const Tree tree(make_icosphere(1, 4));
  Execution execution;
  execution.memory_limit = 1000;
  const auto refused = snap_solids(tree, tree.root(), Geometry(tree), 26, execution);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
  EXPECT_NE(refused.error().message.find("1000"), std::string::npos);
  std::stop_source stop;
  stop.request_stop();
  const auto stopped =
      snap_solids(tree, tree.root(), Geometry(tree), 26, {.stop = stop.get_token()});
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace strata::csg
