// What the walk of the GPU sees is what the CPU sees, bit for bit.

#include "csg/gl/gl_surfaces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <vector>

#include "hashbuffer/gl/hash_store.h"
#include "hashbuffer/gl/scan_store.h"
#include "strata/csg/picture/picture.h"
#include "strata/csg/scene/scene.h"
#include "strata/mesh/shapes.h"
#include "tests/csg/random_tree.h"
#include "tests/csg/surface/surface_checks.h"
#include "tests/gl/gl_testing.h"
#include "tests/support/corpus.h"

namespace strata::csg {
namespace {

class GlSurface : public test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (!context_) return;
    auto store = gl::ScanStore::create(context_->info());
    ASSERT_TRUE(store) << store.error().message;
    use(*std::move(store));
  }
  void TearDown() override {
    source_.reset();
    GlTest::TearDown();
  }
  void use(std::unique_ptr<gl::Store> store, std::uint64_t pixels_at_once = 1 << 22) {
    source_.reset();
    auto source = GlSurfaceSource::create(*context_, std::move(store), pixels_at_once);
    ASSERT_TRUE(source) << source.error().message;
    source_ = *std::move(source);
  }

  /// Compares the surfaces of a view. Gives how many pixels the GPU's walk left to the CPU.
  std::uint64_t expect_same(const Tree& tree, const Camera& camera, const glm::ivec2& size,
                            const std::string& what) {
    Preview own(tree, {}, 1e-6), other(tree, {}, 1e-6);
    other.set_source(source_.get());
    const auto view = make_view(camera, size, own.box());
    EXPECT_TRUE(view) << what;
    const auto expected = own.draw(*view);
    const auto found = other.draw(*view);
    EXPECT_TRUE(expected) << what;
    EXPECT_TRUE(found) << what << ": " << found.error().message;
    if (!expected || !found) return 0;
    expect_same_surface(**found, **expected, what);
    walked_ += source_->counts().walked;
    doubtful_ += source_->counts().doubtful;
    left_ += source_->counts().left;
    return source_->counts().doubtful;
  }

  std::unique_ptr<GlSurfaceSource> source_;
  std::uint64_t walked_ = 0, doubtful_ = 0, left_ = 0;
};

TEST_F(GlSurface, RandomTreesLookAsTheyDoToTheCpu) {
  for (int seed = 0; seed < 60; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 4000);
    Tree tree;
    tree.set_root(random.grow(tree, random.pick(1, seed % 8 == 0 ? 60 : 12), seed % 3 == 0));
    const Camera camera = random_camera(random, bounds(tree, tree.root()));
    expect_same(tree, camera, {random.pick(1, 150), random.pick(1, 150)},
                "seed " + std::to_string(seed));
    if (HasFailure()) return;
  }
  // It is the GPU that has seen them.
  EXPECT_GT(walked_, 100000u);
  EXPECT_GT(doubtful_, 0u);
  EXPECT_LT(doubtful_, walked_ / 2);
  EXPECT_EQ(left_, 0u);
}

/// Solids without volume, or with hardly any: sheets of two sides, single and turned triangles,
/// needles, boxes that are flat along an axis, faces that are there many times.
TriangleSoup degenerate_solid(RandomTree& random) {
  const auto point = [&] {
    // Few places, so that points coincide and lie in one plane.
    return glm::dvec3(random.pick(-3, 3), random.pick(-3, 3), random.pick(-3, 3));
  };
  TriangleSoup mesh;
  switch (random.pick(0, 5)) {
    case 0:  // a lamina
      mesh.positions = {point(), point(), point()};
      mesh.triangles = {{0, 1, 2}, {2, 1, 0}};
      break;
    case 1:  // one triangle
      mesh.positions = {point(), point(), point()};
      mesh.triangles = {{0, 1, 2}};
      break;
    case 2: {  // a box that is flat, or nearly
      const glm::dvec3 low = point();
      glm::dvec3 size(random.pick(1, 4), random.pick(1, 4), random.pick(1, 4));
      size[random.pick(0, 2)] = random.pick(0, 1) == 0 ? 0.0 : 1e-9;
      mesh = make_box(low, low + size);
      break;
    }
    case 3:  // a tetrahedron, maybe flat, maybe inside out
      mesh.positions = {point(), point(), point(), point()};
      mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
      break;
    case 4:  // equal faces, facing both ways
      mesh.positions = {point(), point(), point()};
      for (int i = random.pick(2, 6); i > 0; --i) {
        mesh.triangles.push_back(random.pick(0, 1) == 0 ? glm::uvec3(0, 1, 2)
                                                        : glm::uvec3(0, 2, 1));
      }
      break;
    default: {
      const glm::dvec3 low = point();
      mesh =
          make_box(low, low + glm::dvec3(random.pick(1, 4), random.pick(1, 4), random.pick(1, 4)));
    }
  }
  return mesh;
}

