// The compute rasterizer against the CPU's: the same fragments, bit for bit, for triangles of every
// size, on screens of every shape.

#include "raster/gl/compute.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "strata/mesh/shapes.h"
#include "tests/gl/gl_testing.h"
#include "tests/raster/gl/fragment_log.h"
#include "tests/support/corpus.h"
#include "tests/support/reference_lists.h"
#include "tests/support/trouble.h"

namespace strata {
namespace {

using testkit::reference_lists;

constexpr Axis kAxes[] = {Axis::kX, Axis::kY, Axis::kZ};

class ComputeRasterizerTest : public test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (!context_) return;
    auto made = gl::ComputeRasterizer::create(*context_);
    ASSERT_TRUE(made) << made.error().message;
    rasterizer_ = std::move(*made);
    log_.emplace();
  }
  void TearDown() override {
    log_.reset();
    rasterizer_.reset();
    GlTest::TearDown();
  }

  testkit::Lists<DepthItem> drawn(const LatticeMesh& mesh, const RasterTarget& target) {
    const auto set = rasterizer_->set_mesh(mesh);
    EXPECT_TRUE(set) << set.error().message;
    rasterizer_->set_target(target, 0, target.height);
    auto lists = log_->lists(*rasterizer_);
    EXPECT_TRUE(lists) << lists.error().message;
    return lists ? *lists : testkit::Lists<DepthItem>();
  }
  void expect_same(const LatticeMesh& mesh, const RasterTarget& target, const std::string& what) {
    const auto expected = reference_lists<DepthItem>(mesh, target);
    const auto found = drawn(mesh, target);
    EXPECT_EQ(found.offsets, expected.offsets) << what;
    EXPECT_TRUE(found == expected) << what << ": " << found.keys.size() << " fragments, "
                                   << expected.keys.size() << " expected";
  }
  void expect_same(const TriangleSoup& soup, int resolution, const std::string& what) {
    expect_same(soup, testkit::grid_around(soup, resolution), what);
  }
  void expect_same(const TriangleSoup& soup, const VoxelGrid& grid, const std::string& what) {
    const auto mesh = snap_to_lattice(soup, grid);
    ASSERT_TRUE(mesh) << what;
    for (const Axis axis : kAxes) {
      expect_same(*mesh, testkit::target_of(grid, axis),
                  what + " along " + "xyz"[static_cast<int>(axis)]);
    }
  }

  std::unique_ptr<gl::ComputeRasterizer> rasterizer_;
  std::optional<test::FragmentLog> log_;
};

struct Triangles {
  LatticeVertices vertices;
  std::vector<glm::uvec3> triangles;
  void add(const glm::ivec3& a, const glm::ivec3& b, const glm::ivec3& c) {
    const auto i = static_cast<unsigned>(vertices.size());
    vertices.insert(vertices.end(), {a, b, c});
    triangles.emplace_back(i, i + 1, i + 2);
  }
  [[nodiscard]] LatticeMesh lattice() const { return {vertices, triangles}; }
};

TEST_F(ComputeRasterizerTest, TrianglesOfEverySizeGiveTheFragmentsOfTheReference) {
  std::mt19937_64 random(11);
  const auto between = [&](std::int64_t low, std::int64_t high) {
    return static_cast<int>(std::uniform_int_distribution<std::int64_t>(low, high)(random));
  };
  for (int bits = 6; bits <= 28; ++bits) {
    for (const Axis axis : kAxes) {
      const AxisFrame frame(axis);
      const RasterTarget target{axis, between(1, 150), between(1, 150), 1u << 24};
      Triangles scene;
      for (int i = 0; i < 60; ++i) {
        const std::int64_t reach = std::int64_t{1} << bits;
        const std::int64_t depth = std::int64_t{1} << between(0, 28);
        const int cu = between(0, target.width * 256), cv = between(0, target.height * 256);
        const std::int64_t cw = between(-1000, (1 << 24) + 1000);
        glm::ivec3 p[3];
        for (auto& q : p) {
          const auto near = [&](std::int64_t centre, std::int64_t spread) {
            constexpr std::int64_t kFar = kMaxLatticeCoordinate;
            std::int64_t at = std::clamp(centre + between(-spread, spread), -kFar, kFar);
            if (i % 3 == 0) at = at / 128 * 128;  // on centres and between them
            return static_cast<int>(at);
          };
          q[frame.u] = near(cu, reach);
          q[frame.v] = near(cv, reach);
          q[frame.w] = near(cw, depth);
        }
        scene.add(p[0], p[1], p[2]);
        if (i % 10 == 0) scene.add(p[0], p[1], p[2]);  // twice is two
      }
      expect_same(scene.lattice(), target, "extent 2^" + std::to_string(bits));
      if (HasFailure()) return;
    }
  }
}

