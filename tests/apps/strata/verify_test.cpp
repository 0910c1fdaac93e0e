// The oracle: Strata's Booleans against CGAL's exact ones, and whether it would notice.

#include "apps/verify/comparison.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <glm/ext/matrix_transform.hpp>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "strata/csg/scene/scene.h"
#include "strata/mesh/shapes.h"
#include "tests/apps/strata/run_tool.h"

namespace strata::apps {
namespace {

using csg::Operation;
using csg::Tree;
using testkit::Workplace;

csg::Scene parse(const std::string& text) {
  auto scene = csg::parse_scene(text, "test.csg");
  EXPECT_TRUE(scene.has_value()) << (scene ? "" : scene.error().message);
  return scene ? std::move(*scene) : csg::Scene{};
}

VerifyOptions coarse() {
  VerifyOptions options;
  options.resolution = 16;
  options.measure_resolution = 128;
  options.points = 300;
  return options;
}

/// Expects that both agree; gives what was found for more.
Verification agreement(const Tree& tree, const VerifyOptions& options = coarse()) {
  const auto found = verify(tree, tree, options);
  EXPECT_TRUE(found.has_value()) << (found ? "" : found.error().message);
  if (!found) return {};
  EXPECT_TRUE(found->volume.within()) << found->volume.lists << " " << found->volume.exact;
  EXPECT_TRUE(found->area.within()) << found->area.lists << " " << found->area.exact;
  EXPECT_EQ(found->voxels.wrong, 0u) << "of " << found->voxels.compared;
  EXPECT_EQ(found->points.wrong, 0u) << "of " << found->points.compared;
  EXPECT_TRUE(found->snapped.equal) << found->snapped.boundary << " " << found->snapped.exact;
  if (found->voxels.compared > 0) {  // volumes as fractions, of the same snapped solids
    EXPECT_TRUE(found->snapped.compared) << found->snapped.reason;
  }
  return *found;
}
Verification agreement(const std::string& text, const VerifyOptions& options = coarse()) {
  return agreement(parse(text).tree, options);
}

/// A box as a solid of its own.
Tree::NodeId add_box(Tree& tree, const glm::dvec3& low, const glm::dvec3& high,
                     const glm::dmat4& place = glm::dmat4(1.0)) {
  return tree.add_solid({.mesh = std::make_shared<const TriangleSoup>(make_box(low, high)),
                         .world_from_mesh = place});
}

TEST(Verify, DrilledSphere) {
  const Verification found = agreement(R"(difference() {
    sphere($fn = 24, $fa = 12, $fs = 2, r = 10);
    cylinder($fn = 16, $fa = 12, $fs = 2, h = 30, r1 = 4, r2 = 4, center = true);
    multmatrix([[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])
      cylinder($fn = 16, $fa = 12, $fs = 2, h = 30, r1 = 4, r2 = 4, center = true);
  })");
  EXPECT_GT(found.voxels.inside, 500u);
  EXPECT_GT(found.points.inside, 50u);
  EXPECT_EQ(found.exact.corefinements, 2u);
  EXPECT_EQ(found.exact.nef_operations, 0u);
}

TEST(Verify, CubesThatShareFaces) {
  // Volumes: a corner, two corners and a half taken from a cube of 1000.
  const std::pair<glm::dvec3, glm::dvec3> cases[] = {
      {{0, 0, 0}, {5, 5, 5}}, {{0, 2, 0}, {10, 8, 5}}, {{0, 0, 0}, {10, 10, 5}}};
  for (const auto& [low, high] : cases) {
    Tree tree;
    const auto whole = add_box(tree, {0, 0, 0}, {10, 10, 10});
    const auto part = add_box(tree, low, high);
    tree.set_root(tree.add(Operation::kDifference, {whole, part}));
    const glm::dvec3 size = high - low;
    EXPECT_NEAR(agreement(tree).volume.exact, 1000 - size.x * size.y * size.z, 1e-9);
  }
}

TEST(Verify, StackedAndTouchingCubes) {
  Tree stacked;
  std::vector<Tree::NodeId> boxes;
  for (int i = 0; i < 4; ++i) boxes.push_back(add_box(stacked, {0, 0, i}, {1, 1, i + 1}));
  stacked.set_root(stacked.add(Operation::kUnion, boxes));
  EXPECT_NEAR(agreement(stacked).area.exact, 18, 1e-9);
}

TEST(Verify, NefPolyhedraWhereNoManifoldComesOut) {
  // Two cubes that share an edge, and one is taken from what holds both.
  Tree tree;
  const auto a = add_box(tree, {0, 0, 0}, {1, 1, 1});
  const auto b = add_box(tree, {1, 1, 0}, {2, 2, 1});
  const auto both = tree.add(Operation::kUnion, {a, b});
  const auto lid = add_box(tree, {0, 0, 0.75}, {2, 2, 2});
  tree.set_root(tree.add(Operation::kDifference, {both, lid}));
  const Verification found = agreement(tree);
  EXPECT_GT(found.exact.nef_operations, 0u);
  EXPECT_NEAR(found.volume.exact, 1.5, 1e-9);
}

TEST(Verify, NestedDifferences) {
  Tree tree;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Tree::NodeId> boxes;
  for (int i = 0; i < 6; ++i) {
    glm::dmat4 place = glm::translate(
        glm::dmat4(1.0), 0.4 * glm::dvec3(uniform(random), uniform(random), uniform(random)));
    place = glm::rotate(place, 3.0 * uniform(random),
                        glm::dvec3(uniform(random), uniform(random), 1.5));
    boxes.push_back(add_box(tree, glm::dvec3(-1), glm::dvec3(1), place));
  }
  Tree::NodeId root = boxes.back();
  for (std::size_t i = boxes.size() - 1; i-- > 0;) {
    root = tree.add(Operation::kDifference, {boxes[i], root});
  }
  tree.set_root(root);
  VerifyOptions options = coarse();
  options.resolution = 16;
  EXPECT_GT(agreement(tree, options).voxels.inside, 50u);
}

TEST(Verify, MirroredSolids) {
  Tree tree;
  glm::dmat4 mirror(1.0);
  mirror[0][0] = -1;
  const auto cone = std::make_shared<const TriangleSoup>(make_cone(4.0, 6.0, 12));
  const auto shifted = glm::translate(glm::dmat4(1.0), glm::dvec3(3, 1, 0));
  const auto a = tree.add_solid({.mesh = cone, .world_from_mesh = shifted});
  const auto b = tree.add_solid({.mesh = cone, .world_from_mesh = mirror * shifted});
  tree.set_root(tree.add(Operation::kIntersection, {a, b}));
  EXPECT_GT(agreement(tree).volume.exact, 1.0);
}

TEST(Verify, ComponentsOfOneMeshAreUnited) {
  TriangleSoup two = make_icosphere(1.0, 2);
  append(two, transform(make_icosphere(1.0, 2),
                        glm::translate(glm::dmat4(1.0), glm::dvec3(1.1, 0.2, 0.1))));
  Tree tree;
  tree.set_root(tree.add_solid({.mesh = std::make_shared<const TriangleSoup>(two)}));
  const Verification found = agreement(tree);
  EXPECT_EQ(found.exact.corefinements, 1u);
}

TEST(Verify, NothingIsNothing) {
  Tree tree;
  EXPECT_TRUE(agreement(tree).agrees());
  const auto a = add_box(tree, {0, 0, 0}, {1, 1, 1});
  const auto b = add_box(tree, {0, 0, 0}, {1, 1, 1});
  tree.set_root(tree.add(Operation::kDifference, {a, b}));
  EXPECT_EQ(agreement(tree).volume.exact, 0);
}

TEST(Verify, RandomTreesOfRandomSolids) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto ball = std::make_shared<const TriangleSoup>(make_icosphere(0.8, 1));
  const auto box =
      std::make_shared<const TriangleSoup>(make_box(glm::dvec3(-0.6), glm::dvec3(0.6)));
  const auto ring = std::make_shared<const TriangleSoup>(make_torus(0.7, 0.25, 9, 6));
  VerifyOptions options = coarse();
  options.resolution = 14;
  options.points = 150;
  for (int round = 0; round < 12; ++round) {
    SCOPED_TRACE(round);
    Tree tree;
    std::vector<Tree::NodeId> nodes;
    for (int i = 0; i < 6; ++i) {
      glm::dmat4 place = glm::translate(
          glm::dmat4(1.0), 0.6 * glm::dvec3(uniform(random), uniform(random), uniform(random)));
      place = glm::rotate(place, 3.0 * uniform(random),
                          glm::dvec3(uniform(random), uniform(random), 1.5));
      nodes.push_back(tree.add_solid({.mesh = i % 3 == 0   ? ball
                                              : i % 3 == 1 ? box
                                                           : ring,
                                      .world_from_mesh = place}));
    }
    while (nodes.size() > 1) {
      const auto first = static_cast<std::ptrdiff_t>(random() % (nodes.size() - 1));
      const Operation operations[] = {Operation::kUnion, Operation::kDifference,
                                      Operation::kIntersection, Operation::kUnion};
      const auto one = nodes.begin() + first;
      *one = tree.add(operations[random() % 4], {*one, *(one + 1)});
      nodes.erase(one + 1);
    }
    tree.set_root(nodes.front());
    agreement(tree, options);
  }
}

TEST(Verify, NoticesAnotherSolid) {
  Tree one, other;
  one.set_root(add_box(one, {0, 0, 0}, {10, 10, 10}));
  // A twentieth of it longer, a dent, and the same volume elsewhere.
  other.set_root(add_box(other, {0, 0, 0}, {10, 10, 10.5}));
  VerifyOptions options = coarse();
  options.measure_resolution = 256;
  auto found = verify(one, other, options);
  ASSERT_TRUE(found.has_value()) << found.error().message;
  EXPECT_FALSE(found->agrees());
  EXPECT_FALSE(found->volume.within());
  EXPECT_GT(found->voxels.wrong, 0u);
  EXPECT_GT(found->points.wrong, 0u);
  ASSERT_FALSE(found->points.examples.empty());
  EXPECT_TRUE(found->points.examples.front().inside);
  EXPECT_FALSE(found->snapped.compared);

  Tree dented;
  const auto whole = add_box(dented, {0, 0, 0}, {10, 10, 10});
  const auto dent = add_box(dented, {4, 4, 9}, {6, 6, 11});
  dented.set_root(dented.add(Operation::kDifference, {whole, dent}));
  found = verify(one, dented, coarse());
  ASSERT_TRUE(found.has_value()) << found.error().message;
  EXPECT_FALSE(found->agrees());

  Tree moved;
  moved.set_root(add_box(moved, {1, 0, 0}, {11, 10, 10}));
  found = verify(one, moved, coarse());
  ASSERT_TRUE(found.has_value()) << found.error().message;
  EXPECT_TRUE(found->volume.within());
  EXPECT_FALSE(found->agrees());
}

TEST(Verify, NamesTheSolidThatCgalCannotTake) {
  TriangleSoup open = make_box({0, 0, 0}, {1, 1, 1});
  open.triangles.pop_back();
  Tree tree;
  tree.set_root(tree.add_solid(
      {.mesh = std::make_shared<const TriangleSoup>(open), .name = "box at scene.csg:3:1"}));
  const auto found = verify(tree, tree, coarse());
  ASSERT_FALSE(found.has_value());
  EXPECT_EQ(found.error().code, ErrorCode::kGeometry);
  EXPECT_EQ(found.error().message, "box at scene.csg:3:1: CGAL cannot process it: it is open");
}

/// A plate with ten holes, as many mechanical parts have.
std::string plate_with_holes() {
  std::string holes;
  for (int i = 0; i < 10; ++i) {
    holes += fmt::format(
        "multmatrix([[1, 0, 0, {}], [0, 1, 0, {}], [0, 0, 1, 0], [0, 0, 0, 1]]) cylinder($fn = 32, "
        "h = 10, r1 = 8.75, r2 = 8.75, center = true);\n",
        25.0 * (i % 4) - 37.5, 25.0 * (i / 4) - 37.5);
  }
  return "difference() { cube([100, 100, 5], center = true); " + holes + "}";
}

/// A plate minus double-D holes, each of them a cylinder and a cube.
std::string double_d_holes() {
  std::string holes;
  for (int i = 0; i < 4; ++i) {
    holes += fmt::format(
        "multmatrix([[1, 0, 0, {}], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) intersection() {{ "
        "cylinder($fn = 64, h = 10, r1 = 6, r2 = 6, center = true); cube([20, 9, 11], center = "
        "true); }}\n",
        8 + 20 * i);
  }
  return "difference() { multmatrix([[1, 0, 0, -5], [0, 1, 0, -10], [0, 0, 1, -1], [0, 0, 0, 1]]) "
         "cube([90, 20, 3]); " +
         holes + "}";
}

TEST(Verify, ScenesOfTheBenchmarks) {
  VerifyOptions options = coarse();
  options.points = 200;
  const std::string coincident =
      "difference() { cube([20, 20, 20], center = true); "
      "cylinder($fn = 64, h = 20, r1 = 6, r2 = 6, center = true); }";
  for (const std::string& text :
       {std::string("cube([1, 1, 1]);"), plate_with_holes(), coincident, double_d_holes()}) {
    SCOPED_TRACE(text);
    agreement(parse(text).tree, options);
  }
}

// --- the program --------------------------------------------------------------------------------

constexpr const char* kCube = "cube(size = [10, 10, 10], center = false);\n";
constexpr const char* kNotched = R"(difference() {
  cube(size = [10, 10, 10], center = false);
  cube(size = [5, 5, 5], center = true);
})";