TEST_F(GlSurface, SolidsWithoutVolumeLookAsTheyDoToTheCpu) {
  for (int seed = 0; seed < 120; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 9000);
    Tree tree;
    std::vector<Tree::NodeId> nodes;
    for (int i = random.pick(1, 6); i > 0; --i) {
      Solid solid;
      solid.mesh = std::make_shared<TriangleSoup>(degenerate_solid(random));
      // Turned ones meet no lattice by chance.
      if (random.pick(0, 1) == 0) {
        solid.world_from_mesh =
            glm::rotate(glm::dmat4(1), random.real(0, 3), glm::dvec3(0.36, 0.48, 0.8));
      }
      nodes.push_back(tree.add_solid(std::move(solid)));
      if (nodes.size() == 3) {
        const Operation operations[] = {Operation::kUnion, Operation::kDifference,
                                        Operation::kIntersection};
        const auto joined = tree.add(operations[random.pick(0, 2)], nodes);
        nodes.assign(1, joined);
      }
    }
    tree.set_root(nodes.size() == 1 ? nodes[0] : tree.add(Operation::kUnion, nodes));
    Bounds box = bounds(tree, tree.root());
    if (box.empty() || box.low == box.high) continue;
    expect_same(tree, random_camera(random, box), {random.pick(20, 120), random.pick(20, 120)},
                "seed " + std::to_string(seed));
    if (HasFailure()) return;
  }
  EXPECT_GT(walked_, 100000u);
}

TEST_F(GlSurface, AnEyeInTheSceneSeesWhatTheCpuSees) {
  for (int seed = 0; seed < 15; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 500);
    Tree tree;
    tree.set_root(random.grow(tree, random.pick(1, 12), seed % 3 == 0));
    expect_same(tree, random_camera_inside(random), {90, 70}, "seed " + std::to_string(seed));
    if (HasFailure()) return;
  }
}

/// A plate with many holes, and pegs in some.
Tree plate(int side) {
  Tree tree;
  const auto add = [&tree](TriangleSoup mesh) {
    Solid solid;
    solid.mesh = std::make_shared<TriangleSoup>(std::move(mesh));
    return tree.add_solid(std::move(solid));
  };
  std::vector<Tree::NodeId> operands{add(make_box({0, 0, 0}, {side + 1.0, side + 1.0, 1}))};
  std::vector<Tree::NodeId> pegs;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      TriangleSoup hole = make_cylinder(0.35, 2.0, 16);
      for (auto& p : hole.positions) p += glm::dvec3(x + 1.0, y + 1.0, -0.5);
      operands.push_back(add(std::move(hole)));
      if ((x + y) % 3 != 0) continue;
      TriangleSoup peg = make_cone(0.3, 2.5, 12);
      for (auto& p : peg.positions) p += glm::dvec3(x + 1.0, y + 1.0, 0.0);
      pegs.push_back(add(std::move(peg)));
    }
  }
  pegs.push_back(tree.add(Operation::kDifference, operands));
  tree.set_root(tree.add(Operation::kUnion, pegs));
  return tree;
}

TEST_F(GlSurface, AnyNumberOfSolidsInATile) {
  for (const int side : {1, 6, 20}) {
    const Tree tree = plate(side);
    Camera camera;
    centre_camera(camera, bounds(tree, tree.root()));
    fit_camera(camera, bounds(tree, tree.root()));
    expect_same(tree, camera, {60, 60}, std::to_string(side) + " a side");
    expect_same(tree, camera, {200, 130}, std::to_string(side) + " a side, larger");
  }
  EXPECT_EQ(left_, 0u);
}

TEST_F(GlSurface, TreesOfManyNodesAreTheCpus) {
  RandomTree random(17);
  Tree tree;
  std::vector<Tree::NodeId> operands;
  for (int i = 0; i < 70; ++i) {
    const auto slab = [&](double low) {
      Solid solid;
      solid.mesh = std::make_shared<TriangleSoup>(
          make_box({-5 + random.real(0, 1), -5, low}, {5, 5 - random.real(0, 1), low + 0.1}));
      return tree.add_solid(std::move(solid));
    };
    // Slabs that hardly meet: the ray goes on and on.
    const auto first = slab(0.3 * i), second = slab(0.3 * i + (i == 66 ? 0.05 : 0.15));
    operands.push_back(tree.add(Operation::kIntersection, {first, second}));
  }
  tree.set_root(tree.add(Operation::kUnion, operands));
  Camera camera;
  centre_camera(camera, {{-5, -5, 0}, {5, 5, 21}});
  fit_camera(camera, {{-5, -5, 0}, {5, 5, 21}});
  for (const double tilt : {0.0, 20.0, 180.0}) {
    camera.rotation = {tilt, 0, 0};
    expect_same(tree, camera, {70, 70}, std::to_string(tilt));
  }
}

