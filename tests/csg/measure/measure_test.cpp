#include "strata/csg/measure/measure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/vector_relational.hpp>
#include <numbers>
#include <random>

#include "strata/mesh/shapes.h"

namespace strata::csg {
namespace {

Tree::NodeId add(Tree& tree, TriangleSoup mesh, const glm::dmat4& place = glm::dmat4(1)) {
  return tree.add_solid({std::make_shared<TriangleSoup>(std::move(mesh)), place});
}

TEST(Measures, OfABoxMinusABoxAreTheClosedForm) {
  Tree tree;
  const auto box = [&](const glm::dvec3& low, const glm::dvec3& high) {
    return tree.add_solid({std::make_shared<TriangleSoup>(make_box(low, high))});
  };
  tree.set_root(tree.add(Operation::kDifference, {box(glm::dvec3(0), glm::dvec3(8)),
                                                  box(glm::dvec3(2, 2, 2), glm::dvec3(6, 6, 10))}));
  const auto m = measure(tree, tree.root(), {.resolution = 64});
  ASSERT_TRUE(m.has_value());
  EXPECT_NEAR(m->volume, 512 - 96, 1e-6);
  EXPECT_LE(std::abs(m->volume - (512 - 96)), m->volume_error);
  EXPECT_NEAR(m->area, 6 * 64 + 4 * 24, 1e-6);
  EXPECT_NEAR(m->centre.x, 4.0, 1e-3);
  EXPECT_NEAR(m->centre.z, (512 * 4.0 - 96 * 5.0) / (512 - 96), 1e-3);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(m->low[axis], 0.0, m->bounds_error);
    EXPECT_NEAR(m->high[axis], 8.0, m->bounds_error);
  }
}

TEST(Measures, AThinRestThatSomeRaysPassByHasBoundsAllTheSame) {
  Tree tree;
  const auto box = [&](const glm::dvec3& low, const glm::dvec3& high) {
    return tree.add_solid({std::make_shared<TriangleSoup>(make_box(low, high))});
  };
  tree.set_root(tree.add(Operation::kDifference, {box(glm::dvec3(0), glm::dvec3(8)),
                                                  box(glm::dvec3(0.01, -1, -1), glm::dvec3(9))}));
  const auto m = measure(tree, tree.root(), {.resolution = 64});
  ASSERT_TRUE(m.has_value());
  EXPECT_FALSE(m->empty);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(m->low[axis], 0.0, m->bounds_error);
    EXPECT_NEAR(m->high[axis], axis == 0 ? 0.01 : 8.0, m->bounds_error);
    EXPECT_NEAR(m->centre[axis], axis == 0 ? 0.005 : 4.0, 1e-2);
  }
}

TEST(Measures, OfThinPlatesAndRodsAreAsGood) {
  for (const glm::dvec3& size :
       {glm::dvec3(100, 100, 0.1), glm::dvec3(100, 0.1, 0.1), glm::dvec3(1, 1, 1e7)}) {
    Tree tree;
    tree.set_root(tree.add_solid({std::make_shared<TriangleSoup>(make_box(glm::dvec3(0), size))}));
    const auto m = measure(tree, tree.root(), {.resolution = 64});
    ASSERT_TRUE(m.has_value());
    const double volume = size.x * size.y * size.z;
    EXPECT_NEAR(m->volume, volume, 1e-6 * volume);
    EXPECT_LE(m->volume_error, 0.1 * volume);
    EXPECT_NEAR(m->area, 2 * (size.x * size.y + size.y * size.z + size.z * size.x), 1e-6 * m->area);
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(m->centre[axis], size[axis] / 2, size[axis] / 64);
  }
}

TEST(Measures, StayWithinTheirBoundsForBallsAndTori) {
  Tree tree;
  tree.set_root(tree.add_solid({std::make_shared<TriangleSoup>(make_torus(3, 1, 64, 32))}));
  const TriangleSoup& mesh = *tree.solids()[0].mesh;
  const double exact = signed_volume(mesh);
  double area = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3& a = mesh.positions[t.x];
    area += glm::length(glm::cross(mesh.positions[t.y] - a, mesh.positions[t.z] - a)) / 2;
  }
  for (const int resolution : {16, 64, 200}) {
    const auto m = measure(tree, tree.root(), {.resolution = resolution});
    ASSERT_TRUE(m.has_value());
    EXPECT_LE(std::abs(m->volume - exact), m->volume_error) << resolution;
    EXPECT_LE(std::abs(m->area - area), m->area_error) << resolution;
  }
  const Tree empty;
  EXPECT_TRUE(measure(empty, empty.root())->empty);
  EXPECT_FALSE(measure(tree, tree.root(), {.resolution = 0}).has_value());
}