TEST(VerifyTool, AgreementIsCode0) {
  const Workplace place;
  place.write("notched.csg", kNotched);
  const auto run = place.run({"notched.csg", "--resolution", "16", "--points", "100"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("volume"), std::string::npos);
  EXPECT_EQ(run.out.find("OUTSIDE"), std::string::npos);
  EXPECT_NE(run.out.find("equal as fractions"), std::string::npos) << run.out;
  EXPECT_EQ(run.out.find("NOT EQUAL"), std::string::npos);
  EXPECT_EQ(run.err, "");
}

TEST(VerifyTool, DifferenceIsCode7) {
  const Workplace place;
  place.write("cube.csg", kCube);
  place.write("notched.csg", kNotched);
  const auto run = place.run(
      {"cube.csg", "--against", "notched.csg", "--resolution", "16", "--points", "100", "--json"});
  EXPECT_EQ(run.exit_code, 7);
  EXPECT_NE(run.out.find("\"agrees\": false"), std::string::npos) << run.out;
  EXPECT_NE(run.err.find("differ"), std::string::npos);
}

TEST(VerifyTool, MeshesUnderAnExpression) {
  const Workplace place;
  const std::string data = STRATA_SOURCE_DIR "/data/";
  const auto run = place.run({data + "torus.obj", data + "two_spheres.stl", "--expr",
                              "torus - two_spheres", "--resolution", "16", "--points", "50"});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
}

TEST(VerifyTool, MistakesAreCode2And3And5) {
  const Workplace place;
  place.write("cube.csg", kCube);
  EXPECT_EQ(place.run({}).exit_code, 2);
  EXPECT_EQ(place.run({"cube.csg", "--resolution", "0"}).exit_code, 2);
  EXPECT_EQ(place.run({"cube.csg", "--expr", "a -"}).exit_code, 2);
  EXPECT_EQ(place.run({"no_such.csg"}).exit_code, 3);
  EXPECT_EQ(place.run({STRATA_SOURCE_DIR "/data/open_sphere.off"}).exit_code, 5);
}

}  // namespace
}  // namespace strata::apps
