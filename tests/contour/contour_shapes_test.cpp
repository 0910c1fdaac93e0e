#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <set>

#include "strata/csg/solid_lists.h"
#include "strata/csg/tree.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "strata/voxelize/grid_fit.h"
#include "tests/contour/contour_testing.h"

namespace strata {
namespace {

using testkit::checked_contour;
using testkit::soup_of;

VoxelGrid grid_for(const TriangleSoup& mesh, int resolution, int padding = 0) {
  GridRequest request;
  request.resolution = resolution;
  request.padding = padding;
  const auto grid = fit_grid(bounds(mesh), request);
  EXPECT_TRUE(grid.has_value());
  return *grid;
}

glm::dmat4 turned() {
  glm::dmat4 m(1.0);
  const double c = std::cos(0.7), s = std::sin(0.7), d = std::cos(0.4), t = std::sin(0.4);
  m[0] = {c, s * d, s * t, 0.0};
  m[1] = {-s, c * d, c * t, 0.0};
  m[2] = {0.0, -t, d, 0.0};
  return m;
}

bool has_vertex(const SolidMesh& mesh, const glm::dvec3& wanted) {
  return std::any_of(mesh.positions.begin(), mesh.positions.end(),
                     [&](const glm::dvec3& p) { return glm::length(p - wanted) < 1e-9; });
}

TEST(ContourShapes, KeepTheLaws) {
  const TriangleSoup shapes[] = {make_uv_sphere(1.0, 24, 12), make_torus(1.0, 0.4, 24, 12),
                                 make_cylinder(0.7, 1.5, 20), make_cone(1.0, 1.3, 15),
                                 make_torus_knot(2, 3, 0.4, 80, 10)};
  for (const TriangleSoup& shape : shapes) {
    for (const int resolution : {1, 2, 7, 30, 45}) {
      for (const TriangleSoup& mesh : {shape, transform(shape, turned())}) {
        SCOPED_TRACE(::testing::Message() << shape.triangles.size() << " at " << resolution);
        checked_contour(mesh, grid_for(mesh, resolution));
        if (HasFailure()) return;
      }
    }
  }
}

TEST(ContourShapes, ReproduceTheCornersOfACube) {
  const glm::dvec3 low(3.0 + 70.0 / 256, 3.0 + 5.0 / 256, 4.0 + 200.0 / 256);
  const glm::dvec3 high(14.0 + 9.0 / 256, 12.0 + 131.0 / 256, 17.0 + 99.0 / 256);
  const VoxelGrid grid{glm::ivec3(20), glm::dvec3(0.0), glm::dvec3(1.0)};
  const SolidMesh mesh = checked_contour(make_box(low, high), grid);
  for (int c = 0; c < 8; ++c) {
    const glm::dvec3 corner((c & 1) != 0 ? high.x : low.x, (c & 2) != 0 ? high.y : low.y,
                            (c & 4) != 0 ? high.z : low.z);
    EXPECT_TRUE(has_vertex(mesh, corner)) << c;
  }
  EXPECT_LT(mesh.triangles.size(), 120u);  // of 1,300 cut edges
  const glm::dvec3 size = high - low;
  EXPECT_NEAR(signed_volume(soup_of(mesh)), size.x * size.y * size.z, 1e-6);
}

TEST(ContourShapes, HaveLongTrianglesWhereTheyAreFlat) {
  // Prisms along each axis: their ends are flat, and their sides straight along the axis.
  const TriangleSoup prism = make_cylinder(0.35, 1.0, 7);
  for (int axis = 0; axis < 3; ++axis) {
    glm::dmat4 turn(0.0);
    for (int from = 0; from < 3; ++from) turn[from][(from + axis) % 3] = 1.0;
    turn[3][3] = 1.0;
    ContourReport report;
    const TriangleSoup mesh = transform(prism, turn);
    const SolidMesh made = checked_contour(mesh, grid_for(mesh, 50), {}, &report);
    EXPECT_GT(report.merged_crossings, report.crossings * 8 / 10);
    EXPECT_LT(made.triangles.size(), report.crossings / 4);  // of 2 to 4 for each crossing
  }
}

TEST(ContourShapes, ReproduceTheCornersOfATurnedCube) {
  const TriangleSoup cube = transform(make_box(glm::dvec3(-1.0), glm::dvec3(1.0)), turned());
  const VoxelGrid grid = grid_for(cube, 40, 1);
  const SolidMesh mesh = checked_contour(cube, grid);
  const double step = grid.voxel_size.x / 256;
  int found = 0;
  for (const glm::dvec3& corner : cube.positions) {
    double nearest = 1.0;
    for (const glm::dvec3& p : mesh.positions) nearest = std::min(nearest, glm::length(p - corner));
    if (nearest < 1.74 * step) ++found;  // both are rounded, by half the diagonal of a lattice cell
    EXPECT_LT(nearest, grid.voxel_size.x);
  }
  EXPECT_GE(found, 4);  // the others lie in cells without three cut planes
  EXPECT_NEAR(signed_volume(soup_of(mesh)), 8.0, 24.0 * step);
}

TEST(ContourShapes, LieOnTheSurfaceOfABall) {
  const TriangleSoup ball = make_icosphere(1.0, 5);
  const VoxelGrid grid = grid_for(ball, 48);
  const SolidMesh mesh = checked_contour(ball, grid);
  double worst = 0.0;
  for (const glm::dvec3& p : mesh.positions) {
    worst = std::max(worst, std::abs(glm::length(p) - 1.0));
  }
  // The facets lie up to 1 - cos(0.018) below the ball; a step of the lattice is 1/256 voxel.
  EXPECT_LT(worst, 0.0005 + 2 * grid.voxel_size.x / 256);
}

TEST(ContourShapes, AreCutOffAtTheGrid) {
  const TriangleSoup ball = make_icosphere(1.0, 3);
  const VoxelGrid grid{glm::ivec3(20), glm::dvec3(-0.5, -0.4, -2.0), glm::dvec3(0.1)};
  const SolidMesh mesh = checked_contour(ball, grid);
  for (const glm::dvec3& p : mesh.positions) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GT(p[axis], grid.origin[axis] - 1e-9);
      EXPECT_LT(p[axis], grid.origin[axis] + 2.0 + 1e-9);
    }
  }
  EXPECT_FALSE(mesh.triangles.empty());
}

