// Laws L5 and L6 of boundary meshes: volumes, areas, centres and boxes.

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <string>

#include "tests/csg/boundary/boundary_laws.h"
#include "tests/csg/boundary/convex_volume.h"

namespace strata::csg {
namespace {

using exact::Fraction;

// From the low corner of a cell to a point of it that lies on no diagonal of a side of a tiny box.
const glm::dvec3 kOffCentre(0.5, 433.0 / 1024, 359.0 / 1024);

TEST(MeasureLaws, TheOraclesOfVolumesAgree) {
  for_random_trees(600000, 20, 2, TinyKind::kBoxes, [&](const Tree& tree, TinyTrees&) {
    if (tree.solids().size() > 6) return;
    const TreeOracle oracle(tree);
    int cells = 0;
    for (int i = 0; i < 512; ++i) {
      const auto inside = oracle.at(glm::dvec3(i % 8, i / 8 % 8, i / 64) + kOffCentre);
      ASSERT_TRUE(inside.has_value());
      cells += *inside;
    }
    ASSERT_EQ(convex_volume(tree), cells);
  });
}

TEST(MeasureLaws, VolumesAreExact) {
  int volumes = 0, fractions = 0;
  for_random_trees(610000, 80, 3, TinyKind::kConvex, [&](const Tree& tree, TinyTrees&) {
    if (tree.solids().size() > 6) return;
    const Fraction volume = convex_volume(tree);
    const ExactMeasures measures = measures_of(tree | tiny_frame());
    ASSERT_TRUE(exact::is_nearest(measures.volume, Fraction(volume + 2)))
        << measures.volume - 2 << " is not " << volume;
    ++volumes;
    fractions += denominator(volume) > 6;
  });
  EXPECT_GT(volumes, 50);
  EXPECT_GT(fractions, 8);
}

TEST(MeasureLaws, VolumesOfBoxesAreCounts) {
  for_random_trees(620000, 100, 6, TinyKind::kBoxes, [&](const Tree& tree, TinyTrees&) {
    const TreeOracle oracle(tree);
    int cells = 0;
    for (int i = 0; i < 512; ++i) {
      cells += *oracle.at(glm::dvec3(i % 8, i / 8 % 8, i / 64) + kOffCentre);
    }
    ASSERT_EQ(measures_of(tree | tiny_frame()).volume, cells + 2);
  });
}

TEST(MeasureLaws, MeasuresAddUpAndAreThoseOfTheMesh) {
  for (int i = 0; i < rounds(50); ++i) {
    TinyTrees trees(static_cast<std::uint64_t>(630000 + i));
    SCOPED_TRACE("seed " + std::to_string(630000 + i));
    const Tree a = trees.tree(2, TinyKind::kAny), b = trees.tree(2, TinyKind::kAny);
    const auto volume = [](const Tree& tree) {
      return measures_of(tree | tiny_frame()).volume - 2;
    };
    ASSERT_NEAR(volume(a) + volume(b), volume(a | b) + volume(a & b), 1e-11);
    ASSERT_NEAR(volume(a), volume(a - b) + volume(a & b), 1e-11);
    const Tree all = a | b | tiny_frame();
    const SolidMesh mesh = mesh_of(all);
    const ExactMeasures measures = measures_of(all);
    double six = 0, area = 0;
    Bounds box;
    glm::dvec3 moment(0);
    for (const glm::uvec3& t : mesh.triangles) {
      const glm::dvec3 &p = mesh.positions[t.x], &q = mesh.positions[t.y], &r = mesh.positions[t.z];
      const double d = glm::dot(p, glm::cross(q, r));
      six += d;
      moment += d / 24 * (p + q + r);
      area += glm::length(glm::cross(q - p, r - p)) / 2;
      for (const glm::dvec3& v : {p, q, r}) box.include(v);
    }
    ASSERT_NEAR(measures.volume, six / 6, 1e-6);
    ASSERT_NEAR(measures.area, area, 1e-6);
    ASSERT_LT(glm::length(measures.centre - moment / (six / 6)), 1e-6);
    ASSERT_LT(glm::length(measures.low - box.low) + glm::length(measures.high - box.high), 1e-8);
    ASSERT_FALSE(measures.empty);
  }
}

}  // namespace
}  // namespace strata::csg