TEST(Measures, TheTopOfAConeIsItsApex) {
  // Rays meet a cone below its apex: six times the half of their distance.
  Tree tree;
  TriangleSoup cone;
  constexpr int kSides = 64;
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSides;
    cone.positions.emplace_back(5 * std::cos(angle), 5 * std::sin(angle), 0);
  }
  cone.positions.emplace_back(0, 0, 30);
  for (std::uint32_t i = 0; i < kSides; ++i) {
    cone.triangles.emplace_back(i, (i + 1) % kSides, kSides);
    if (i > 1) cone.triangles.emplace_back(0, i, i - 1);
  }
  tree.set_root(add(tree, cone));
  const auto m = measure(tree, tree.root(), {.resolution = 64});
  ASSERT_TRUE(m.has_value());
  EXPECT_EQ(m->high.z, 30.0);
  EXPECT_EQ(m->low.z, 0.0);
  EXPECT_EQ(m->bounds_error, 0.0);
  EXPECT_LE(std::abs(m->volume - signed_volume(cone)), m->volume_error);
}

TEST(Measures, APinThatNoRayMeetsReachesAsFarAsItsVertices) {
  Tree tree;
  const auto plate = add(tree, make_box(glm::dvec3(0), glm::dvec3(100, 100, 1)));
  const auto pin =
      add(tree, make_box(glm::dvec3(33.333, 61.1, 0.5), glm::dvec3(33.334, 61.101, 40)));
  const auto cutter = add(tree, make_box(glm::dvec3(90, 90, -1), glm::dvec3(101, 101, 50)));
  // Cut off by another: its vertices are not the result's.
  const auto gone = add(tree, make_box(glm::dvec3(95, 95, 0.5), glm::dvec3(95.001, 95.001, 45)));
  tree.set_root(
      tree.add(Operation::kDifference, {tree.add(Operation::kUnion, {plate, pin, gone}), cutter}));
  const auto m = measure(tree, tree.root(), {.resolution = 64});
  ASSERT_TRUE(m.has_value());
  EXPECT_EQ(m->high.z, 40.0);
  EXPECT_LE(40.0, m->high.z + m->bounds_error);
  EXPECT_EQ(m->high.x, 100.0);
}

TEST(Measures, StatedBoundsHoldForBoxesThatCutEachOther) {
  // Boxes along the axes: volume and bounds of the result by inclusion and exclusion in cells.
  std::mt19937 random(20261128);
  std::uniform_real_distribution<double> place(-1.0, 1.0), size(0.05, 1.2);
  int nonempty = 0;
  for (int round = 0; round < 40; ++round) {
    Tree tree;
    std::vector<std::pair<glm::dvec3, glm::dvec3>> boxes;
    std::vector<Tree::NodeId> nodes;
    for (int i = 0; i < 4; ++i) {
      const glm::dvec3 low(place(random), place(random), place(random));
      boxes.emplace_back(low, low + glm::dvec3(size(random), size(random), size(random)));
      nodes.push_back(add(tree, make_box(boxes.back().first, boxes.back().second)));
    }
    const auto both = tree.add(Operation::kUnion, {nodes[0], nodes[1]});
    tree.set_root(tree.add(Operation::kDifference, {both, nodes[2], nodes[3]}));
    std::vector<double> cuts[3];
    for (const auto& [low, high] : boxes) {
      for (int k = 0; k < 3; ++k) cuts[k].insert(cuts[k].end(), {low[k], high[k]});
    }
    for (auto& c : cuts) std::sort(c.begin(), c.end());
    double volume = 0;
    Bounds exact;
    for (std::size_t x = 0; x + 1 < cuts[0].size(); ++x) {
      for (std::size_t y = 0; y + 1 < cuts[1].size(); ++y) {
        for (std::size_t z = 0; z + 1 < cuts[2].size(); ++z) {
          const glm::dvec3 low(cuts[0][x], cuts[1][y], cuts[2][z]);
          const glm::dvec3 high(cuts[0][x + 1], cuts[1][y + 1], cuts[2][z + 1]);
          const glm::dvec3 p = 0.5 * (low + high);
          const auto in = [&](std::size_t i) {
            return glm::all(glm::lessThan(boxes[i].first, p)) &&
                   glm::all(glm::lessThan(p, boxes[i].second));
          };
          if (!((in(0) || in(1)) && !in(2) && !in(3))) continue;
          volume += (high.x - low.x) * (high.y - low.y) * (high.z - low.z);
          exact.include(low);
          exact.include(high);
        }
      }
    }
    const auto m = measure(tree, tree.root(), {.resolution = 48});
    ASSERT_TRUE(m.has_value());
    if (m->empty) continue;
    ++nonempty;
    EXPECT_LE(std::abs(m->volume - volume), m->volume_error) << round;
    for (int k = 0; k < 3; ++k) {
      EXPECT_LE(std::abs(m->low[k] - exact.low[k]), m->bounds_error) << round << " low " << k;
      EXPECT_LE(std::abs(m->high[k] - exact.high[k]), m->bounds_error) << round << " high " << k;
    }
  }
  EXPECT_GT(nonempty, 30);
}

