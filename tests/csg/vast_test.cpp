// Solids that are far larger than what they are combined with.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/ext/matrix_transform.hpp>
#include <glm/trigonometric.hpp>
#include <memory>

#include "csg/geometry.h"
#include "csg/measure/result_bounds.h"
#include "strata/csg/measure/measure.h"
#include "strata/csg/picture/picture.h"
#include "strata/csg/solid_lists.h"
#include "strata/mesh/shapes.h"
#include "strata/voxelize/grid_fit.h"
#include "strata/voxelize/voxelize.h"

namespace strata::csg {
namespace {

using NodeId = Tree::NodeId;

NodeId add(Tree& tree, TriangleSoup mesh, const glm::dmat4& place = glm::dmat4(1.0)) {
  Solid solid;
  solid.mesh = std::make_shared<const TriangleSoup>(std::move(mesh));
  solid.world_from_mesh = place;
  return tree.add_solid(std::move(solid));
}
NodeId add_box(Tree& tree, const glm::dvec3& low, const glm::dvec3& high) {
  return add(tree, make_box(low, high));
}
NodeId add_ball(Tree& tree, double radius = 5) { return add(tree, make_uv_sphere(radius, 32, 16)); }

/// All voxels of a tree's result, as intervals along an axis.
std::vector<std::vector<std::pair<int, int>>> voxels_of(const Tree& tree, const VoxelGrid& grid,
                                                        Axis axis = Axis::kZ,
                                                        bool surface = false) {
  SolidLists lists(tree, tree.root());
  EXPECT_TRUE(lists.fit(grid).has_value());
  VoxelizeOptions options;
  options.filter = &lists.filter();
  options.axis = axis;
  options.solid = !surface;
  options.surface = surface;
  const auto intervals = voxelize(lists.soup(), grid, options);
  EXPECT_TRUE(intervals.has_value()) << intervals.error().message;
  std::vector<std::vector<std::pair<int, int>>> columns;
  if (!intervals) return columns;
  const AxisFrame frame(axis);
  for (int v = 0; v < grid.dims[frame.v]; ++v) {
    for (int u = 0; u < grid.dims[frame.u]; ++u) {
      auto& column = columns.emplace_back();
      for (const Interval& i : intervals->column(u, v)) column.emplace_back(i.begin(), i.end());
    }
  }
  return columns;
}

std::uint64_t count(const std::vector<std::vector<std::pair<int, int>>>& columns) {
  std::uint64_t sum = 0;
  for (const auto& column : columns) {
    for (const auto& [begin, end] : column) sum += static_cast<std::uint64_t>(end - begin);
  }
  return sum;
}

VoxelGrid grid_of(const Tree& tree, int resolution) {
  GridRequest request;
  request.resolution = resolution;
  const auto grid = fit_grid(bounds(tree, tree.root()), request);
  EXPECT_TRUE(grid.has_value()) << grid.error().message;
  return grid ? *grid : VoxelGrid{};
}

constexpr double kSizes[] = {1e4, 1e10, 1e20, 1e100, 1e200};

/// A ball and a cube of some size with a corner in its middle.
Tree cut_ball(double size, Operation operation) {
  Tree tree;
  const NodeId ball = add_ball(tree);
  tree.set_root(tree.add(operation, {ball, add_box(tree, glm::dvec3(0.0), glm::dvec3(size))}));
  return tree;
}

TEST(Vast, CuttersOfAnySizeGiveTheSameVoxels) {
  for (const Operation operation : {Operation::kDifference, Operation::kIntersection}) {
    const Tree plain = cut_ball(20, operation);
    const VoxelGrid grid = grid_of(plain, 100);
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      for (const bool surface : {false, true}) {
        const auto expected = voxels_of(plain, grid, axis, surface);
        ASSERT_GT(count(expected), 10000u);
        for (const double size : kSizes) {
          SCOPED_TRACE(size);
          const Tree vast = cut_ball(size, operation);
          EXPECT_EQ(grid_of(vast, 100), grid);
          EXPECT_EQ(voxels_of(vast, grid, axis, surface), expected);
        }
      }
    }
  }
}

TEST(Vast, MeasuresAreThoseOfWhatIsLeft) {
  const auto plain = measure(cut_ball(20, Operation::kDifference), 2, {.resolution = 256});
  ASSERT_TRUE(plain.has_value());
  EXPECT_NEAR(plain->volume, 450.84, 0.5);  // 7/8 of a ball of 32 x 16 sides
  for (const double size : kSizes) {
    SCOPED_TRACE(size);
    const auto vast = measure(cut_ball(size, Operation::kDifference), 2, {.resolution = 256});
    ASSERT_TRUE(vast.has_value()) << vast.error().message;
    EXPECT_EQ(vast->volume, plain->volume);
    EXPECT_NEAR(vast->area, plain->area, 1e-9 * plain->area);
    EXPECT_EQ(vast->low, plain->low);
    EXPECT_EQ(vast->centre, plain->centre);
  }
}

/// Pixels that differ.
std::size_t differences(const Picture& a, const Picture& b) {
  EXPECT_EQ(a.pixels.size(), b.pixels.size());
  std::size_t differ = 0;
  for (std::size_t i = 0; i < std::min(a.pixels.size(), b.pixels.size()); ++i) {
    differ += a.pixels[i] != b.pixels[i] ? 1 : 0;
  }
  return differ;
}

/// A colour for each face: what is near it does not count.
const PictureOptions kSurfacesAlone{.backdrop = {}, .crease = 0.0, .occlusion = false};

Picture draw(const Tree& tree, double distance, Projection projection) {
  Preview preview(tree, {}, 5e-6);
  Camera camera;
  camera.projection = projection;
  camera.distance = distance;
  camera.rotation = {55, 0, 155};  // onto the cut
  const auto picture = preview.picture(camera, {200, 160}, kSurfacesAlone);
  EXPECT_TRUE(picture.has_value()) << picture.error().message;
  if (!picture) return {};
  EXPECT_GT(preview.report().covered, 3000u);
  return *picture;
}

TEST(Vast, PicturesAreThoseOfAnOrdinaryCutter) {
  for (const Operation operation : {Operation::kDifference, Operation::kIntersection}) {
    for (const Projection projection : {Projection::kPerspective, Projection::kOrthographic}) {
      const Picture plain = draw(cut_ball(20, operation), 40, projection);
      for (const double size : kSizes) {
        SCOPED_TRACE(size);
        // Vertices elsewhere are rounded elsewhere: an edge may move by 1/256 of a pixel.
        EXPECT_LE(differences(draw(cut_ball(size, operation), 40, projection), plain), 8u);
      }
    }
  }
}

/// A half space below a plane through the origin, of a cube of some size that stands on a corner.
glm::dmat4 tilted(double size) {
  glm::dmat4 place = glm::rotate(glm::dmat4(1.0), glm::radians(33.0), glm::dvec3(1, 2, 0.5));
  return glm::translate(place, glm::dvec3(-size / 2, -size / 2, 0));
}

TEST(Vast, TiltedHalfSpacesCutWhereTheyStand) {
  const auto cut = [](double size) {
    Tree tree;
    const NodeId ball = add_ball(tree);
    const NodeId half = add(tree, make_box(glm::dvec3(0.0), glm::dvec3(size)), tilted(size));
    tree.set_root(tree.add(Operation::kDifference, {ball, half}));
    return tree;
  };
  const VoxelGrid grid = grid_of(cut(40), 64);
  const auto expected = static_cast<double>(count(voxels_of(cut(40), grid)));
  ASSERT_GT(expected, 10000);
  for (const double size : {1e4, 1e7, 1e10}) {
    const auto voxels = voxels_of(cut(size), grid);
    EXPECT_NEAR(static_cast<double>(count(voxels)), expected, 0.002 * expected) << size;
    EXPECT_EQ(count(voxels_of(cut(size), grid, Axis::kX)), count(voxels)) << size;
    EXPECT_LE(differences(draw(cut(size), 40, Projection::kPerspective),
                          draw(cut(40), 40, Projection::kPerspective)),
              40u);
  }
}

TEST(Vast, BallsAndCylindersAndChains) {
  Tree plain;
  {
    const NodeId ball = add_ball(plain);
    const NodeId half = add_box(plain, {-20, -20, 1}, glm::dvec3(20));
    plain.set_root(plain.add(Operation::kDifference, {ball, half}));
  }
  const VoxelGrid grid = grid_of(plain, 64);
  const auto expected = voxels_of(plain, grid);
  for (const double size : {1e5, 1e12, 1e30}) {
    SCOPED_TRACE(size);
    Tree tree;
    NodeId node = add_ball(tree);
    // Around all, and a chain of cuts of which each is far larger than the one before.
    node = tree.add(Operation::kIntersection, {node, add_ball(tree, size)});
    node = tree.add(Operation::kIntersection,
                    {add(tree, make_cylinder(size, 2 * size, 24),
                         glm::translate(glm::dmat4(1.0), glm::dvec3(0, 0, -size))),
                     node});
    node = tree.add(Operation::kDifference,
                    {node, add_box(tree, {-size, -size, 3}, glm::dvec3(size))});
    node = tree.add(Operation::kDifference,
                    {node, add_box(tree, {-20 * size, -20 * size, 1}, glm::dvec3(20 * size))});
    tree.set_root(node);
    EXPECT_EQ(voxels_of(tree, grid), expected);
    EXPECT_EQ(voxels_of(tree, grid, Axis::kY), voxels_of(plain, grid, Axis::kY));
  }
}

/// A box of 4 x 6 x 8 that six half spaces leave of a vast cube.
Tree cut_to_size(double size) {
  Tree tree;
  std::vector<NodeId> operands{add_box(tree, glm::dvec3(-size), glm::dvec3(size))};
  const glm::dvec3 half(2, 3, 4);
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool upper : {false, true}) {
      glm::dvec3 low(-2 * size), high(2 * size);
      (upper ? low : high)[axis] = upper ? half[axis] : -half[axis];
      operands.push_back(add_box(tree, low, high));
    }
  }
  tree.set_root(tree.add(Operation::kDifference, operands));
  return tree;
}

