// The lists of a tree's result that the GPU makes are those that the CPU's filter makes, bit for
// bit.

#include "csg/gl/result_lists.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <stop_token>
#include <thread>
#include <utility>

#include "csg/gl/result_lists_for_tests.h"
#include "hashbuffer/gl/hash_store.h"
#include "hashbuffer/gl/scan_store.h"
#include "strata/csg/solid_lists.h"
#include "strata/hashbuffer/build_ldi.h"
#include "strata/mesh/soup_tools.h"
#include "strata/voxelize/voxelize.h"
#include "tests/csg/random_tree.h"
#include "tests/gl/gl_testing.h"

namespace strata::csg {
namespace {

class GlResult : public test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (context_) use(gl::ScanStore::create(context_->info()));
  }
  void TearDown() override {
    source_.reset();
    GlTest::TearDown();
  }
  template <class Store>
  void use(Result<std::unique_ptr<Store>> store, std::int64_t pixels_at_once = 1 << 22) {
    ASSERT_TRUE(store) << store.error().message;
    source_.reset();
    auto source = GlResultSource::create(*context_, *std::move(store), nullptr, pixels_at_once);
    ASSERT_TRUE(source) << source.error().message;
    source_ = *std::move(source);
  }

  /// Compares the lists of a tree on a grid, along all axes.
  void expect_same(const Tree& tree, const VoxelGrid& grid, const std::string& what) {
    const SolidLists lists(tree, tree.root());
    const auto mesh = snap_to_lattice(lists.soup(), grid);
    ASSERT_TRUE(mesh) << what;
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      const RasterTarget target = raster_target(grid, axis);
      const auto expected = build_ldi(*mesh, target, {}, {}, &lists.filter());
      const auto found = build_ldi(*source_, *mesh, target, {}, &lists.filter());
      ASSERT_TRUE(expected) << what << ": " << expected.error().message;
      ASSERT_TRUE(found) << what << ": " << found.error().message;
      EXPECT_TRUE(found->offsets == expected->offsets) << what << ": other lengths";
      EXPECT_TRUE(found->items == expected->items) << what << ": other items";
      walked_ += source_->counts().walked;
      handed_over_ += source_->counts().handed_over;
    }
  }

  std::unique_ptr<GlResultSource> source_;
  std::uint64_t walked_ = 0, handed_over_ = 0;
};

VoxelGrid grid_of(RandomTree& random) {
  VoxelGrid grid;
  grid.dims = {random.pick(1, 150), random.pick(1, 150), random.pick(1, 90)};
  grid.origin = glm::dvec3(-9, -8, -7.5);
  grid.voxel_size = glm::dvec3(18, 16, 15) / glm::dvec3(grid.dims);
  return grid;
}

TEST_F(GlResult, OfRandomTreesIsTheFilters) {
  for (int seed = 0; seed < 60; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 8000);
    Tree tree;
    tree.set_root(random.grow(tree, random.pick(1, seed % 8 == 0 ? 60 : 12), seed % 3 == 0));
    expect_same(tree, grid_of(random), "seed " + std::to_string(seed));
    if (HasFailure()) return;
  }
  // It is the GPU that made them.
  EXPECT_GT(walked_, 100000u);
  EXPECT_LT(handed_over_, walked_ / 20);
}

/// A mesh that is open, overlaps itself, is inside out, or all of that.
TriangleSoup odd_mesh(RandomTree& random) {
  TriangleSoup mesh = random.pick(0, 1) == 0 ? make_icosphere(1.5, 2) : make_torus(1.2, 0.5, 14, 9);
  if (random.pick(0, 1) == 0) {
    const TriangleSoup again = mesh;
    const glm::dvec3 step(random.real(-1, 1), random.real(-1, 1), random.real(0, 1));
    for (const auto& p : again.positions) mesh.positions.push_back(p + step);
    for (const auto& t : again.triangles) {
      mesh.triangles.push_back(t + static_cast<unsigned>(again.positions.size()));
    }
  }
  if (random.pick(0, 2) == 0) mesh.triangles.resize(mesh.triangles.size() * 3 / 4);
  if (random.pick(0, 2) == 0) {
    for (auto& t : mesh.triangles) std::swap(t.x, t.y);
  }
  return mesh;
}