TEST(Measures, FilmsWhereFacesCoincideAreNeitherAreaNorVolume) {
  // Ten turned cubes, each minus the same again but for a window: all their other faces coincide.
  Tree tree;
  const glm::dmat4 turn = glm::rotate(glm::rotate(glm::dmat4(1), 0.4, glm::dvec3(1, 0, 0)), 0.7,
                                      glm::dvec3(0, 0.6, 0.8));
  const auto cube = [&](double high) {
    return add(tree, make_box(glm::dvec3(0), glm::dvec3(10, 10, high)), turn);
  };
  tree.set_root(tree.add(Operation::kDifference, {cube(10), cube(5)}));
  const auto m = measure(tree, tree.root(), {.resolution = 128});
  ASSERT_TRUE(m.has_value());
  EXPECT_NEAR(m->area, 2 * 100 + 4 * 50, 8.0);  // with films 200 more
  EXPECT_NEAR(m->volume, 500.0, 2.0);
  // A thin wall of one solid is no film.
  Tree wall;
  wall.set_root(add(wall, make_box(glm::dvec3(0), glm::dvec3(10, 10, 2e-3)), turn));
  const auto thin = measure(wall, wall.root(), {.resolution = 128});
  ASSERT_TRUE(thin.has_value());
  EXPECT_NEAR(thin->area, 200.0, 6.0);
}

TEST(Measures, AnAxisWhoseRaysPassByDoesNotTakeFromTheVolume) {
  Tree tree;
  tree.set_root(tree.add(Operation::kUnion,
                         {add(tree, make_box(glm::dvec3(0), glm::dvec3(1))),
                          add(tree, make_box(glm::dvec3(1e5, 0, 0), glm::dvec3(1e5 + 1, 1, 1)))}));
  const auto m = measure(tree, tree.root());
  ASSERT_TRUE(m.has_value());
  EXPECT_LE(std::abs(m->volume - 2.0), m->volume_error);
  EXPECT_LE(m->volume_error, 1.0);
}

TEST(Measures, SmallPartsBetweenTheFirstRaysAreLookedForWithMore) {
  Tree tree;
  const glm::dvec3 far(2000, 1500, 0);
  tree.set_root(tree.add(Operation::kUnion, {add(tree, make_box(glm::dvec3(0), glm::dvec3(2))),
                                             add(tree, make_box(far, far + 2.0))}));
  const auto coarse = measure(tree, tree.root(), {.resolution = 256});
  ASSERT_TRUE(coarse.has_value());
  EXPECT_TRUE(coarse->empty);
  const auto m = measure(tree, tree.root());
  ASSERT_TRUE(m.has_value());
  EXPECT_FALSE(m->empty);
  EXPECT_LE(std::abs(m->volume - 16.0), m->volume_error);
}

TEST(Measures, VerticesOfNoTriangleReachNothing) {
  TriangleSoup pyramid;
  pyramid.positions = {{0, 0, 0},  {10, 0, 0}, {10, 10, 0}, {0, 10, 0},
                       {5, 5, 10}, {0, 0, 6},  {10, 10, 6}};
  pyramid.triangles = {{2, 1, 0}, {3, 2, 0}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  Tree tree;
  tree.set_root(tree.add(Operation::kIntersection,
                         {add(tree, pyramid), add(tree, make_box({-1, -1, 5}, {11, 11, 11}))}));
  const auto m = measure(tree, tree.root(), {.resolution = 64});
  ASSERT_TRUE(m.has_value());
  const glm::dvec3 low(2.5, 2.5, 5), high(7.5, 7.5, 10);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(m->low[axis], low[axis], 0.2);
    EXPECT_NEAR(m->high[axis], high[axis], 0.2);
    EXPECT_LE(std::abs(m->high[axis] - high[axis]), m->bounds_error);
  }
}

TEST(Measures, ResolutionGrowsWhereTheBoundIsPoor) {
  Tree ball;
  ball.set_root(add(ball, make_icosphere(5.0, 4)));
  const auto good = measure(ball, ball.root());
  ASSERT_TRUE(good.has_value());
  EXPECT_LE(good->volume_error, 0.001 * good->volume);
  Tree rough;
  std::vector<Tree::NodeId> fins;
  for (int i = 0; i < 8; ++i) {
    fins.push_back(add(rough, make_box(glm::dvec3(i, 0, 0), glm::dvec3(i + 0.037, 20, 20))));
  }
  rough.set_root(rough.add(Operation::kUnion, fins));
  const auto coarse = measure(rough, rough.root(), {.resolution = 256});
  const auto fine = measure(rough, rough.root());
  ASSERT_TRUE(coarse.has_value() && fine.has_value());
  EXPECT_GT(fine->resolution, 256);
  EXPECT_LT(fine->volume_error, 0.5 * coarse->volume_error);
  EXPECT_LE(std::abs(fine->volume - 8 * 0.037 * 400), fine->volume_error);
}

}  // namespace
}  // namespace strata::csg