TEST(Vast, PositivePartsAreCutDownToSize) {
  Tree plain;
  plain.set_root(add_box(plain, {-2, -3, -4}, {2, 3, 4}));
  for (const double size : {1e5, 1e10, 1e20, 1e200}) {
    SCOPED_TRACE(size);
    const Tree tree = cut_to_size(size);
    EXPECT_EQ(bounds(tree, tree.root()), bounds(plain, plain.root()));
    const VoxelGrid grid = grid_of(tree, 64);
    EXPECT_EQ(voxels_of(tree, grid), voxels_of(plain, grid));
    const auto measures = measure(tree, tree.root(), {.resolution = 128});
    ASSERT_TRUE(measures.has_value()) << measures.error().message;
    EXPECT_NEAR(measures->volume, 192, 1e-6);
    EXPECT_LE(differences(draw(tree, 40, Projection::kPerspective),
                          draw(cut_to_size(40), 40, Projection::kPerspective)),
              8u);
  }
}

TEST(Vast, AnOrdinaryDifferenceKeepsTheBoxOfItsFirstOperand) {
  Tree tree;
  const NodeId body = add_box(tree, glm::dvec3(0.0), glm::dvec3(10));
  const NodeId half = add_box(tree, {-1, -1, 5}, glm::dvec3(11));
  tree.set_root(tree.add(Operation::kDifference, {body, half}));
  EXPECT_EQ(bounds(tree, tree.root()), (Bounds{glm::dvec3(0.0), glm::dvec3(10)}));
}