TEST_F(GlResult, OfSolidsThatAreOpenOrOverlapThemselvesIsTheFilters) {
  constexpr InsideRule kRules[] = {InsideRule::kWinding, InsideRule::kNonzero, InsideRule::kParity};
  for (int seed = 0; seed < 40; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 600);
    Tree tree;
    tree.set_root(random.grow(tree, random.pick(2, 9), seed % 4 == 0));
    for (Solid& solid : tree.solids()) {
      solid.rule = kRules[random.pick(0, 2)];
      if (random.pick(0, 1) == 0) {
        solid.mesh = std::make_shared<TriangleSoup>(odd_mesh(random));
      }
    }
    expect_same(tree, grid_of(random), "seed " + std::to_string(seed));
    if (HasFailure()) return;
  }
  EXPECT_GT(walked_, 50000u);
  EXPECT_GT(handed_over_, 5000u);
}

TEST_F(GlResult, StopsAtAnyTime) {
  // Balls that overlap themselves: many pixels are handed over.
  Tree tree;
  TriangleSoup balls;
  for (int i = 0; i < 6; ++i) {
    TriangleSoup ball = make_icosphere(4, 3);
    for (glm::dvec3& p : ball.positions) p.x += 0.5 * i;
    append(balls, ball);
  }
  Solid solid;
  solid.mesh = std::make_shared<TriangleSoup>(std::move(balls));
  Solid other;
  other.mesh = std::make_shared<TriangleSoup>(make_box({-9, -9, 0}, {9, 9, 9}));
  const auto a = tree.add_solid(std::move(solid)), b = tree.add_solid(std::move(other));
  tree.set_root(tree.add(Operation::kDifference, {a, b}));
  const SolidLists lists(tree, tree.root());
  VoxelGrid grid;
  grid.dims = {250, 250, 100};
  grid.origin = glm::dvec3(-9);
  grid.voxel_size = glm::dvec3(18) / glm::dvec3(grid.dims);
  const auto mesh = snap_to_lattice(lists.soup(), grid);
  ASSERT_TRUE(mesh);
  const RasterTarget target = raster_target(grid, Axis::kZ);
  const auto expected = build_ldi(*mesh, target, {}, {}, &lists.filter());
  ASSERT_TRUE(expected);
  int stopped = 0;
  for (int delay = 0; delay < 400; delay += delay < 20 ? 2 : 20) {
    std::stop_source stop;
    Execution execution;
    execution.stop = stop.get_token();
    auto source = GlResultSource::create(*context_, gl::ScanStore::create(context_->info()).value(),
                                         nullptr, 1 << 12, execution);
    ASSERT_TRUE(source) << source.error().message;
    const std::jthread later([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(delay));
      stop.request_stop();
    });
    const auto found = build_ldi(**source, *mesh, target, execution, &lists.filter());
    if (found) {
      EXPECT_TRUE(found->items == expected->items);
      continue;
    }
    EXPECT_EQ(found.error().code, ErrorCode::kCancelled) << found.error().message;
    ++stopped;
  }
  EXPECT_GT(stopped, 0);
}

/// Boxes in a row of which every other one is taken from a slab: long lists, many solids.
Tree comb(int teeth) {
  Tree tree;
  const auto box = [&tree](const glm::dvec3& low, const glm::dvec3& high) {
    Solid solid;
    solid.mesh = std::make_shared<TriangleSoup>(make_box(low, high));
    return tree.add_solid(std::move(solid));
  };
  std::vector<Tree::NodeId> operands{box({0, 0, 0}, {4, 4, teeth + 1.0})};
  for (int i = 0; i < teeth; ++i) {
    operands.push_back(box({1 + 0.001 * i, -1, i + 0.25}, {5, 3, i + 0.75}));
  }
  tree.set_root(tree.add(Operation::kDifference, operands));
  return tree;
}