TEST_F(GlSurface, MoreSolidsThanATileHasBitsForAreTheCpus) {
  RandomTree random(5);
  Tree tree;
  std::vector<Tree::NodeId> operands;
  for (int i = 0; i < 1100; ++i) {
    const glm::dvec3 low(random.real(-5, 4), random.real(-5, 4), random.real(-5, 4));
    Solid solid;
    solid.mesh = std::make_shared<TriangleSoup>(
        make_box(i == 0 ? glm::dvec3(-5) : low, i == 0 ? glm::dvec3(5) : low + 0.8));
    operands.push_back(tree.add_solid(std::move(solid)));
  }
  tree.set_root(tree.add(Operation::kDifference, operands));
  Camera camera;
  centre_camera(camera, bounds(tree, tree.root()));
  fit_camera(camera, bounds(tree, tree.root()));
  expect_same(tree, camera, {64, 64}, "1100 boxes");
  EXPECT_EQ(left_, 1u);
  EXPECT_EQ(walked_, 0u);
}

TEST_F(GlSurface, FacesThatCoincideAndOpenSolidsAreTheCpus) {
  Tree tree;
  const auto add = [&tree](TriangleSoup mesh) {
    Solid solid;
    solid.mesh = std::make_shared<TriangleSoup>(std::move(mesh));
    return tree.add_solid(std::move(solid));
  };
  TriangleSoup open = make_icosphere(1.0, 2);
  open.triangles.resize(open.triangles.size() * 3 / 4);
  TriangleSoup twice = make_torus(1.0, 0.4, 20, 12);  // overlaps itself
  const TriangleSoup again = twice;
  for (const auto& p : again.positions) twice.positions.push_back(p + glm::dvec3(0.3, 0, 0));
  for (const auto& t : again.triangles) {
    twice.triangles.push_back(t + static_cast<unsigned>(again.positions.size()));
  }
  const auto box = add(make_box({0, 0, 0}, {2, 2, 2}));
  const auto part = add(make_box({0, 0, 1}, {2, 1, 2}));
  const auto cut = tree.add(Operation::kDifference, {box, part});
  const auto third = add(std::move(open));
  const auto fourth = add(std::move(twice));
  tree.set_root(tree.add(Operation::kUnion, {cut, third, fourth}));
  RandomTree random(7);
  std::uint64_t resolved = 0;
  for (int i = 0; i < 10; ++i) {
    resolved += expect_same(tree, random_camera(random, bounds(tree, tree.root())), {120, 120},
                            "camera " + std::to_string(i));
  }
  EXPECT_GT(resolved, 0u);
}

TEST_F(GlSurface, EveryStoreCanBeWalked) {
  const std::function<Result<std::unique_ptr<gl::Store>>()> stores[] = {
      [&]() -> Result<std::unique_ptr<gl::Store>> {
        return gl::ScanStore::create(context_->info(), {.payload = true, .binding_bytes = 100000});
      },
      [&]() -> Result<std::unique_ptr<gl::Store>> {
        return gl::HashStore::create(context_->info());
      },
      [&]() -> Result<std::unique_ptr<gl::Store>> {
        return gl::HashStore::create(context_->info(),
                                     {.path = gl::WordPath::kTwoPass, .binding_bytes = 200000});
      }};
  for (const auto& make : stores) {
    auto store = make();
    ASSERT_TRUE(store) << store.error().message;
    use(*std::move(store));
    for (int seed = 0; seed < 8; ++seed) {
      RandomTree random(static_cast<std::uint64_t>(seed) + 9000);
      Tree tree;
      tree.set_root(random.grow(tree, 10, seed % 2 == 0));
      expect_same(tree, random_camera(random, bounds(tree, tree.root())), {130, 140},
                  "seed " + std::to_string(seed));
      if (HasFailure()) return;
    }
  }
}

TEST_F(GlSurface, BandsOfAPictureAreParts) {
  auto store = gl::ScanStore::create(context_->info());
  ASSERT_TRUE(store);
  use(*std::move(store), 1);  // a row of tiles at once
  for (int seed = 0; seed < 10; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 700);
    Tree tree;
    tree.set_root(random.grow(tree, 10, seed % 3 == 0));
    expect_same(tree, random_camera(random, bounds(tree, tree.root())),
                {random.pick(60, 150), random.pick(60, 260)}, "seed " + std::to_string(seed));
    if (HasFailure()) return;
  }
  EXPECT_GT(walked_, 10000u);
  EXPECT_EQ(left_, 0u);
}

