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

constexpr int kSide = 40;

/// Holds all pixels of a view to rays. @return how many pixels show something
std::size_t expect_rays(const Tree& tree, Preview& preview, const View& view,
                        const std::string& what) {
  const auto image = preview.draw(view);
  EXPECT_TRUE(image.has_value());
  if (!image) return 0;
  const RayOracle oracle(tree, view);
  std::size_t covered = 0, wrong = 0;
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      const std::uint32_t depth = (*image)->depth[static_cast<std::size_t>(v * kSide + u)];
      covered += depth != SurfaceImage::kNone ? 1 : 0;
      if (oracle.agrees(u, v, depth) || ++wrong > 3) continue;
      ADD_FAILURE() << what << ": pixel " << u << ", " << v << " shows depth " << depth;
    }
  }
  EXPECT_EQ(wrong, 0u) << what;
  return covered;
}

// Nothing is shown that is not there, and nothing is missing. Half of the trees are of boxes whose
// faces coincide.
TEST(VisibleSurface, IsWhereRaysInDoublePrecisionMeetTheTree) {
  std::size_t covered = 0;
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
    covered += expect_rays(tree, preview, *view, "seed " + std::to_string(seed));
  }
  EXPECT_GT(covered, 15000u);
}

// Solids reach through the walls of the room that the eye is in. The view is that of pictures: its
// depths begin at the nearest face.
TEST(VisibleSurface, AroundTheEyeIsWhereRaysLeaveTheTree) {
  std::size_t covered = 0;
  for (std::uint64_t seed = 0; seed < 120; ++seed) {
    RandomTree random(seed + 32000);
    Tree tree;
    const auto add = [&](TriangleSoup mesh, const glm::dvec3& shift) {
      for (glm::dvec3& p : mesh.positions) p += shift;
      return tree.add_solid({std::make_shared<TriangleSoup>(std::move(mesh))});
    };
    std::vector<Tree::NodeId> united{add(make_box(glm::dvec3(-10), glm::dvec3(10)), {})};
    for (int i = random.pick(1, 5); i > 0; --i) {
      glm::dvec3 at(random.real(-9, 9), random.real(-9, 9), random.real(-9, 9));
      at[random.pick(0, 2)] = random.pick(0, 1) == 0 ? -10 : 10;
      const double size = random.real(1, 6);
      united.push_back(random.pick(0, 1) == 0
                           ? add(make_icosphere(size, 2), at)
                           : add(make_box(glm::dvec3(-size), glm::dvec3(size)), at));
    }
    Tree::NodeId root = tree.add(Operation::kUnion, united);
    if (seed % 3 == 2) {
      const glm::dvec3 at(random.real(4, 9), random.real(4, 9), random.real(4, 9));
      root = tree.add(Operation::kDifference, {root, add(make_icosphere(3, 2), at)});
    }
    tree.set_root(root);
    Camera camera = look_at({random.real(-3, 3), random.real(-3, 3), random.real(-3, 3)},
                            {random.real(-9, 9), random.real(-9, 9), random.real(-9, 9)});
    camera.field_of_view = 60;
    Preview preview(tree, {}, 0.0);
    const auto view = preview.view(camera, glm::ivec2(kSide));
    ASSERT_TRUE(view.has_value());
    covered += expect_rays(tree, preview, *view, "seed " + std::to_string(seed));
  }
  EXPECT_EQ(covered, 120u * kSide * kSide);
}

}  // namespace
}  // namespace strata::csg