TEST_F(GlResult, OfManySolidsIsTheFilters) {
  for (const int teeth : {1, 30, 31, 200, 900, 1100}) {
    walked_ = handed_over_ = 0;
    VoxelGrid grid;
    grid.dims = {20, 70, 2 * teeth + 4};
    grid.origin = {-0.5, -0.5, -0.5};
    grid.voxel_size = {6.0 / 20, 6.0 / 70, 0.5};
    expect_same(comb(teeth), grid, std::to_string(teeth) + " teeth");
    EXPECT_GT(walked_, 0u) << teeth;
    EXPECT_EQ(handed_over_ > 0, teeth > 1000) << teeth;  // the walk has no bits for them
  }
}

TEST_F(GlResult, OfTreesOfManyNodesIsTheFilters) {
  RandomTree random(17);
  Tree tree;
  std::vector<Tree::NodeId> operands;
  for (int i = 0; i < 150; ++i) {
    const auto slab = [&](double low, double high) {
      Solid solid;
      solid.mesh = std::make_shared<TriangleSoup>(
          make_box({-5 + random.real(0, 1), -5, low}, {5, 5 - random.real(0, 1), high}));
      return tree.add_solid(std::move(solid));
    };
    const auto first = slab(0.1 * i, 0.1 * i + 0.06), second = slab(0.1 * i + 0.03, 0.1 * i + 0.2);
    operands.push_back(tree.add(Operation::kIntersection, {first, second}));
  }
  tree.set_root(tree.add(Operation::kUnion, operands));
  const VoxelGrid grid{glm::ivec3(60, 50, 400), glm::dvec3(-6, -6, -1),
                       glm::dvec3(0.2, 0.24, 0.05)};
  expect_same(tree, grid, "150 pairs");
  EXPECT_GT(walked_, 0u);
  EXPECT_EQ(handed_over_, 0u);
}

TEST_F(GlResult, OfVeryLongListsIsTheFilters) {
  // A solid of 12000 sheets, seen from its edges and its faces.
  Tree tree;
  TriangleSoup sheets;
  for (int i = 0; i < 6000; ++i) {
    const TriangleSoup sheet = make_box({0, 0, i + 0.2}, {4, 4, i + 0.7});
    const auto first = static_cast<unsigned>(sheets.positions.size());
    sheets.positions.insert(sheets.positions.end(), sheet.positions.begin(), sheet.positions.end());
    for (const auto& t : sheet.triangles) sheets.triangles.push_back(t + first);
  }
  Solid solid, hole;
  solid.mesh = std::make_shared<TriangleSoup>(std::move(sheets));
  hole.mesh = std::make_shared<TriangleSoup>(make_box({1, 1, 100.5}, {2, 2, 7000}));
  const auto first = tree.add_solid(std::move(solid)), second = tree.add_solid(std::move(hole));
  tree.set_root(tree.add(Operation::kDifference, {first, second}));
  const VoxelGrid grid{glm::ivec3(5, 5, 6001), glm::dvec3(-0.5), glm::dvec3(1)};
  expect_same(tree, grid, "6000 sheets");
}

TEST_F(GlResult, OfATreeThatIsTrueOutsideIsTheFilters) {
  // A union with the complement of a box: no operation makes it, but a program may say it.
  Tree empty;
  expect_same(empty, {glm::ivec3(3), glm::dvec3(0), glm::dvec3(1)}, "nothing");
  RandomTree random(3);
  Tree apart;  // an intersection of solids that never meet
  std::vector<Tree::NodeId> operands;
  for (int i = 0; i < 3; ++i) {
    Solid solid = random.solid(true);
    solid.world_from_mesh = glm::translate(glm::dmat4(1.0), glm::dvec3(30.0 * i, 0, 0));
    operands.push_back(apart.add_solid(std::move(solid)));
  }
  apart.set_root(apart.add(Operation::kIntersection, operands));
  expect_same(apart, {glm::ivec3(140, 20, 20), glm::dvec3(-10), glm::dvec3(1)}, "apart");
}