TEST_F(GlSurface, ListsThatAreDoubtfulAndLongAreTheCpus) {
  // 300 plates that overlap themselves and coincide in pairs, seen from their edges and their
  // faces.
  Tree tree;
  std::vector<Tree::NodeId> operands;
  TriangleSoup plates;
  for (int i = 0; i < 150; ++i) {
    for (int k = 0; k < 2; ++k) {
      const TriangleSoup plate = make_box({0, 0, 0.1 * i}, {4, 4, 0.1 * i + 0.05});
      const auto first = static_cast<unsigned>(plates.positions.size());
      plates.positions.insert(plates.positions.end(), plate.positions.begin(),
                              plate.positions.end());
      for (const auto& t : plate.triangles) plates.triangles.push_back(t + first);
    }
  }
  Solid solid;
  solid.mesh = std::make_shared<TriangleSoup>(std::move(plates));
  tree.set_root(tree.add_solid(std::move(solid)));
  Camera camera;
  centre_camera(camera, bounds(tree, tree.root()));
  fit_camera(camera, bounds(tree, tree.root()));
  camera.rotation = {10, 5, 0};
  expect_same(tree, camera, {100, 100}, "plates");
  EXPECT_GT(left_, 0u);
}

TEST_F(GlSurface, PicturesOfAllKindsAreTheCpus) {
  RandomTree random(21);
  Tree tree;
  const auto root = random.grow(tree, 10, false);
  const auto ghost = tree.add_solid(random.solid(false));
  tree.set_root(root);
  tree.solids()[0].colour = glm::vec4(1, 0, 0, 0.5f);  // translucent
  Camera camera;
  centre_camera(camera, bounds(tree, root));
  fit_camera(camera, bounds(tree, root));
  for (const int samples : {1, 4}) {
    for (const bool edges : {false, true}) {
      for (const bool with_ghost : {false, true}) {
        std::vector<Ghost> ghosts;
        if (with_ghost) ghosts.push_back({ghost, kHighlightGhost});
        PictureOptions options;
        options.samples = samples;
        options.edges = edges;
        if (samples == 4) options.backdrop.emplace();
        Preview own(tree, ghosts, 0), other(tree, ghosts, 0);
        other.set_source(source_.get());
        const auto expected = own.picture(camera, {150, 90}, options);
        const auto found = other.picture(camera, {150, 90}, options);
        ASSERT_TRUE(expected && found);
        EXPECT_TRUE(found->pixels == expected->pixels)
            << samples << " samples, edges " << edges << ", ghost " << with_ghost;
      }
    }
  }
}

TEST_F(GlSurface, ScenesLookAsTheyDoToTheCpu) {
  // OpenSCAD's examples, and a scene of ours.
  std::vector<testkit::CorpusScene> files = testkit::scene_files();
  std::erase_if(files, [](const testkit::CorpusScene& entry) {
    return entry.file.parent_path().filename() != "dumptest-examples" ||
           entry.name == "example025";  // is no scene
  });
  files.push_back({"plate", STRATA_SOURCE_DIR "/data/plate.csg", ""});
  for (const auto& [name, file, assets] : files) {
    ReadSceneOptions options;
    options.asset_folder = assets.string();
    const auto scene = read_scene(file.string(), options);
    ASSERT_TRUE(scene) << file << ": " << scene.error().message;
    const Bounds box = bounds(scene->tree, scene->tree.root());
    if (box.empty()) continue;
    Camera camera;
    centre_camera(camera, box);
    fit_camera(camera, box);
    expect_same(scene->tree, camera, {150, 110}, name);
  }
  EXPECT_GT(walked_, 10000u);
}

TEST_F(GlSurface, AMovedSolidIsSeenWhereItIs) {
  RandomTree random(33);
  Tree tree;
  tree.set_root(random.grow(tree, 8, false));
  Preview own(tree, {}, 0), other(tree, {}, 0);
  other.set_source(source_.get());
  const auto view = make_view(random_camera(random, own.box()), {100, 100}, own.box());
  ASSERT_TRUE(view);
  ASSERT_TRUE(own.draw(*view) && other.draw(*view));
  const glm::dmat4 m = glm::translate(glm::dmat4(1.0), glm::dvec3(1, 2, 0.5));
  const auto expected = own.move_solid(0, m);
  const auto found = other.move_solid(0, m);
  ASSERT_TRUE(expected && found);
  expect_same_surface(**found, **expected, "moved");
  EXPECT_GT(std::count((*found)->solid.begin(), (*found)->solid.end(), 0u), 0);
}

}  // namespace
}  // namespace strata::csg
