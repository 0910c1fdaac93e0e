// Meshes through the compute rasterizer into every store of the GPU: the lists of build_ldi(), bit
// for bit.

#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "hashbuffer/gl/compute_lists.h"
#include "hashbuffer/gl/hash_store.h"
#include "hashbuffer/gl/scan_store.h"
#include "raster/gl/compute.h"
#include "strata/hashbuffer/build_ldi.h"
#include "strata/mesh/formats/read_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/gl/gl_testing.h"
#include "tests/support/corpus.h"
#include "tests/support/reference_lists.h"
#include "tests/support/trouble.h"

namespace strata {
namespace {

constexpr Axis kAxes[] = {Axis::kX, Axis::kY, Axis::kZ};

class StoredLists : public test::GlTest {
 protected:
  void TearDown() override {
    sources_.clear();
    GlTest::TearDown();
  }

  /// `name`: a store, made at its first use.
  void with(const std::string& name, Result<std::unique_ptr<gl::Store>> store,
            std::int64_t pixels_at_once = 1 << 22) {
    ASSERT_TRUE(store) << name << ": " << store.error().message;
    auto source =
        gl::ComputeListSource::create(*context_, *std::move(store), nullptr, pixels_at_once);
    ASSERT_TRUE(source) << source.error().message;
    sources_[name] = *std::move(source);
  }
  void with_hash(const std::string& name, const gl::HashStoreOptions& options) {
    with(name, gl::HashStore::create(context_->info(), options));
  }
  void with_all() {
    with("scan", gl::ScanStore::create(context_->info()));
    with("scan, a row of tiles at once", gl::ScanStore::create(context_->info()), 1);
    with("scan in bands", gl::ScanStore::create(context_->info(), {.binding_bytes = 1 << 16}));
    with_hash("hash", {});
    with_hash("hash in two passes", {.path = gl::WordPath::kTwoPass});
    with_hash("hash, random offsets", {.offsets = OffsetKind::kRandom});
    with_hash("full hash in bands", {.cells = 1, .binding_bytes = 1 << 17});
  }

  void expect_same(const LatticeMesh& mesh, const RasterTarget& target, const std::string& what) {
    const auto expected = build_ldi(mesh, target);
    ASSERT_TRUE(expected) << what;
    for (const auto& [name, source] : sources_) {
      const auto found = build_ldi(*source, mesh, target);
      ASSERT_TRUE(found) << what << ", " << name << ": " << found.error().message;
      EXPECT_TRUE(*found == *expected) << what << ", " << name << ": " << found->items.size()
                                       << " fragments, " << expected->items.size() << " expected";
    }
  }
  void expect_same(const TriangleSoup& soup, const VoxelGrid& grid, const std::string& what) {
    const auto mesh = snap_to_lattice(soup, grid);
    ASSERT_TRUE(mesh) << what;
    for (const Axis axis : kAxes) {
      expect_same(*mesh, testkit::target_of(grid, axis),
                  what + " along " + "xyz"[static_cast<int>(axis)]);
    }
  }

  std::map<std::string, std::unique_ptr<gl::ComputeListSource>> sources_;
};

TEST_F(StoredLists, AreTheCpusOnScreensOfEveryShape) {
  with_all();
  const TriangleSoup soup = make_torus_knot(2, 3, 0.4, 60, 12);
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {130, 2}, {2, 130}, {97, 129}}) {
    VoxelGrid grid;
    grid.dims = {width, height, 50};
    grid.origin = glm::dvec3(-3.6, -3.6, -1.6);
    grid.voxel_size = {7.2 / width, 7.2 / height, 3.2 / 50};
    expect_same(soup, grid, std::to_string(width) + " x " + std::to_string(height));
  }
}

TEST_F(StoredLists, AreTheCpusForTrouble) {
  with_all();
  for (const auto& [name, soup] : testkit::closed_trouble()) {
    expect_same(soup, testkit::unit_grid({24, 24, 24}), name);
  }
}

/// `count` walls across z, each `times` times.
TriangleSoup walls(int count, int times) {
  TriangleSoup all;
  for (int i = 0; i < count; ++i) {
    const TriangleSoup wall = make_box({0.3, 0.3, 2.0 * i + 0.2}, {20.7, 12.7, 2.0 * i + 1.2});
    for (int k = 0; k < times; ++k) {
      const auto first = static_cast<unsigned>(all.positions.size());
      all.positions.insert(all.positions.end(), wall.positions.begin(), wall.positions.end());
      for (const auto& t : wall.triangles) all.triangles.push_back(t + first);
    }
  }
  return all;
}