TEST(ContourShapes, WithVoxelsOfThreeLengths) {
  const TriangleSoup knot = make_torus_knot(2, 3, 0.4, 60, 8);
  const auto grid = fit_grid(bounds(knot), {.voxel_size = glm::dvec3(0.2, 0.33, 0.07)});
  ASSERT_TRUE(grid.has_value());
  checked_contour(knot, *grid);
}

csg::Tree at(TriangleSoup mesh, const glm::dvec3& place) {
  glm::dmat4 move(1.0);
  move[3] = glm::dvec4(place, 1.0);
  return csg::Tree(transform(mesh, move));
}

SolidMesh checked_tree(const csg::Tree& tree, int resolution, ContourReport* report = nullptr) {
  const csg::SolidLists lists(tree, tree.root());
  const auto grid = fit_grid(csg::bounds(tree), {.resolution = resolution});
  EXPECT_TRUE(grid.has_value());
  return checked_contour(lists.soup(), *grid, {.filter = &lists.unlabelled_filter()}, report);
}

TEST(ContourTrees, KeepTheLaws) {
  const TriangleSoup ball = make_icosphere(1.0, 3);
  const csg::Tree box(make_box(glm::dvec3(-0.8), glm::dvec3(0.8)));
  const csg::Tree two = at(ball, {0.3, 0.2, 0.1}) | at(ball, {-0.4, 0.3, -0.2});
  csg::Tree plate(make_box({0.0, 0.0, 0.0}, {4.0, 3.0, 0.5}));
  for (int n = 0; n < 6; ++n) {
    plate -= at(make_cylinder(0.35, 2.0, 17), {0.7 + 1.2 * (n % 3), 0.8 + 1.4 * (n / 3), -1.0});
  }
  for (const csg::Tree& tree : {box - two, box & two, two - box, box | two, plate,
                                (box & two) - at(ball, {0.0, 0.0, 1.3})}) {
    for (const int resolution : {8, 21, 40}) {
      SCOPED_TRACE(::testing::Message() << tree.nodes().size() << " nodes at " << resolution);
      ContourReport report;
      EXPECT_FALSE(checked_tree(tree, resolution, &report).triangles.empty());
      EXPECT_EQ(report.guessed_crossings, 0u);
      if (HasFailure()) return;
    }
  }
}

TEST(ContourTrees, KeepTheLawsWhereSolidsTouch) {
  const auto cube = [](double x, double y, double z) {
    return at(make_box(glm::dvec3(0.0), glm::dvec3(1.0)), {x, y, z});
  };
  const csg::Tree trees[] = {
      cube(0, 0, 0) | cube(1, 0, 0),                      // a common face
      cube(0, 0, 0) | cube(1, 1, 0),                      // a common edge
      cube(0, 0, 0) | cube(1, 1, 1),                      // a common corner
      (cube(0, 0, 0) | cube(1, 0, 0)) - cube(0.5, 0, 0),  // three common faces
      cube(0, 0, 0) - cube(0.5, 0.5, 0.5),
      (cube(0, 0, 0) | cube(0.5, 0.5, 0.5)) - cube(0.5, 0, 0)};
  for (const csg::Tree& tree : trees) {
    for (const int resolution : {2, 5, 16, 32, 37}) {
      SCOPED_TRACE(::testing::Message() << tree.nodes().size() << " nodes at " << resolution);
      EXPECT_FALSE(checked_tree(tree, resolution).triangles.empty());
      if (HasFailure()) return;
    }
  }
  EXPECT_TRUE(checked_tree(trees[0] - trees[0], 9).triangles.empty());
}

