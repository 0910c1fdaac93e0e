#include <gtest/gtest.h>

#include "tests/csg/random_tree.h"
#include "tests/csg/surface/full_lists.h"

namespace strata::csg {
namespace {

// A steep plate, thinner than a pixel, cuts a block. Its nearest crossing in the tile is far behind
// the block's top, but the face there may reach up to the top, where the block then is not seen.
// Specks behind everything make the plate a solid of many triangles, which has no bounds in areas.
TEST(VisibleSurface, OfABlockCutByASteepPlateIsTheOneOfTheFullLists) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    RandomTree random(seed + 99);
    Camera camera;
    camera.projection = Projection::kOrthographic;
    camera.rotation = {0, 0, 0};
    const Bounds box{glm::dvec3(-34), glm::dvec3(34)};
    centre_camera(camera, box);
    fit_camera(camera, box);
    const auto view = make_view(camera, {40, 40}, box);
    ASSERT_TRUE(view.has_value());
    const auto column = [&](double u) { return position(*view, u, 20.5, kPictureDepthLimit / 2); };
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
    const auto image = preview.draw(*view);
    ASSERT_TRUE(image.has_value());
    expect_same_surface(**image, by_full_lists(tree, *view, 0.0), "seed " + std::to_string(seed));
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace strata::csg
