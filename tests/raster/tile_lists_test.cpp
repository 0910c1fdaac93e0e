// The vector rasterizer and the tile stores against the reference: the same lists, bit for bit, on
// every SIMD target, for triangles of every size, in every store.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <stop_token>

#include "hashbuffer/tile_store.h"
#include "raster/tile_bins.h"
#include "tests/support/reference_lists.h"
#include "tests/support/simd_targets.h"
#include "tests/support/trouble.h"

namespace strata {
namespace {

using namespace testkit;  // NOLINT: the tests' own vocabulary

constexpr OffsetKind kAllOffsets[] = {OffsetKind::kRandom, OffsetKind::kFarthestPoint,
                                      OffsetKind::kPlaneFirst};

struct Scene {
  LatticeVertices vertices;
  std::vector<glm::uvec3> triangles;

  void add(const glm::ivec3& a, const glm::ivec3& b, const glm::ivec3& c) {
    const auto i = static_cast<unsigned>(vertices.size());
    vertices.insert(vertices.end(), {a, b, c});
    triangles.emplace_back(i, i + 1, i + 2);
  }
  [[nodiscard]] LatticeMesh lattice() const { return {vertices, triangles}; }
};

class Maker {
 public:
  explicit Maker(unsigned seed) : random_(seed) {}
  int pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  double real(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  /// A triangle whose longest side across or along the rays is exactly `extent` steps, near a
  /// random place of the image, its plane at a depth within the limit there.
  void add_of_extent(Scene& scene, const RasterTarget& target, std::int64_t extent, int step) {
    const AxisFrame frame(target.axis);
    const int size[2] = {target.width * 256, target.height * 256};
    const int axes[2] = {frame.u, frame.v};
    glm::ivec3 p[3];
    const int along = pick(0, 1);  // which of u and v spans the extent
    const int order = pick(0, 2);
    const std::int64_t other = pick(0, 3) == 0 ? extent / 1000 : extent;
    for (int k = 0; k < 2; ++k) {
      const std::int64_t span = k == along ? extent : other;
      const std::int64_t centre = pick(0, size[k]);
      std::int64_t low = centre - static_cast<std::int64_t>(real(0, 1) * static_cast<double>(span));
      low = low / step * step + (step > 1 ? 128 : 0);
      const std::int64_t middle =
          low + static_cast<std::int64_t>(real(0, 1) * static_cast<double>(span)) / step * step;
      p[order][axes[k]] = clamped(low);
      p[(order + 1) % 3][axes[k]] = clamped(k == along || pick(0, 1) == 0 ? low + span : low);
      p[(order + 2) % 3][axes[k]] = clamped(middle);
    }
    const double depth_limit = static_cast<double>(target.depth_limit);
    const double slope_u = slope(), slope_v = slope();
    const double base = real(-0.1, 1.1) * depth_limit;
    const double cu = size[0] / 2.0, cv = size[1] / 2.0;
    const bool level = pick(0, 7) == 0;
    for (auto& corner : p) {
      const double w =
          base +
          (level ? 0.0 : slope_u * (corner[frame.u] - cu) + slope_v * (corner[frame.v] - cv));
      const double snapped = std::floor(w / step) * step + (step > 1 ? 128 : 0);
      corner[frame.w] = clamped(static_cast<std::int64_t>(std::clamp(snapped, -3e8, 3e8)));
    }
    scene.add(p[0], p[1], p[2]);
  }

  std::mt19937_64& engine() { return random_; }

 private:
  double slope() {
    constexpr double kSlopes[] = {0, 1, -1, 0.5, 1e-3, -1e-6, 30, -1000};
    const double s = kSlopes[pick(0, 7)];
    return pick(0, 1) == 0 ? s : s * real(0.5, 1.5);
  }
  static int clamped(std::int64_t value) {
    constexpr std::int64_t kFar = kMaxLatticeCoordinate;
    return static_cast<int>(std::clamp(value, -kFar, kFar));
  }
  std::mt19937_64 random_;
};

/// Both stores, all offsets, on the targets of this machine.
template <class Key>
void expect_exact(const Scene& scene, const RasterTarget& target, bool every_offset = true) {
  const LatticeMesh mesh = scene.lattice();
  const auto expected = reference_lists<Key>(mesh, target);
  for_each_simd_target([&](const std::string& name) {
    EXPECT_EQ(built_lists<Key>(mesh, target, {.store = StoreKind::kCountScan}), expected)
        << name << ", count/scan";
    for (const OffsetKind offsets : kAllOffsets) {
      if (!every_offset && offsets != OffsetKind::kPlaneFirst) continue;
      EXPECT_EQ(built_lists<Key>(mesh, target, {.store = StoreKind::kHaBuffer, .offsets = offsets}),
                expected)
          << name << ", HA-buffer, offsets " << static_cast<int>(offsets);
    }
  });
}

TEST(TileLists, ScalarAndEveryVectorTargetAreTested) {
  std::vector<std::string> names;
  const int targets = for_each_simd_target([&](const std::string& name) { names.push_back(name); });
  EXPECT_GE(targets, 1);
#if defined(__x86_64__) && !defined(__AVX2__)
  // Neither is left out: the baseline is built, and run, beside the best that the machine has.
  EXPECT_TRUE(std::any_of(names.begin(), names.end(), [](const std::string& name) {
    return name == "SCALAR" || name == "EMU128";
  }));
#endif
}

TEST(TileLists, AreExactForTrianglesOfEverySize) {
  Maker maker(1);
  // Around the limits of the rasterizer's arithmetic, 2^13, 2^16 and 2^21 steps, and both ends.
  constexpr std::int64_t kExtents[] = {
      1,       5,       100,       255,     256,    257,     3000,    8'191,     8'192,
      8'193,   40'000,  65'535,    65'536,  65'537, 200'000, 262'144, 1'000'000, (1 << 21) - 1,
      1 << 21, 2097153, 5'000'000, 1 << 25, 1 << 28};
  constexpr glm::ivec2 kSizes[] = {{1, 1}, {7, 3}, {65, 67}};
  std::size_t crossings = 0;
  for (const auto& size : kSizes) {
    for (const Axis axis : kAllAxes) {
      for (const std::int64_t extent : kExtents) {
        const RasterTarget key_target{axis, size.x, size.y, kMaxDepthKeyLimit};
        const RasterTarget item_target{axis, size.x, size.y, 1 << 24};
        Scene keys, items;
        for (int i = 0; i < 24; ++i) {
          const int coarse = i % 3 == 0 ? 128 : i % 3 == 1 ? 256 : 1;
          const int step = static_cast<int>(std::min<std::int64_t>(coarse, extent));
          maker.add_of_extent(keys, key_target, extent, step);
          maker.add_of_extent(items, item_target, extent, step);
        }
        expect_exact<DepthKey>(keys, key_target, false);
        expect_exact<DepthItem>(items, item_target, false);
        crossings += reference_lists<DepthKey>(keys.lattice(), key_target).keys.size();
        ASSERT_FALSE(HasFailure()) << "extent " << extent << ", axis " << static_cast<int>(axis)
                                   << ", " << size.x << " x " << size.y;
      }
    }
  }
  EXPECT_GT(crossings, 200'000u) << "the triangles miss the image";
}

TEST(TileLists, AreExactWherePlanesMeetTheLattice) {
  // Slopes p / q with odd q, through a pixel's centre: the depth is a whole number at each q-th
  // pixel, where a quotient that is a little too small would show.
  Maker maker(9);
  for (const Axis axis : kAllAxes) {
    const AxisFrame frame(axis);
    const RasterTarget target{axis, 100, 66, 1 << 22};
    for (const int extent : {10'000, 65'000, 300'000, 2'000'000, 20'000'000}) {
      Scene scene;
      for (int i = 0; i < 40; ++i) {
        constexpr int kDivisors[] = {3, 5, 7, 9, 11, 13, 49, 61};
        const int q = kDivisors[i % 8];
        const int slope_u = maker.pick(-9, 9), slope_v = i % 3 == 0 ? 0 : maker.pick(-9, 9);
        glm::ivec3 p[3];
        for (auto& corner : p) {
          const int a = maker.pick(-extent, extent) / q, b = maker.pick(-extent, extent) / q;
          corner[frame.u] = 50 * 256 + 128 + a * q;
          corner[frame.v] = 33 * 256 + 128 + b * q;
          corner[frame.w] = (1 << 21) + a * slope_u + b * slope_v;
        }
        scene.add(p[0], p[1], p[2]);
      }
      expect_exact<DepthKey>(scene, target, false);
      expect_exact<DepthItem>(scene, target, false);
      ASSERT_FALSE(HasFailure()) << "extent " << extent << ", axis " << static_cast<int>(axis);
    }
  }
}

TEST(TileLists, AreExactForSliversAndNeedles) {
  Maker maker(2);
  for (const Axis axis : kAllAxes) {
    const AxisFrame frame(axis);
    const RasterTarget target{axis, 130, 67, 67 * 256};
    for (const int length : {300, 10'000, 70'000, 3'000'000}) {
      Scene scene;
      for (int i = 0; i < 150; ++i) {
        // A base one to three steps wide, and an apex far away; or nearly collinear corners.
        glm::ivec3 p[3];
        for (int k = 0; k < 3; ++k) {
          p[0][k] = maker.pick(0, 130 * 256) / 128 * 128;
          p[1][k] = p[0][k] + maker.pick(-3, 3);
          p[2][k] = p[0][k] + maker.pick(-length, length);
        }
        if (i % 2 == 0) p[1] = (p[0] + p[2]) / 2 + glm::ivec3(0, maker.pick(-1, 1), 1);
        if (i % 5 == 0) p[2][frame.u] = p[0][frame.u];
        if (i % 7 == 0) p[2][frame.v] = p[0][frame.v];
        scene.add(p[0], p[1], p[2]);
      }
      expect_exact<DepthKey>(scene, target);
      expect_exact<DepthItem>(scene, target);
    }
  }
}

TEST(TileLists, AreExactForMeshesThatCauseTrouble) {
  const VoxelGrid grid = unit_grid({70, 26, 66});
  for (const NamedMesh& named : closed_trouble()) {
    const auto lattice = snap_to_lattice(named.mesh, grid);
    ASSERT_TRUE(lattice.has_value());
    for (const Axis axis : kAllAxes) {
      const RasterTarget target = target_of(grid, axis);
      const auto expected = reference_lists<DepthKey>(*lattice, target);
      for_each_simd_target([&](const std::string& simd) {
        EXPECT_EQ(built_lists<DepthKey>(*lattice, target), expected) << named.name << ", " << simd;
      });
    }
  }
}

TEST(TileLists, HoldEqualFragmentsAsOftenAsTheyCome) {
  Scene scene;
  for (int i = 0; i < 40; ++i) scene.add({-90, -90, 500}, {9000, 0, 500}, {0, 9000, 500});
  const RasterTarget target{Axis::kZ, 33, 20, 2560};
  const auto expected = reference_lists<DepthKey>(scene.lattice(), target);
  EXPECT_EQ(expected.list(0).size(), 40u);
  EXPECT_EQ(expected.list(0).front(), expected.list(0).back());
  expect_exact<DepthKey>(scene, target);
  expect_exact<DepthItem>(scene, target);
}

TEST(TileLists, ClampNearAndFarAndLoseNothing) {
  Maker maker(3);
  for (const Axis axis : kAllAxes) {
    const AxisFrame frame(axis);
    for (const std::uint32_t limit : {256u, 512u, 4096u}) {
      const RasterTarget target{axis, 65, 9, limit};
      Scene scene;
      std::size_t clamped = 0;
      for (int i = 0; i < 80; ++i) {
        maker.add_of_extent(scene, {axis, 65, 9, 2048}, i % 2 == 0 ? 5000 : 400'000, 1);
      }
      const auto lists = reference_lists<DepthKey>(scene.lattice(), target);
      for (const DepthKey key : lists.keys) clamped += key >> 1 == 0 || key >> 1 == limit - 1;
      EXPECT_GT(clamped, 100u);
      EXPECT_EQ(lists.keys.size(),
                reference_lists<DepthKey>(scene.lattice(), {axis, 65, 9, 1 << 23}).keys.size());
      expect_exact<DepthKey>(scene, target);
      expect_exact<DepthItem>(scene, target);
    }
  }
}

/// `layers` squares that cover [low, high) pixels, in shuffled order and with random slopes.
Scene stack(Maker& maker, int layers, int low, int high) {
  Scene scene;
  std::vector<int> order(static_cast<std::size_t>(layers));
  for (int i = 0; i < layers; ++i) order[static_cast<std::size_t>(i)] = i;
  std::shuffle(order.begin(), order.end(), maker.engine());
  const int a = low * 256 + 3, b = high * 256 + 3;
  for (const int layer : order) {
    const int w = 40 + layer / 2 * 3;  // pairs at equal depth
    const int tilt = maker.pick(0, 900);
    scene.add({a, a, w}, {b, a, w + tilt}, {b, b, w});
    scene.add({a, a, w}, {b, b, w}, {a, b, w + tilt});
    if (layer % 2 == 1) {
      std::swap(scene.triangles.back().x, scene.triangles.back().y);
      auto& other = scene.triangles[scene.triangles.size() - 2];
      std::swap(other.x, other.y);
    }
  }
  return scene;
}

TEST(TileLists, AreExactForAnyNumberOfLayers) {
  Maker maker(4);
  // Around the first table's 8 planes, the last plane (64), the largest age (255), and beyond.
  for (const int layers : {7, 8, 9, 63, 64, 65, 66, 130, 254, 255, 256, 257, 657, 2000}) {
    SCOPED_TRACE(layers);
    // Deep ones on few pixels: a record that fits nowhere has tried all ages.
    const Scene scene = stack(maker, layers, 20, layers > 255 ? 23 : 33);
    const RasterTarget target{Axis::kZ, 70, 40, 1 << 16};
    const LatticeMesh mesh = scene.lattice();
    const auto keys = reference_lists<DepthKey>(mesh, target);
    const auto items = reference_lists<DepthItem>(mesh, target);
    for (const OffsetKind offsets : kAllOffsets) {
      // Farthest-point offsets take long to find.
      if (offsets == OffsetKind::kFarthestPoint && layers != 9 && layers != 257) continue;
      for (const StoreKind store : {StoreKind::kHaBuffer, StoreKind::kCountScan}) {
        const TileStoreOptions options{.store = store, .offsets = offsets, .seed = 7};
        EXPECT_EQ(built_lists<DepthKey>(mesh, target, options), keys);
        EXPECT_EQ(built_lists<DepthItem>(mesh, target, options), items);
      }
    }
  }
}

TEST(TileLists, AreExactForAFullTileOfManyLayers) {
  Maker maker(5);
  for (const int layers : {70, 200}) {
    const Scene scene = stack(maker, layers, layers == 70 ? 30 : -1, 65);
    const RasterTarget target{Axis::kZ, 64, 64, 1 << 16};
    const auto expected = reference_lists<DepthKey>(scene.lattice(), target);
    for (const OffsetKind offsets : kAllOffsets) {
      if (layers == 200 && offsets != OffsetKind::kPlaneFirst) continue;  // correct, and slow
      const auto built = built_lists<DepthKey>(scene.lattice(), target,
                                               {.store = StoreKind::kHaBuffer, .offsets = offsets});
      EXPECT_EQ(built, expected) << layers << " layers";
      EXPECT_GT(built.rebuilt_tiles, 0u) << "the first table has 8 planes";
    }
  }
}

TEST(TileLists, AreBuiltInTheStoreThatSuitsTheFirstTile) {
  const RasterTarget target{Axis::kZ, 64, 64, 1 << 16};
  for (const int layers : {1, 6, 12, 300}) {
    SCOPED_TRACE(layers);
    Scene scene;
    for (int i = 0; i < layers; ++i) {  // each layer fills the tile, and goes on outside of it
      const int near = 100 * i, low = -5000, high = 64 * 256 + 5000;
      const glm::ivec3 b(high, low, near), d(low, high, near);
      for (const glm::ivec3& a : {glm::ivec3(low, low, near), glm::ivec3(high, high, near)}) {
        const bool enters = (i % 2 == 0) == (a.x == low);
        scene.add(a, enters ? b : d, enters ? d : b);
      }
    }
    const LatticeMesh mesh = scene.lattice();
    const auto bins = bin_triangles(mesh, target);
    ASSERT_TRUE(bins);
    BuilderOf<DepthKey> keys({.store = StoreKind::kAuto});
    const auto lists = keys.build(mesh, target, bins->tile(0, 0), 0, 0);
    ASSERT_TRUE(lists);
    EXPECT_EQ(lists->fragments, static_cast<std::uint64_t>(layers) * kTilePixels);
    EXPECT_EQ(lists->planes32 != nullptr, layers <= 8);
  }
}

TEST(TileLists, DoNotDependOnTheTilesBuiltBefore) {
  // One builder meets deep, empty, shallow and overflowing tiles in turn: nothing of one may show
  // in the next.
  Maker maker(6);
  std::vector<Scene> scenes;
  for (const int layers : {1, 300, 2, 0, 90, 3, 70, 1, 0, 20, 255, 5}) {
    // Deep ones on few pixels: random offsets take long for them.
    scenes.push_back(stack(maker, layers, layers % 7, (layers > 60 ? 12 : 40) + layers % 7));
    Scene part = stack(maker, layers / 3, 60, layers > 60 ? 68 : 90);
    for (std::size_t i = 0; i + 2 < part.vertices.size(); i += 3) {
      scenes.back().add(part.vertices[i], part.vertices[i + 1], part.vertices[i + 2]);
    }
  }
  const RasterTarget target{Axis::kZ, 100, 70, 1 << 16};
  for (const StoreKind store : {StoreKind::kHaBuffer, StoreKind::kCountScan}) {
    for (const OffsetKind offsets : kAllOffsets) {
      if (offsets == OffsetKind::kFarthestPoint) continue;  // takes long to find
      BuilderOf<DepthKey> keys({.store = store, .offsets = offsets});
      BuilderOf<DepthItem> items({.store = store, .offsets = offsets});
      for (int round = 0; round < 2; ++round) {
        for (std::size_t i = 0; i < scenes.size(); ++i) {
          SCOPED_TRACE(i);
          const LatticeMesh mesh = scenes[i].lattice();
          EXPECT_EQ(built_lists(keys, mesh, target), reference_lists<DepthKey>(mesh, target));
          EXPECT_EQ(built_lists(items, mesh, target), reference_lists<DepthItem>(mesh, target));
          if (HasFailure()) return;
        }
      }
    }
  }
}

TEST(TileLists, AreExactForSmallTrianglesTakenTogether) {
  // Vectors of triangles of up to `side` pixels and a few larger or empty ones among them: corners
  // anywhere, on pixel centres, or all in a row.
  Maker maker(8);
  for (const int side : {1, 2, 3, 5, 9, 15, 17, 20, 32}) {
    for (const int step : {1, 64, 128}) {
      for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
        const RasterTarget target{axis, 90, 75, 1 << 16};
        const AxisFrame frame(axis);
        Scene scene;
        const int count = maker.pick(1, 400);
        for (int i = 0; i < count; ++i) {
          const int largest = (maker.pick(0, 15) == 0 ? 40 : side) * 256;
          const bool flat = maker.pick(0, 15) == 0;
          const int deepest = maker.pick(0, 15) == 0 ? 70'000 : 3000;
          glm::ivec3 p[3];
          const int u = maker.pick(-300, 91 * 256), v = maker.pick(-300, 76 * 256);
          const int w = maker.pick(-2000, 67'000);
          for (glm::ivec3& corner : p) {
            const int along = maker.pick(0, largest);
            corner[frame.u] = (u + along) / step * step;
            corner[frame.v] = (v + (flat ? along : maker.pick(0, largest))) / step * step;
            corner[frame.w] = w + maker.pick(0, deepest) / step * step;
          }
          scene.add(p[0], p[1], p[2]);
        }
        SCOPED_TRACE(std::to_string(side) + ", " + std::to_string(step));
        expect_exact<DepthKey>(scene, target, side == 3);
        expect_exact<DepthItem>(scene, target, side == 3);
        if (HasFailure()) return;
      }
    }
  }
}

TEST(TileLists, AreExactForManyLayersOfSmallTriangles) {
  // More than the planes of a table hold, and more than its ages count.
  Maker maker(9);
  const RasterTarget target{Axis::kZ, 64, 64, 1 << 16};
  for (const int layers : {3, 9, 40, 70, 260}) {
    Scene scene;
    for (int i = 0; i < layers * 16; ++i) {
      const int u = maker.pick(10, 14) * 256, v = maker.pick(20, 23) * 256;
      const auto corner = [&] {
        return glm::ivec3(u + maker.pick(0, 1500), v + maker.pick(0, 1500), maker.pick(0, 60'000));
      };
      scene.add(corner(), corner(), corner());
    }
    expect_exact<DepthKey>(scene, target, layers <= 9);
    expect_exact<DepthItem>(scene, target, layers <= 9);
    if (HasFailure()) return;
  }
}

TEST(TileLists, ALogInOrderHasTheFragmentsByTriangle) {
  Maker maker(10);
  const RasterTarget target{Axis::kZ, 64, 64, 1 << 16};
  Scene scene;
  for (int i = 0; i < 500; ++i) {
    const int u = maker.pick(0, 60) * 256, v = maker.pick(0, 60) * 256;
    const auto corner = [&] {
      const int side = i % 20 == 0 ? 12'000 : 1500;
      return glm::ivec3(u + maker.pick(0, side), v + maker.pick(0, side), maker.pick(0, 60'000));
    };
    scene.add(corner(), corner(), corner());
  }
  const LatticeMesh mesh = scene.lattice();
  std::vector<std::uint32_t> ids(mesh.triangles.size());
  std::iota(ids.begin(), ids.end(), 0u);
  std::shuffle(ids.begin(), ids.end(), maker.engine());
  for_each_simd_target([&](const std::string& name) {
    SCOPED_TRACE(name);
    TileLog<Record64> any, log;
    raster_into({mesh, target, ids, {0, 0, 64, 64}}, any);
    raster_into({mesh, target, ids, {0, 0, 64, 64}, true}, log);
    EXPECT_GT(log.count, 1000u);
    EXPECT_EQ(log.count, any.count);
    const auto end = log.keys.begin() + static_cast<std::ptrdiff_t>(log.count);
    EXPECT_TRUE(std::is_sorted(log.keys.begin(), end, [&](DepthItem a, DepthItem b) {
      return a.triangle() < b.triangle();
    }));
  });
}

TEST(TileLists, DoNotDependOnTheOrderOfTriangles) {
  Maker maker(7);
  const RasterTarget target{Axis::kY, 66, 65, 1 << 14};
  Scene scene;
  for (int i = 0; i < 300; ++i) maker.add_of_extent(scene, target, 20'000, i % 2 == 0 ? 256 : 1);
  const auto expected = reference_lists<DepthKey>(scene.lattice(), target);
  for (int round = 0; round < 10; ++round) {
    std::shuffle(scene.triangles.begin(), scene.triangles.end(), maker.engine());
    for (auto& t : scene.triangles) t = {t.y, t.z, t.x};
    EXPECT_EQ(built_lists<DepthKey>(scene.lattice(), target), expected);
  }
}

TEST(TileBins, HoldEachTriangleInEveryTileItCoversAPixelOf) {
  Maker maker(8);
  const RasterTarget target{Axis::kX, 200, 130, 1 << 16};
  Scene scene;
  for (int i = 0; i < 20'000; ++i) {
    maker.add_of_extent(scene, target, maker.pick(1, i % 50 == 0 ? 1 << 20 : 9000), 1);
  }
  const LatticeMesh mesh = scene.lattice();
  const AxisFrame frame(target.axis);
  std::vector<std::vector<std::uint32_t>> expected(4 * 3);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3& t = mesh.triangles[i];
    TriangleSetup setup;
    if (!setup_triangle(mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z], frame, setup)) {
      continue;
    }
    for (int tile = 0; tile < 12; ++tile) {
      const int u = tile % 4 * 64, v = tile / 4 * 64;
      bool covers = false;
      rasterize_exact(setup, {u, v, std::min(u + 64, 200), std::min(v + 64, 130)}, 1 << 16,
                      [&](int, int, std::uint32_t) { covers = true; });
      if (covers) expected[static_cast<std::size_t>(tile)].push_back(i);
    }
  }
  for (const int threads : {1, 2, 3, 8}) {
    Execution execution;
    execution.threads = threads;
    const auto bins = bin_triangles(mesh, target, execution);
    ASSERT_TRUE(bins.has_value());
    ASSERT_EQ(bins->tiles_u, 4);
    ASSERT_EQ(bins->tiles_v, 3);
    for (int tile = 0; tile < 12; ++tile) {
      const auto found = bins->tile(tile % 4, tile / 4);
      std::vector<std::uint32_t> sorted(found.begin(), found.end());
      std::sort(sorted.begin(), sorted.end());
      EXPECT_EQ(std::adjacent_find(sorted.begin(), sorted.end()), sorted.end()) << "listed twice";
      const auto& needed = expected[static_cast<std::size_t>(tile)];
      EXPECT_TRUE(std::includes(sorted.begin(), sorted.end(), needed.begin(), needed.end()));
    }
  }
}

TEST(TileBins, HoldTrianglesAtTheBordersOfTheLargestImages) {
  Maker maker(10);
  for (const int width : {kMaxGridSide - 1, kMaxGridSide}) {
    const RasterTarget target{Axis::kZ, width, 70, 1 << 16};
    const PixelRect image{0, 0, width, 70};
    Scene scene;
    for (int i = 0; i < 4000; ++i) {
      const int u = (i % 2 == 0 ? 0 : width * 256) + maker.pick(-3000, 3000);
      const int v = maker.pick(-600, 70 * 256 + 600);
      const auto corner = [&] {
        return glm::ivec3(u + maker.pick(0, 900), v + maker.pick(0, 900), maker.pick(0, 999));
      };
      scene.add(corner(), corner(), corner());
    }
    const LatticeMesh mesh = scene.lattice();
    const auto bins = bin_triangles(mesh, target);
    ASSERT_TRUE(bins.has_value());
    std::vector<int> tiles_of(mesh.triangles.size());
    for (std::uint32_t i = 0; i < bins->offsets.back(); ++i) ++tiles_of[bins->triangles[i]];
    const AxisFrame frame(target.axis);
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const glm::uvec3& t = mesh.triangles[i];
      TriangleSetup setup;
      if (!setup_triangle(mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z], frame,
                          setup)) {
        continue;
      }
      if (pixel_bounds(setup, image).empty() && width < kMaxGridSide) {
        EXPECT_EQ(tiles_of[i], 0) << "covers no centre of the image";
      }
      rasterize_exact(setup, image, 1 << 16, [&](int u, int v, std::uint32_t) {
        const auto found = bins->tile(u / kTileSide, v / kTileSide);
        EXPECT_NE(std::find(found.begin(), found.end(), i), found.end()) << u << ", " << v;
      });
    }
  }
}

TEST(LatticeMesh, IsRefusedWhereTheWorkWasStopped) {
  // Vertices that were not begun have no value.
  TriangleSoup soup;
  soup.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  soup.triangles = {{0, 1, 2}};
  VoxelGrid grid;
  grid.dims = {4, 4, 4};
  EXPECT_TRUE(snap_to_lattice(soup, grid));
  std::stop_source stop;
  stop.request_stop();
  const auto stopped = snap_to_lattice(soup, grid, {.stop = stop.get_token()});
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace strata
