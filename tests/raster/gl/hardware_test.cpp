// The hardware rasterizer against the CPU: what differs is counted, and is of two kinds only.

#include "raster/gl/hardware.h"

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <string>

#include "hashbuffer/gl/hash_store.h"
#include "hashbuffer/gl/scan_store.h"
#include "hashbuffer/random.h"
#include "strata/hashbuffer/build_ldi.h"
#include "strata/mesh/shapes.h"
#include "tests/gl/gl_testing.h"

namespace strata::gl {
namespace {

using GlHardware = test::GlTest;

VoxelGrid grid_of(glm::ivec3 dims, double size) {
  VoxelGrid grid;
  grid.dims = dims;
  grid.voxel_size = glm::dvec3(size);
  grid.origin = -0.5 * size * glm::dvec3(dims);
  return grid;
}

struct Difference {
  std::uint64_t fragments = 0;
  std::uint64_t lengths = 0;      ///< pixels whose lists are not of one length
  std::uint64_t not_outline = 0;  ///< of those, pixels that are no silhouette's
  std::uint64_t one_step = 0;     ///< crossings that differ by one depth step
  std::uint64_t deeper = 0;       ///< by more
  std::uint64_t others = 0;       ///< crossings of other triangles, or seen from the other side
};

/// A pixel is of a silhouette if lists of its neighbourhood are not all of one length.
bool is_outline(const LayeredDepthImage& image, int u, int v) {
  for (int y = std::max(v - 1, 0); y <= std::min(v + 1, image.height - 1); ++y) {
    for (int x = std::max(u - 1, 0); x <= std::min(u + 1, image.width - 1); ++x) {
      if (image.list(x, y).size() != image.list(u, v).size()) return true;
    }
  }
  return false;
}

Difference compare(const LayeredDepthImage& cpu, const LayeredDepthImage& gpu) {
  Difference found;
  for (int v = 0; v < cpu.height; ++v) {
    for (int u = 0; u < cpu.width; ++u) {
      const auto a = cpu.list(u, v), b = gpu.list(u, v);
      found.fragments += a.size();
      if (a.size() != b.size()) {
        ++found.lengths;
        found.not_outline += !is_outline(cpu, u, v) && !is_outline(gpu, u, v);
        continue;
      }
      for (std::size_t i = 0; i < a.size(); ++i) {
        const auto step = std::abs(static_cast<std::int64_t>(a[i].depth()) -
                                   static_cast<std::int64_t>(b[i].depth()));
        found.one_step += step == 1;
        found.deeper += step > 1;
        found.others += a[i].payload() != b[i].payload();
      }
    }
  }
  return found;
}

/// Lists of the mesh by both, along the axis.
Difference difference(const Context& context, HardwareRasterizer& rasterizer, Store& store,
                      const TriangleSoup& mesh, const VoxelGrid& grid, Axis axis) {
  static_cast<void>(context);
  const auto lattice = snap_to_lattice(mesh, grid);
  EXPECT_TRUE(lattice);
  const RasterTarget target = raster_target(grid, axis);
  const auto cpu = build_ldi(*lattice, target);
  EXPECT_TRUE(cpu);
  const auto set = rasterizer.set_mesh(*lattice);
  EXPECT_TRUE(set) << set.error().message;
  rasterizer.set_target(target);
  const auto report = build(store, rasterizer);
  EXPECT_TRUE(report) << report.error().message;
  const auto gpu = store.download();
  EXPECT_TRUE(gpu) << gpu.error().message;
  if (!report || !gpu || !cpu) return {.deeper = ~0ull};
  return compare(*cpu, *gpu);
}

TEST_F(GlHardware, DiffersFromTheCpuInSilhouettePixelsAndByOneDepthStepOnly) {
  auto rasterizer = HardwareRasterizer::create(*context_);
  ASSERT_TRUE(rasterizer) << rasterizer.error().message;
  auto store = HashStore::create(context_->info());
  ASSERT_TRUE(store);
  const struct {
    const char* name;
    TriangleSoup mesh;
  } meshes[] = {{"sphere", make_icosphere(0.9, 4)},
                {"torus", make_torus(0.6, 0.25, 60, 31)},
                {"knot", make_torus_knot(2, 3, 0.2, 150, 20)},
                {"box", make_box(glm::dvec3(-0.5), glm::dvec3(0.71))},
                {"cone", make_cone(0.8, 1.1, 7)}};
  Difference all;
  for (const auto& [name, mesh] : meshes) {
    for (const glm::ivec3 dims : {glm::ivec3(128, 117, 90), glm::ivec3(33, 64, 71)}) {
      for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
        const auto found = difference(*context_, **rasterizer, **store, mesh,
                                      grid_of(dims, 4.0 / (dims.x + dims.y)), axis);
        EXPECT_EQ(found.not_outline, 0u) << name << ", axis " << static_cast<int>(axis);
        EXPECT_EQ(found.deeper, 0u) << name << ", axis " << static_cast<int>(axis);
        all.fragments += found.fragments;
        all.lengths += found.lengths;
        all.one_step += found.one_step;
        all.others += found.others;
      }
    }
  }
  RecordProperty("fragments", std::to_string(all.fragments));
  RecordProperty("lengths", std::to_string(all.lengths));
  RecordProperty("one_step", std::to_string(all.one_step));
  RecordProperty("others", std::to_string(all.others));
  EXPECT_GT(all.fragments, 100000u);
  EXPECT_LT(all.lengths * 500, all.fragments);
  EXPECT_LT(all.one_step * 500, all.fragments);
  EXPECT_LT(all.others * 500, all.fragments);
}

TEST_F(GlHardware, WhereNoCentreLiesOnAnEdgeTheListsAreTheCpus) {
  auto rasterizer = HardwareRasterizer::create(*context_);
  ASSERT_TRUE(rasterizer) << rasterizer.error().message;
  // Vertices off the lattice of pixel centres, edges of odd slope: a thousand random triangles.
  Random random(3);
  LatticeVertices vertices;
  std::vector<glm::uvec3> triangles;
  const auto coordinate = [&](std::uint64_t side) {
    return static_cast<std::int32_t>(random.below(side * 256)) | 1;
  };
  for (std::uint32_t i = 0; i < 1000; ++i) {
    for (int corner = 0; corner < 3; ++corner) {
      vertices.emplace_back(coordinate(77), coordinate(50), coordinate(60));
    }
    triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  LatticeMesh mesh;
  mesh.vertices = vertices;
  mesh.triangles = triangles;
  const RasterTarget target{Axis::kZ, 77, 50, 60 * 256};
  ASSERT_TRUE((*rasterizer)->set_mesh(mesh));
  (*rasterizer)->set_target(target);
  auto store = ScanStore::create(context_->info());
  ASSERT_TRUE(store);
  const auto report = build(**store, **rasterizer);
  ASSERT_TRUE(report) << report.error().message;
  const auto gpu = (*store)->download();
  const auto cpu = build_ldi(mesh, target);
  ASSERT_TRUE(gpu && cpu);
  std::uint64_t differing = 0;
  for (int v = 0; v < target.height; ++v) {
    for (int u = 0; u < target.width; ++u) {
      const auto a = cpu->list(u, v), b = gpu->list(u, v);
      differing += !std::equal(a.begin(), a.end(), b.begin(), b.end());
    }
  }
  // A centre may lie on an edge by chance.
  EXPECT_LE(differing, 8u) << "of " << target.width * target.height << " pixels, "
                           << cpu->items.size() << " fragments";
}

TEST_F(GlHardware, BothStoresAndBandsGiveTheSameLists) {
  auto rasterizer = HardwareRasterizer::create(*context_);
  ASSERT_TRUE(rasterizer) << rasterizer.error().message;
  const VoxelGrid grid = grid_of({100, 90, 80}, 0.025);
  const TriangleSoup soup = make_torus_knot(3, 5, 0.15, 200, 12);
  const auto lattice = snap_to_lattice(soup, grid);
  ASSERT_TRUE(lattice);
  ASSERT_TRUE((*rasterizer)->set_mesh(*lattice));
  (*rasterizer)->set_target(raster_target(grid, Axis::kY));
  std::vector<std::unique_ptr<Store>> stores;
  const Info& info = context_->info();
  stores.push_back(*HashStore::create(info, {.path = WordPath::kTwoPass}));
  stores.push_back(*HashStore::create(info, {.offsets = OffsetKind::kRandom}));
  stores.push_back(*HashStore::create(info, {.binding_bytes = 20000}));
  stores.push_back(*ScanStore::create(info));
  stores.push_back(*ScanStore::create(info, {.binding_bytes = 20000}));
  std::vector<LayeredDepthImage> images;
  for (auto& store : stores) {
    const auto report = build(*store, **rasterizer);
    ASSERT_TRUE(report) << report.error().message;
    auto image = store->download();
    ASSERT_TRUE(image) << image.error().message;
    images.push_back(std::move(*image));
    const auto found = compare(images.front(), images.back());
    EXPECT_TRUE(images.back() == images.front())
        << images.size() << ": " << found.lengths << " lengths, " << found.one_step << " one step, "
        << found.deeper << " deeper, " << found.others << " others of " << found.fragments;
  }
  EXPECT_GT(stores[2]->bands(), 1);
  EXPECT_GT(stores[4]->bands(), 1);
}

}  // namespace
}  // namespace strata::gl
