#include "csg/measure/tree_rays.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <memory>
#include <numbers>
#include <random>

#include "csg/measure/snap_points.h"
#include "strata/csg/picture/picture.h"
#include "strata/mesh/shapes.h"

namespace strata::csg {
namespace {

Tree solid(TriangleSoup mesh, const glm::dmat4& place = glm::dmat4(1)) {
  return Tree(Solid{std::make_shared<TriangleSoup>(std::move(mesh)), place});
}
Tree box(const glm::dvec3& low, const glm::dvec3& high) { return solid(make_box(low, high)); }

TreeRays rays_of(const Tree& tree) { return {tree, tree.root(), 0.0}; }

TEST(TreeRays, MaterialEndsWhereTheResultIsLeft) {
  // A box of 10 x 10 x 10 with a slot from z = 4 to 6.
  const Tree tree = box(glm::dvec3(0), glm::dvec3(10)) - box({-1, 2, 4}, {11, 8, 6});
  const TreeRays rays = rays_of(tree);
  EXPECT_NEAR(rays.thickness({5, 5, 0}, {0, 0, 1}), 4, 1e-12);
  EXPECT_NEAR(rays.thickness({5, 5, 10}, {0, 0, -1}), 4, 1e-12);
  EXPECT_NEAR(rays.thickness({5, 5, 6}, {0, 0, 1}), 4, 1e-12);
  EXPECT_NEAR(rays.thickness({5, 1, 0}, {0, 0, 1}), 10, 1e-12);
  EXPECT_NEAR(rays.thickness({5, 5, 3}, {0, 0, 1}), 1, 1e-12);  // from within
  EXPECT_EQ(rays.thickness({5, 5, 5}, {0, 0, 1}), 0);           // air
  EXPECT_EQ(rays.thickness({5, 5, 10}, {0, 0, 1}), 0);          // outwards
  const glm::dvec3 slant = glm::normalize(glm::dvec3(0, 1, 2));
  EXPECT_NEAR(rays.thickness({5, 4, 0}, slant), 4 * std::sqrt(5.0) / 2, 1e-12);
}

TEST(TreeRays, FacesThatCoincideMakeNoWalls) {
  Tree tree = box(glm::dvec3(0), glm::dvec3(10)) | box({0, 0, 10}, {10, 10, 13});
  EXPECT_NEAR(rays_of(tree).thickness({5, 5, 0}, {0, 0, 1}), 13, 1e-12);
  tree -= box({2, 2, 7}, {8, 8, 13});  // flush with the top
  EXPECT_NEAR(rays_of(tree).thickness({5, 5, 0}, {0, 0, 1}), 7, 1e-12);
  EXPECT_EQ(rays_of(tree).thickness({5, 5, 13}, {0, 0, -1}), 0);
}

TEST(TreeRays, LinesThroughEdgesAndCornersMeetTheSurfaceOnce) {
  const TriangleSoup ball = make_uv_sphere(3, 24, 12);
  const TreeRays rays = rays_of(solid(ball));
  int inside = 0;
  for (const glm::dvec3& p : ball.positions) {
    // From the middle through each vertex and through the middle of each edge.
    EXPECT_NEAR(rays.thickness({0, 0, 0}, glm::normalize(p)), 3, 1e-9);
    ++inside;
  }
  for (const glm::uvec3& t : ball.triangles) {
    const glm::dvec3 middle = (ball.positions[t.x] + ball.positions[t.y]) * 0.5;
    EXPECT_NEAR(rays.thickness({0, 0, 0}, glm::normalize(middle)), glm::length(middle), 1e-9);
  }
  EXPECT_GT(inside, 200);
}

TEST(TreeRays, AgreeWithTheClosedFormOfABallWithABoreOnRandomLines) {
  std::mt19937 random(11);
  std::normal_distribution<double> any;
  const Tree tree = solid(make_icosphere(5, 6)) - solid(make_icosphere(2, 6));
  const TreeRays rays = rays_of(tree);
  for (int i = 0; i < 500; ++i) {
    const glm::dvec3 out = glm::normalize(glm::dvec3(any(random), any(random), any(random)));
    EXPECT_NEAR(rays.thickness(out * 4.0, -out), 2, 2e-3);
    EXPECT_NEAR(rays.thickness(out * 4.0, out), 1, 2e-3);
  }
}

TEST(TreeRays, TakeOverSortedTrianglesOfTheSameMeshes) {
  const Tree plate = box(glm::dvec3(0), glm::dvec3(10));
  const TreeRays before = rays_of(plate);
  const Tree cut = plate - box({-1, -1, 6}, {11, 11, 11});
  const TreeRays after(cut, cut.root(), 0.0, {}, &before);
  EXPECT_NEAR(after.thickness({5, 5, 0}, {0, 0, 1}), 6, 1e-12);
  const Tree moved = transform(glm::translate(glm::dmat4(1), glm::dvec3(0, 0, 2)), plate);
  const TreeRays elsewhere(moved, moved.root(), 0.0, {}, &before);
  EXPECT_NEAR(elsewhere.thickness({5, 5, 2}, {0, 0, 1}), 10, 1e-12);
}

/// The map of a slanted wall in a picture. @param least  pixels that must have its thickness
void expect_walls(Tree tree, Projection projection, double wall, std::size_t least) {
  Camera camera;
  camera.projection = projection;
  camera.rotation = {50, 0, 30};
  Preview preview(tree);
  fit_camera(camera, {{-20, -15, 0}, {20, 15, 2}}, 4.0 / 3.0);
  const View view = *preview.view(camera, {160, 120});
  const SurfaceImage image = **preview.draw(view);
  const auto map = rays_of(tree).wall_image(view, image);
  ASSERT_TRUE(map);
  std::size_t right = 0, covered = 0;
  for (std::size_t i = 0; i < map->size(); ++i) {
    if (image.depth[i] == SurfaceImage::kNone) {
      EXPECT_EQ((*map)[i], 0.0f);
      continue;
    }
    ++covered;
    EXPECT_GT((*map)[i], 0.0f) << i;
    right += std::abs(static_cast<double>((*map)[i]) - wall) < 1e-5 ? 1 : 0;
  }
  EXPECT_GE(right, least);
  EXPECT_GT(covered, right);  // its sides are longer
}

TEST(TreeRays, AWallSeenAtASlantIsAsThickAsItIs) {
  const Tree plate = box({-20, -15, 0}, {20, 15, 2});
  for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
    expect_walls(plate, projection, 2, 1500);
    expect_walls(plate - box({-50, -50, -50}, {50, -5, 50}), projection, 2, 800);
  }
}

TEST(SnapPoints, AreCornersMidpointsAndWhereEdgesPierce) {
  const Tree tree = box(glm::dvec3(0), glm::dvec3(10)) - box({4, 4, 5}, {6, 6, 11});
  const TreeRays rays = rays_of(tree);
  const auto has = [](const std::vector<SnapPoint>& points, Snap kind, const glm::dvec3& at) {
    for (const SnapPoint& one : points) {
      if (one.kind == kind && glm::distance(one.at, at) < 1e-9) return true;
    }
    return false;
  };
  EXPECT_TRUE(has(snap_points(rays, {0.2, 0.1, 10}, 0.5), Snap::kVertex, {0, 0, 10}));
  EXPECT_TRUE(has(snap_points(rays, {5.1, 0.1, 10}, 0.5), Snap::kMidpoint, {5, 0, 10}));
  EXPECT_TRUE(has(snap_points(rays, {2.5, 0.1, 10}, 0.5), Snap::kEdge, {2.5, 0, 10}));
  // The edge of the pocket pierces the top; a side of it meets the top in a line.
  EXPECT_TRUE(has(snap_points(rays, {3.9, 3.9, 10}, 0.3), Snap::kVertex, {4, 4, 10}));
  EXPECT_TRUE(has(snap_points(rays, {5, 3.9, 10}, 0.3), Snap::kEdge, {5, 4, 10}));
  // Nothing in the middle of a face, where only a diagonal runs.
  EXPECT_TRUE(snap_points(rays, {0, 5, 5}, 0.5).empty());
}

}  // namespace
}  // namespace strata::csg
