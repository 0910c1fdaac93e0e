#include <gtest/gtest.h>

#include "strata/csg/picture/picture.h"
#include "tests/csg/random_tree.h"
#include "tests/csg/surface/surface_checks.h"

namespace strata::csg {
namespace {

TEST(RayOracle, NoticesWhatIsMissingAddedOrElsewhere) {
  Tree tree;
  tree.set_root(
      tree.add_solid({std::make_shared<TriangleSoup>(make_box(glm::dvec3(-1), glm::dvec3(1)))}));
  Camera camera;
  fit_camera(camera, bounds(tree, tree.root()));
  Preview preview(tree, {}, 0.0);
  const auto view = make_view(camera, glm::ivec2(40), preview.box());
  ASSERT_TRUE(view.has_value());
  const auto image = preview.draw(*view);
  ASSERT_TRUE(image.has_value());
  const RayOracle oracle(tree, *view);
  const std::uint32_t depth = (*image)->depth[20 * 40 + 20];
  ASSERT_NE(depth, SurfaceImage::kNone);
  EXPECT_TRUE(oracle.agrees(20, 20, depth));
  EXPECT_FALSE(oracle.agrees(20, 20, SurfaceImage::kNone));
  // By a pixel, nearer and farther: 40 pixels are less than twice as much as the view is deep.
  EXPECT_FALSE(oracle.agrees(20, 20, depth - kPictureDepthLimit / 20));
  EXPECT_FALSE(oracle.agrees(20, 20, depth + kPictureDepthLimit / 20));
  EXPECT_TRUE(oracle.agrees(0, 0, SurfaceImage::kNone));
  EXPECT_FALSE(oracle.agrees(0, 0, depth));
}

// Nothing is shown that is not there, and nothing is missing. Half of the trees are of boxes whose
// faces coincide.
TEST(VisibleSurface, IsWhereRaysInDoublePrecisionMeetTheTree) {
  constexpr int kSide = 40;
  std::size_t covered = 0, wrong = 0;
  for (std::uint64_t seed = 0; seed < 80; ++seed) {
    RandomTree random(seed + 31000);
    Tree tree;
    tree.set_root(random.grow(tree, random.pick(1, 9), seed % 2 == 1));
    const Bounds box = bounds(tree, tree.root());
    if (box.empty()) continue;
    const Camera camera = random_camera(random, box);
    Preview preview(tree, {}, 0.0);
    const auto view = make_view(camera, glm::ivec2(kSide), preview.box());
    ASSERT_TRUE(view.has_value());
    const auto image = preview.draw(*view);
    ASSERT_TRUE(image.has_value());
    const RayOracle oracle(tree, *view);
    for (int v = 0; v < kSide; ++v) {
      for (int u = 0; u < kSide; ++u) {
        const std::uint32_t depth = (*image)->depth[static_cast<std::size_t>(v * kSide + u)];
        covered += depth != SurfaceImage::kNone ? 1 : 0;
        if (oracle.agrees(u, v, depth)) continue;
        if (++wrong <= 5) {
          ADD_FAILURE() << "seed " << seed << ": pixel " << u << ", " << v << " shows depth "
                        << depth;
        }
      }
    }
  }
  EXPECT_GT(covered, 15000u);
  EXPECT_EQ(wrong, 0u);
}

}  // namespace
}  // namespace strata::csg