TEST_F(ComputeRasterizerTest, ScreensOfEveryShapeGiveTheFragmentsOfTheReference) {
  const TriangleSoup soup = make_torus_knot(2, 3, 0.4, 60, 12);
  for (const auto& [width, height] :
       {std::pair{1, 1}, {7, 3}, {1, 200}, {200, 1}, {31, 33}, {65, 63}, {100, 129}}) {
    VoxelGrid grid;
    grid.dims = {width, height, 50};
    grid.origin = glm::dvec3(-3.6, -3.6, -1.6);
    grid.voxel_size = {7.2 / width, 7.2 / height, 3.2 / 50};
    const auto mesh = snap_to_lattice(soup, grid);
    ASSERT_TRUE(mesh);
    for (const Axis axis : kAxes) {
      expect_same(*mesh, testkit::target_of(grid, axis),
                  std::to_string(width) + " x " + std::to_string(height));
    }
  }
}

TEST_F(ComputeRasterizerTest, ClosedSolidsAndTroubleGiveTheFragmentsOfTheReference) {
  expect_same(make_box({0, 0, 0}, {1, 2, 3}), 40, "box");
  expect_same(make_icosphere(1.0, 5), 100, "icosphere");
  expect_same(make_uv_sphere(1.0, 16, 8), 250, "sphere of large triangles");
  for (const auto& [name, soup] : testkit::closed_trouble()) {
    expect_same(soup, testkit::unit_grid({40, 40, 40}), name);
  }
}

TEST_F(ComputeRasterizerTest, BandsOfRowsAreTheRowsOfTheWhole) {
  const TriangleSoup soup = make_uv_sphere(1.0, 24, 12);
  const VoxelGrid grid = testkit::grid_around(soup, 90);
  const auto mesh = snap_to_lattice(soup, grid);
  ASSERT_TRUE(mesh);
  const RasterTarget target = testkit::target_of(grid, Axis::kZ);
  const auto whole = reference_lists<DepthItem>(*mesh, target);
  ASSERT_TRUE(rasterizer_->set_mesh(*mesh));
  for (const auto& [begin, end] : {std::pair{0, 1}, {13, 14}, {64, target.height}, {20, 61}}) {
    // As a screen of its own, and as rows of the whole screen.
    rasterizer_->set_target(target, begin, end);
    const auto band = log_->lists(*rasterizer_);
    ASSERT_TRUE(band) << band.error().message;
    rasterizer_->set_target(target, 0, target.height);
    const auto rows = log_->lists(
        *rasterizer_, {static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end)});
    ASSERT_TRUE(rows) << rows.error().message;
    for (int v = begin; v < end; ++v) {
      for (int u = 0; u < target.width; ++u) {
        const auto pixel = static_cast<std::size_t>(v * target.width + u);
        const auto in_band = static_cast<std::size_t>((v - begin) * target.width + u);
        ASSERT_TRUE(std::ranges::equal(band->list(in_band), whole.list(pixel)));
        ASSERT_TRUE(std::ranges::equal(rows->list(pixel), whole.list(pixel)));
      }
    }
  }
}

TEST_F(ComputeRasterizerTest, RealMeshesGiveTheFragmentsOfTheReference) {
  const auto meshes = testkit::scans({"bunny00", "cow", "homer", "lion-head"});
  if (meshes.empty()) GTEST_SKIP() << testkit::kNoScans;
  for (const auto& [name, mesh] : meshes) expect_same(mesh, 200, name);
}

}  // namespace
}  // namespace strata
