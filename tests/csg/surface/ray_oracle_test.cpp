// The visible surface against rays in double precision: every triangle is met one by one, the tree
// is evaluated by recursion between all crossings. Shares no code with what it checks; it knows
// nothing of the lattice, so pixels at outlines may differ.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <optional>
#include <vector>

#include "strata/csg/picture/picture.h"
#include "tests/csg/random_tree.h"

namespace strata::csg {
namespace {

struct Crossing {
  double distance;
  std::uint32_t solid;
  int turn;  ///< of the winding number
};

/// What a ray meets of one solid.
void meet(const Solid& solid, std::uint32_t index, const glm::dvec3& from, const glm::dvec3& along,
          std::vector<Crossing>& out) {
  const double mirrored = glm::determinant(glm::dmat3(solid.world_from_mesh)) < 0 ? -1.0 : 1.0;
  const auto place = [&](std::uint32_t i) {
    return glm::dvec3(solid.world_from_mesh * glm::dvec4(solid.mesh->positions[i], 1.0));
  };
  for (const glm::uvec3& t : solid.mesh->triangles) {
    const glm::dvec3 a = place(t.x), e = place(t.y) - a, f = place(t.z) - a;
    const glm::dvec3 q = glm::cross(along, f);
    const double area = glm::dot(e, q);
    if (area == 0) continue;
    const glm::dvec3 to = from - a, r = glm::cross(to, e);
    const double s = glm::dot(to, q) / area, w = glm::dot(along, r) / area;
    if (s < 0 || w < 0 || s + w > 1) continue;
    out.push_back({glm::dot(f, r) / area, index, area * mirrored > 0 ? 1 : -1});
  }
}

/// The distance where the tree is true first for longer than `least`.
std::optional<double> first_inside(const Tree& tree, const glm::dvec3& from,
                                   const glm::dvec3& along, double least) {
  std::vector<Crossing> met;
  for (std::uint32_t i = 0; i < tree.solids().size(); ++i)
    meet(tree.solids()[i], i, from, along, met);
  std::sort(met.begin(), met.end(),
            [](const Crossing& a, const Crossing& b) { return a.distance < b.distance; });
  std::vector<int> windings(tree.solids().size(), 0);
  std::optional<double> begin;
  for (const Crossing& one : met) {
    windings[one.solid] += one.turn;
    const bool inside =
        evaluate(tree, tree.root(), [&](std::uint32_t s) { return windings[s] > 0; });
    if (inside && !begin) begin = one.distance;
    if (inside || !begin) continue;
    if (one.distance - *begin > least) return begin;
    begin.reset();
  }
  return std::nullopt;
}

TEST(VisibleSurface, IsWhereRaysInDoublePrecisionMeetTheTree) {
  constexpr int kSide = 40;
  std::size_t covered = 0, different = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    RandomTree random(seed + 31000);
    Tree tree;
    tree.set_root(random.grow(tree, random.pick(1, 9), false));
    const Bounds box = bounds(tree, tree.root());
    if (box.empty()) continue;
    Camera camera;
    camera.projection = Projection::kOrthographic;
    centre_camera(camera, box);
    fit_camera(camera, box);
    camera.rotation = {random.real(0, 180), random.real(0, 360), random.real(0, 360)};
    Preview preview(tree, {}, 0.0);
    const auto view = make_view(camera, glm::ivec2(kSide), preview.box());
    ASSERT_TRUE(view.has_value());
    const auto image = preview.draw(*view);
    ASSERT_TRUE(image.has_value());
    const glm::dmat4 world_from_image = glm::inverse(view->image_from_world);
    const double step = (view->far - view->near) / kPictureDepthLimit;
    const double pixel = glm::length(glm::dvec3(world_from_image[0]));
    for (int v = 0; v < kSide; ++v) {
      for (int u = 0; u < kSide; ++u) {
        const glm::dvec3 from(world_from_image * glm::dvec4(u + 0.5, v + 0.5, 0, 1));
        const glm::dvec3 to(world_from_image *
                            glm::dvec4(u + 0.5, v + 0.5, double(kPictureDepthLimit), 1));
        const auto expected = first_inside(tree, from, glm::normalize(to - from), pixel / 100);
        const std::uint32_t depth = (*image)->depth[static_cast<std::size_t>(v * kSide + u)];
        const bool shown = depth != SurfaceImage::kNone;
        covered += shown || expected ? 1 : 0;
        // Steep faces are moved along the ray by the snap: half a pixel's 1/256 times the slope.
        const bool same = shown == expected.has_value() &&
                          (!shown || std::abs((depth + 0.5) * step - *expected) < pixel / 4);
        different += same ? 0 : 1;
      }
    }
  }
  EXPECT_GT(covered, 6000u);
  EXPECT_LE(different, covered / 200) << "of " << covered;
}

}  // namespace
}  // namespace strata::csg