TEST(Vast, GridsMuchSmallerThanWhatStandsInThem) {
  Tree tree;
  tree.set_root(add_ball(tree, 1e9));
  VoxelGrid grid{glm::ivec3(16), glm::dvec3(-0.5), glm::dvec3(1.0 / 16)};
  EXPECT_EQ(count(voxels_of(tree, grid)), 16u * 16 * 16);
  grid.origin.x = 2e9;
  EXPECT_EQ(count(voxels_of(tree, grid)), 0u);
}

TEST(Vast, OrdinarySolidsAreLeftAlone) {
  Tree tree;
  const NodeId ball = add_ball(tree);
  const NodeId half = add_box(tree, glm::dvec3(0.0), glm::dvec3(2000));
  tree.set_root(tree.add(Operation::kDifference, {ball, half}));
  const Geometry geometry(tree);
  EXPECT_EQ(geometry.parts()[1].positions, tree.solids()[1].mesh->positions);
}

TEST(Vast, ASolidMovesUnderAVastCutter) {
  Preview preview(cut_ball(1e10, Operation::kDifference), {}, 5e-6);
  Camera camera;
  camera.distance = 400;
  const auto view = make_view(camera, {200, 160}, {glm::dvec3(-60), glm::dvec3(60)});
  ASSERT_TRUE(view.has_value());
  ASSERT_TRUE(preview.draw(*view).has_value());
  for (const glm::dvec3& by : {glm::dvec3(-40, 20, 0), glm::dvec3(30, 30, -3)}) {
    const glm::dmat4 place = glm::translate(glm::dmat4(1.0), by);
    const auto moved = preview.move_solid(0, place);
    ASSERT_TRUE(moved.has_value());
    Tree there = cut_ball(1e10, Operation::kDifference);
    there.solids()[0].world_from_mesh = place;
    Preview fresh(there, {}, 5e-6);
    const auto expected = fresh.draw(*view);
    ASSERT_TRUE(expected.has_value());
    EXPECT_GT(fresh.report().covered, 20u);
    EXPECT_EQ((*moved)->depth, (*expected)->depth);
  }
}