TEST_F(StoredLists, KeepEveryOneOfHundredsOfLayersAndOfTwins) {
  with_all();
  expect_same(walls(50, 2), testkit::unit_grid({22, 14, 100}), "200 layers, each twice");
  expect_same(walls(10, 10), testkit::unit_grid({22, 14, 20}), "20 layers, ten times");
  sources_.clear();  // 255 layers are all that a record's age counts
  with("scan", gl::ScanStore::create(context_->info()));
  for (const int count : {150, 300}) {
    expect_same(walls(count, 1), testkit::unit_grid({22, 14, 2 * count}),
                std::to_string(2 * count) + " layers");
  }
}

TEST_F(StoredLists, HashTablesTakeDeepListsUnderLargeTriangles) {
  // Threads insert 32 pixels each, so these take more than 5000 steps.
  with_hash("hash", {});
  with_hash("hash in two passes", {.path = gl::WordPath::kTwoPass});
  const TriangleSoup soup = walls(80, 1);
  VoxelGrid grid = testkit::unit_grid({64, 64, 160});
  grid.voxel_size = {22.0 / 64, 14.0 / 64, 1.0};
  const auto mesh = snap_to_lattice(soup, grid);
  ASSERT_TRUE(mesh);
  expect_same(*mesh, testkit::target_of(grid, Axis::kZ), "160 layers of 64 x 64 pixels");
  // With more rows than can be cut into a few bands, a driver with few steps may refuse, at once.
  const TriangleSoup deep_soup = walls(127, 1);
  VoxelGrid deep_grid = testkit::unit_grid({24, 140, 254});
  deep_grid.voxel_size = {22.0 / 24, 14.0 / 140, 1.0};
  const auto deep = snap_to_lattice(deep_soup, deep_grid);
  ASSERT_TRUE(deep);
  const RasterTarget target = testkit::target_of(deep_grid, Axis::kZ);
  const auto found = build_ldi(*sources_["hash"], *deep, target);
  if (found) {
    EXPECT_TRUE(*found == build_ldi(*deep, target).value());
  } else {
    EXPECT_EQ(found.error().code, ErrorCode::kLimit);
    EXPECT_NE(found.error().message.find("steps of a thread"), std::string::npos)
        << found.error().message;
  }
}

TEST_F(StoredLists, ASpareStoreTakesWhatIsTooDeepForTheHash) {
  auto hash = gl::HashStore::create(context_->info());
  auto scan = gl::ScanStore::create(context_->info());
  ASSERT_TRUE(hash && scan);
  auto source = gl::ComputeListSource::create(*context_, *std::move(hash), *std::move(scan));
  ASSERT_TRUE(source);
  sources_["hash, then scan"] = *std::move(source);
  expect_same(walls(150, 1), testkit::unit_grid({22, 14, 300}), "300 layers");
}

TEST_F(StoredLists, ATableThatIsFarTooFullLosesNothing) {
  // A cell a pixel, no hint, and threads that insert many fragments each.
  auto rasterizer = gl::ComputeRasterizer::create(*context_);
  ASSERT_TRUE(rasterizer);
  const VoxelGrid grid = testkit::unit_grid({24, 24, 24});
  const RasterTarget target = testkit::target_of(grid, Axis::kZ);
  for (const int bits : {32, 64}) {
    for (const auto& [name, soup] : testkit::closed_trouble()) {
      const auto mesh = snap_to_lattice(soup, grid);
      ASSERT_TRUE(mesh);
      const auto expected = build_ldi(*mesh, target);
      ASSERT_TRUE(expected);
      auto store = gl::HashStore::create(context_->info(), {.record_bits = bits});
      ASSERT_TRUE(store);
      ASSERT_TRUE((*rasterizer)->set_mesh(*mesh));
      (*rasterizer)->set_target(target, 0, target.height);
      const auto built = gl::build(**store, **rasterizer);
      ASSERT_TRUE(built) << name << ": " << built.error().message;
      const auto found = (*store)->download();
      ASSERT_TRUE(found);
      EXPECT_TRUE(found->offsets == expected->offsets) << name << ", " << bits << " bits";
      if (bits == 64) {
        EXPECT_TRUE(found->items == expected->items) << name;
      }
    }
  }
}

TEST_F(StoredLists, OfRealMeshesAreTheCpus) {
  with("scan", gl::ScanStore::create(context_->info()));
  with_hash("hash", {});
  const std::string data = STRATA_SOURCE_DIR "/data/";
  for (const char* name : {"knot.obj", "link.ply", "two_spheres.stl", "open_sphere.off"}) {
    const auto soup = read_mesh(data + name);
    ASSERT_TRUE(soup) << name << ": " << soup.error().message;
    expect_same(soup->soup, testkit::grid_around(soup->soup, 150), name);
  }
  for (const auto& [name, mesh] : testkit::scans({"bunny00", "man"})) {
    expect_same(mesh, testkit::grid_around(mesh, 256), name);
  }
}

}  // namespace
}  // namespace strata
