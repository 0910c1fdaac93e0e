// Translucent trees, painted tile by tile: against rays that are walked one by one.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "csg/picture/ghosts.h"
#include "csg/surface/surface_tiles.h"
#include "strata/hashbuffer/build_ldi.h"
#include "tests/csg/random_tree.h"
#include "tests/csg/surface/surface_checks.h"

namespace strata::csg {
namespace {

constexpr int kSide = 150;  // more than two tiles, the last one cut off

/// Some translucent trees, and a view of them.
struct GhostScene {
  Tree tree;
  std::vector<Translucent> ghosts;
  View view;
};

/// Trees of solids of which many coincide (`on_grid`), some are open, and the eye may be in.
bool make_ghost_scene(std::uint64_t seed, GhostScene& scene) {
  RandomTree random(seed + 57000);
  const bool on_grid = seed % 2 == 1;
  std::vector<Tree::NodeId> roots;
  for (int i = random.pick(1, 3); i > 0; --i) {
    roots.push_back(random.grow(scene.tree, random.pick(1, 4), on_grid));
    const glm::vec4 colour(random.real(0, 1), random.real(0, 1), random.real(0, 1),
                           random.real(0.1, 0.9));
    scene.ghosts.push_back({roots.back(), {}});
    if (random.pick(0, 1) == 0) scene.ghosts.back().colour = colour;
  }
  if (seed % 5 == 0) {  // without some of its triangles
    Solid open = random.solid(on_grid);
    TriangleSoup mesh = *open.mesh;
    mesh.triangles.resize(mesh.triangles.size() - mesh.triangles.size() / 4 - 1);
    open.mesh = std::make_shared<TriangleSoup>(std::move(mesh));
    roots.push_back(scene.tree.add_solid(std::move(open)));
    scene.ghosts.push_back({roots.back(), glm::vec4(0.2f, 0.4f, 0.6f, 0.5f)});
  }
  scene.tree.set_root(scene.tree.add(Operation::kUnion, roots));
  const Bounds box = bounds(scene.tree, scene.tree.root());
  if (box.empty()) return false;
  const Camera camera = seed % 3 == 0 ? random_camera_inside(random) : random_camera(random, box);
  auto view = make_view(camera, glm::ivec2(kSide), box);
  EXPECT_TRUE(view.has_value());
  scene.view = *view;
  return true;
}

/// What GhostPainter is to paint, ray by ray, without a memory of others.
std::vector<Rgba> painted_ray_by_ray(const GhostScene& scene, const Geometry& geometry,
                                     const Shader& shader, const std::vector<std::uint32_t>& opaque,
                                     std::vector<Rgba> colours) {
  const TranslucentTrees trees(scene.tree, scene.ghosts, geometry, 0.0);
  const auto seen = TranslucentView::make(trees, scene.view, {});
  const TranslucentView::Mesh all = seen->joined();
  const auto lists = build_ldi(all.mesh, {Axis::kZ, kSide, kSide, kPictureDepthLimit}, {}, {});
  for (std::size_t i = 0; i < colours.size(); ++i) {
    TranslucentWalk walk(trees, *seen, scene.view);
    glm::vec3 light(0.0f);
    float left = 1.0f;
    bool painted = false;
    const auto at = static_cast<int>(i);
    for (const TranslucentWalk::Fragment& fragment :
         walk.surfaces(lists->list(at % kSide, at / kSide))) {
      if (opaque[i] != SurfaceImage::kNone && fragment.depth > opaque[i] + walk.slack(opaque[i])) {
        break;
      }
      const glm::vec4 face =
          translucent_colour(trees, seen->slot_of[fragment.triangle],
                             seen->source(fragment.triangle), fragment.exit, shader);
      light += left * face.a * glm::vec3(face);
      left *= 1.0f - face.a;
      painted = true;
    }
    if (!painted) continue;
    const glm::vec4 behind = glm::vec4(colours[i]) / 255.0f;
    colours[i] =
        to_bytes(glm::vec4(light + left * glm::vec3(behind), 1.0f - left * (1.0f - behind.a)));
  }
  return colours;
}

TEST(Ghosts, ArePaintedAsRaysThatAreWalkedOneByOne) {
  std::size_t changed = 0, different = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    GhostScene scene;
    if (!make_ghost_scene(seed, scene)) continue;
    const Geometry geometry(scene.tree);
    const Shader shader(scene.tree, geometry, scene.view, default_scheme());
    // What is behind: nothing, or something at depths in steps and in a slope, through the scene.
    std::vector<std::uint32_t> opaque;
    std::vector<Rgba> colours;
    for (int i = 0; i < kSide * kSide; ++i) {
      const auto block = static_cast<std::uint32_t>(i / 1000), at = static_cast<std::uint32_t>(i);
      const bool none = block % 3 == 0;
      opaque.push_back(none             ? SurfaceImage::kNone
                       : block % 3 == 1 ? block * 300000 % kPictureDepthLimit
                                        : at * 700 % kPictureDepthLimit);
      colours.push_back(none ? Rgba(0) : Rgba(block * 5 % 256, at / 64 % 256, 90, 255));
    }
    const std::vector<Rgba> expected = painted_ray_by_ray(scene, geometry, shader, opaque, colours);
    std::vector<Rgba> found = colours;
    GhostPainter painter(scene.tree, scene.ghosts, geometry, 0.0);
    ASSERT_TRUE(painter.begin(scene.view, shader, {}).has_value());
    for (int v = 0; v < kSide; v += kTileSide) {
      for (int u = 0; u < kSide; u += kTileSide) {
        const auto first = static_cast<std::size_t>(v * kSide + u);
        painter.paint({u, v, std::min(kSide, u + kTileSide), std::min(kSide, v + kTileSide)},
                      opaque.data() + first, found.data() + first, kSide, 0);
      }
    }
    ASSERT_TRUE(painter.end().has_value());
    for (std::size_t i = 0; i < found.size(); ++i) {
      changed += expected[i] != colours[i] ? 1 : 0;
      if (found[i] == expected[i] || ++different > 5) continue;
      ADD_FAILURE() << "seed " << seed << ": pixel " << i % kSide << ", " << i / kSide;
    }
  }
  EXPECT_GT(changed, 150000u);
  EXPECT_EQ(different, 0u);
}

}  // namespace
}  // namespace strata::csg