/// A cube of 1 with a hole through it, and with it, or alone, a cube whose corner is near.
Tree detail(double vast) {
  Tree tree;
  const NodeId body = add_box(tree, glm::dvec3(-5), glm::dvec3(-4));
  const NodeId hole = add_box(tree, {-6, -4.7, -4.7}, {-3, -4.3, -4.3});
  NodeId root = tree.add(Operation::kDifference, {body, hole});
  if (vast > 0) {
    root = tree.add(Operation::kUnion, {root, add_box(tree, glm::dvec3(0.0), glm::dvec3(vast))});
  }
  tree.set_root(root);
  return tree;
}

TEST(Vast, SmallPartsBeforeVastOnesAreSeenWhole) {
  for (const auto& [rotation, distance] :
       {std::pair(glm::dvec3(55, 0, 25), 8.0), std::pair(glm::dvec3(80, 0, -60), 3.0)}) {
    Camera camera;
    camera.target = glm::dvec3(-4.5);
    camera.rotation = rotation;
    camera.distance = distance;
    const auto draw = [&](const Tree& tree, const PictureOptions& options = kSurfacesAlone) {
      Preview preview(tree, {}, 5e-6);
      const auto picture = preview.picture(camera, {200, 200}, options);
      EXPECT_TRUE(picture.has_value()) << picture.error().message;
      EXPECT_GT(preview.report().covered, 2000u);
      return picture ? *picture : Picture{};
    };
    const Picture alone = draw(detail(0));
    for (const double vast : {1e4, 1e5, 5e5}) {
      const Picture both = draw(detail(vast));
      // Where the small part is seen nothing else is.
      std::size_t differ = 0, all = 0;
      for (std::size_t i = 0; i < alone.pixels.size(); ++i) {
        const bool small = alone.pixels[i] != alone.pixels[0];
        all += small ? 1 : 0;
        differ += small && alone.pixels[i] != both.pixels[i] ? 1 : 0;
      }
      // The digits of a scene are known to less where it is vast: rims may be off by a little.
      EXPECT_LE(differ, all / 100) << vast << ", " << distance;

      // Depths are coarse there, and yet a flat face has no pattern of dark spots.
      if (distance > 4) continue;
      const Picture dark_corners = draw(detail(vast), {});
      int darkest = 255, brightest = 0;
      for (std::size_t y = 30; y < 60; ++y) {
        for (std::size_t x = 30; x < 120; ++x) {
          const int green = dark_corners.pixels[y * 200 + x].g;
          darkest = std::min(darkest, green), brightest = std::max(brightest, green);
        }
      }
      EXPECT_LE(brightest - darkest, 4) << vast;
    }
  }
}

TEST(Vast, ViewsThatAreNotCutShortAreThoseOfTheBox) {
  const Preview preview(cut_ball(20, Operation::kDifference), {}, 5e-6);
  Camera camera;
  const auto plain = make_view(camera, {100, 80}, preview.box());
  const auto view = preview.view(camera, {100, 80});
  ASSERT_TRUE(plain && view);
  EXPECT_FALSE(view->cut_short);
  EXPECT_EQ(view->image_from_world, plain->image_from_world);
  // Between the ball and a wall behind the eye.
  camera.distance = 7;
  Tree tree = cut_ball(20, Operation::kDifference);
  tree.set_root(
      tree.add(Operation::kUnion, {tree.root(), add_box(tree, {-9, -90, -9}, {9, -80, 9})}));
  camera.rotation = {90, 0, 0};
  const auto near = Preview(tree, {}, 5e-6).view(camera, {100, 80});
  ASSERT_TRUE(near.has_value());
  EXPECT_TRUE(near->cut_short);
  EXPECT_NEAR(near->near, 2, 0.1);  // the ball's radius is 5
}

}  // namespace
}  // namespace strata::csg