TEST(ContourTrees, OfOpenSolidsAreClosed) {  // where the axes may not agree
  TriangleSoup open = make_icosphere(1.0, 2);
  std::erase_if(open.triangles, [&](const glm::uvec3& t) { return t.x % 5 == 0; });
  const csg::Tree tree = csg::Tree(open) - at(make_icosphere(1.0, 2), {0.7, 0.4, 0.2});
  const csg::SolidLists lists(tree, tree.root());
  const auto grid = fit_grid(csg::bounds(tree), {.resolution = 30});
  ASSERT_TRUE(grid.has_value());
  const auto made = contour(lists.soup(), *grid, {.filter = &lists.unlabelled_filter()});
  ASSERT_TRUE(made.has_value());
  EXPECT_FALSE(made->mesh.triangles.empty());
  EXPECT_EQ(testkit::faults_of(made->mesh, *grid), "");
}

TEST(ContourOpenMeshes, ArePolledAsVoxelsAre) {
  TriangleSoup ball = make_icosphere(1.0, 3);
  const TriangleSoup whole = ball;
  std::erase_if(ball.triangles,
                [&](const glm::uvec3& t) { return ball.positions[t.x].z > 0.75 || t.x % 37 == 0; });
  ASSERT_LT(ball.triangles.size(), whole.triangles.size());
  for (const int resolution : {9, 33}) {
    ContourReport report;
    const SolidMesh mesh = checked_contour(ball, grid_for(whole, resolution), {}, &report);
    EXPECT_FALSE(report.closed);
    EXPECT_GT(mesh.triangles.size(), 100u);
  }
  const auto refused = contour(ball, grid_for(whole, 9), {.open = OpenMode::kFail});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kGeometry);
}

TEST(ContourThinWalls, VanishAndAreCounted) {
  TriangleSoup plate = make_box({1.0, 1.0, 3.6}, {7.0, 7.0, 3.9});  // between centres at 3.5, 4.5
  const VoxelGrid grid{glm::ivec3(8), glm::dvec3(0.0), glm::dvec3(1.0)};
  ContourReport report;
  EXPECT_TRUE(checked_contour(plate, grid, {}, &report).triangles.empty());
  EXPECT_EQ(report.lost_crossings, 36u);
  append(plate, make_box({2.0, 2.0, 1.0}, {6.0, 6.0, 7.0}));
  EXPECT_FALSE(checked_contour(plate, grid, {}, &report).triangles.empty());
  EXPECT_EQ(report.lost_crossings, 20u);
}

TEST(ContourNothing, IsAnEmptyMesh) {
  const VoxelGrid grid{glm::ivec3(3), glm::dvec3(10.0), glm::dvec3(1.0)};
  const SolidMesh mesh = checked_contour(make_box(glm::dvec3(0.0), glm::dvec3(1.0)), grid);
  EXPECT_TRUE(mesh.positions.empty());
  EXPECT_TRUE(mesh.parts.empty());
}

TEST(ContourErrors, NameWhatIsWrong) {
  const TriangleSoup ball = make_icosphere(1.0, 4);
  const VoxelGrid grid = grid_for(ball, 64);
  const auto code = [](const Result<ContourMesh>& made) {
    return made ? ErrorCode::kInternal : made.error().code;
  };
  EXPECT_EQ(code(contour(ball, grid, {.open = OpenMode::kSurface})), ErrorCode::kUsage);
  EXPECT_EQ(code(contour(ball, {glm::ivec3(0), glm::dvec3(0.0), glm::dvec3(1.0)})),
            ErrorCode::kUsage);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(code(contour(ball, grid, {}, {.stop = stop.get_token()})), ErrorCode::kCancelled);
  // Any limit either suffices or is named.
  const auto whole = contour(ball, grid);
  ASSERT_TRUE(whole.has_value());
  int refused = 0;
  for (std::uint64_t limit = 1000; limit < 100'000'000; limit *= 2) {
    const auto made = contour(ball, grid, {}, {.memory_limit = limit});
    if (made) {
      EXPECT_EQ(made->mesh.positions, whole->mesh.positions);
      continue;
    }
    ++refused;
    EXPECT_EQ(made.error().code, ErrorCode::kLimit);
    EXPECT_NE(made.error().message.find(std::to_string(limit)), std::string::npos);
  }
  EXPECT_GT(refused, 5);
  EXPECT_LT(refused, 17);
}

TEST(ContourProgress, RisesToOne) {
  const TriangleSoup ball = make_icosphere(1.0, 4);
  std::vector<double> seen;
  Execution execution;
  execution.progress = [&](double done) { seen.push_back(done); };
  ASSERT_TRUE(contour(ball, grid_for(ball, 150), {}, execution).has_value());
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_EQ(seen.back(), 1.0);
}

}  // namespace
}  // namespace strata