TEST_F(GlResult, OfEveryStoreIsTheFilters) {
  const std::function<void()> stores[] = {
      [&] {
        use(gl::ScanStore::create(context_->info(), {.payload = true, .binding_bytes = 60000}));
      },
      [&] { use(gl::ScanStore::create(context_->info()), 1); },  // a row of tiles at once
      [&] { use(gl::HashStore::create(context_->info())); },
      [&] {
        use(gl::HashStore::create(context_->info(),
                                  {.path = gl::WordPath::kTwoPass, .binding_bytes = 200000}));
      }};
  for (const auto& store : stores) {
    store();
    for (int seed = 0; seed < 8; ++seed) {
      RandomTree random(static_cast<std::uint64_t>(seed) + 9100);
      Tree tree;
      tree.set_root(random.grow(tree, 10, seed % 2 == 0));
      expect_same(tree, grid_of(random), "seed " + std::to_string(seed));
      if (HasFailure()) return;
    }
  }
}

TEST_F(GlResult, OfItemsBeyondABindingIsTheFilters) {
  // Rows are walked apart, down to one; a row that is too long is the filter's whole.
  for (const std::uint64_t bytes : {30000u, 4000u, 700u}) {
    gl::Info info = context_->info();
    auto store = gl::ScanStore::create(info);
    ASSERT_TRUE(store);
    use(std::move(store));
    ResultListsForTests::limit_binding(*source_, bytes);
    for (int seed = 0; seed < 6; ++seed) {
      RandomTree random(static_cast<std::uint64_t>(seed) + 300);
      Tree tree;
      tree.set_root(random.grow(tree, 3, seed % 2 == 0));
      expect_same(tree, grid_of(random), "seed " + std::to_string(seed));
      if (HasFailure()) return;
    }
  }
}

TEST_F(GlResult, MakesTheVoxelsAndTheReportOfTheCpu) {
  for (int seed = 0; seed < 12; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 50);
    Tree tree;
    tree.set_root(random.grow(tree, 8, seed % 2 == 0));
    const SolidLists lists(tree, tree.root());
    const VoxelGrid grid = grid_of(random);
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      VoxelizeOptions options;
      options.axis = axis;
      options.statistics = true;
      options.filter = &lists.filter();
      VoxelizeReport expected, found;
      ASSERT_TRUE(voxelize(lists.soup(), grid, options, {}, &expected));
      options.source = source_.get();
      ASSERT_TRUE(voxelize(lists.soup(), grid, options, {}, &found));
      EXPECT_EQ(found.checksum, expected.checksum) << seed;
      EXPECT_EQ(found.crossings, expected.crossings) << seed;
      EXPECT_EQ(found.max_depth_complexity, expected.max_depth_complexity) << seed;
      EXPECT_EQ(found.depth_histogram, expected.depth_histogram) << seed;
      EXPECT_EQ(found.unbalanced_columns, expected.unbalanced_columns) << seed;
    }
  }
}

TEST_F(GlResult, LabelsAndMeshesWithoutATreeAreLeftToTheCpu) {
  RandomTree random(4);
  Tree tree;
  tree.set_root(random.grow(tree, 6, false));
  const SolidLists lists(tree, tree.root());
  SolidLists labelled(tree, tree.root());
  labelled.set_labels(id_labels(tree));
  const VoxelGrid grid = grid_of(random);
  const auto mesh = snap_to_lattice(lists.soup(), grid);
  ASSERT_TRUE(mesh);
  ASSERT_TRUE(source_->set_mesh(*mesh));
  EXPECT_TRUE(source_->use_filter(lists.filter()));
  EXPECT_FALSE(source_->use_filter(labelled.filter()));
  const RasterTarget target = raster_target(grid, Axis::kZ);
  for (const SolidLists* each : {&std::as_const(labelled), &lists}) {
    const auto expected = build_ldi(*mesh, target, {}, {}, &each->filter());
    const auto found = build_ldi(*source_, *mesh, target, {}, &each->filter());
    ASSERT_TRUE(expected && found);
    EXPECT_TRUE(*found == *expected);
  }
  const TriangleSoup other = make_box(glm::dvec3(-1), glm::dvec3(1));
  const auto box = snap_to_lattice(other, grid);
  ASSERT_TRUE(box);
  ASSERT_TRUE(source_->set_mesh(*box));
  EXPECT_FALSE(source_->use_filter(lists.filter()));  // it is of another mesh
  const auto expected = build_ldi(*box, target), found = build_ldi(*source_, *box, target);
  ASSERT_TRUE(expected && found);
  EXPECT_TRUE(*found == *expected);
}

}  // namespace
}  // namespace strata::csg
