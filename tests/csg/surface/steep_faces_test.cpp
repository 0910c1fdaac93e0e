#include <gtest/gtest.h>

#include "tests/csg/random_tree.h"
#include "tests/csg/surface/full_lists.h"

namespace strata::csg {
namespace {

const Bounds kSteepScene{glm::dvec3(-34), glm::dvec3(34)};

/// From above, 40 x 40 pixels.
View look_down() {
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = {0, 0, 0};
  centre_camera(camera, kSteepScene);
  fit_camera(camera, kSteepScene);
  return make_view(camera, {40, 40}, kSteepScene).value();
}

// A steep plate, thinner than a pixel, cuts a block. Its nearest crossing in the tile is far behind
// the block's top, but the face there may reach up to the top, where the block then is not seen.
// Specks behind everything make the plate a solid of 120 triangles, which has no bounds in areas
// (kMostOfConcave).
TEST(VisibleSurface, OfABlockCutByASteepPlateIsTheOneOfTheFullLists) {
  const View view = look_down();
  std::size_t seen = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    RandomTree random(seed + 99);
    const auto column = [&](double u) { return position(view, u, 20.5, kPictureDepthLimit / 2); };
    const double pixel = std::abs(column(21.5).x - column(20.5).x);
    const double run = 1 / random.real(150, 2000), height = random.real(-3, 3) * pixel;
    TriangleSoup plate = make_box(glm::dvec3(0), glm::dvec3(1));
    for (glm::dvec3& p : plate.positions) {
      const double z = p.z > 0.5 ? 3 : -30;
      p.x = column(20.5).x + (z - height) * run + (p.x > 0.5 ? 0.3 * pixel : 0.0);
      p.y = p.y > 0.5 ? 15 : -15;
      p.z = z;
    }
    for (int i = 0; i < 9; ++i) {
      const glm::dvec3 low(random.real(-20, 20), random.real(-20, 20), -33.4);
      append(plate, make_box(low, low + glm::dvec3(0.01)));
    }
    Tree tree;
    const auto block = tree.add_solid(
        {std::make_shared<TriangleSoup>(make_box({-20, -20, -3 * pixel}, {20, 20, 0}))});
    const auto cutter = tree.add_solid({std::make_shared<TriangleSoup>(std::move(plate))});
    tree.set_root(tree.add(Operation::kDifference, {block, cutter}));
    Preview preview(tree, {}, 0.0);
    const auto image = preview.draw(view);
    ASSERT_TRUE(image.has_value());
    seen += expect_same_surface(**image, by_full_lists(tree, view, 0.0),
                                "seed " + std::to_string(seed));
    if (HasFailure()) return;
  }
  EXPECT_GT(seen, 50000u);
}

// The top of a block and a steep face of a pyramid have exactly one depth at a pixel, the block
// first in the tree. The slope of a third solid lies farther behind than faces that are not steep
// reach, but within the reach of the steep one.
TEST(VisibleSurface, OfASteepFaceAtTheDepthOfAnotherIsTheOneOfTheFullLists) {
  const View view = look_down();
  constexpr int kU = 24, kV = 20;
  const auto column = [&](double u) { return position(view, u, kV + 0.5, 8e6).x; };
  const double x = column(kU + 0.5);
  const double steps = 1e6 / (position(view, 0, 0, 8e6).z - position(view, 0, 0, 9e6).z);
  TriangleSoup slope = make_box({-18, -20, -25}, {19, 20, 0});
  for (glm::dvec3& p : slope.positions) {
    if (p.z > -20) p.z = -0.8 + (p.x - x) * 0.2;
  }
  TriangleSoup block = make_box({-20, -20, -26}, {20, 20, 0});
  for (glm::dvec3& p : block.positions) {
    if (p.z > -20) p.z = (x - p.x) * 0.5;
  }
  double lift = 0;
  for (int round = 0; round < 8; ++round) {
    TriangleSoup pyramid = make_box({0, 0, 0}, {1, 1, 1});
    for (glm::dvec3& p : pyramid.positions) {
      const bool top = p.z > 0.5;
      p.x = p.x > 0.5 ? column(kU + 0.5 + (top ? -1.0 : 8.0) / 256) : -15;
      p.y = p.y > 0.5 ? 15 : -15;
      p.z = (top ? 3.4 : -30) + lift;
    }
    Tree tree;
    std::vector<Tree::NodeId> solids;
    std::vector<std::uint32_t> depths;
    for (const TriangleSoup& mesh : {slope, block, pyramid}) {
      const Solid solid{std::make_shared<TriangleSoup>(mesh)};
      solids.push_back(tree.add_solid(solid));
      Tree alone;
      alone.set_root(alone.add_solid(solid));
      depths.push_back(by_full_lists(alone, view, 0.0).depth[kV * 40 + kU]);
    }
    if (depths[1] != depths[2]) {
      lift += (static_cast<double>(depths[2]) - static_cast<double>(depths[1])) / steps;
      continue;
    }
    EXPECT_GT(depths[0], depths[1]);
    tree.set_root(tree.add(Operation::kUnion, solids));
    Preview preview(tree, {}, 0.0);
    const auto image = preview.draw(view);
    ASSERT_TRUE(image.has_value());
    EXPECT_GT(expect_same_surface(**image, by_full_lists(tree, view, 0.0), "equal depths"), 100u);
    return;
  }
  FAIL() << "no lift gives both faces one depth";
}

}  // namespace
}  // namespace strata::csg
