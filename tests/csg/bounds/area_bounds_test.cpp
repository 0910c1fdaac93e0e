#include "csg/bounds/area_bounds.h"

#include <gtest/gtest.h>

#include <array>
#include <glm/ext/matrix_transform.hpp>
#include <numeric>
#include <random>

#include "strata/mesh/shapes.h"
#include "strata/raster/view.h"
#include "tests/support/simd_targets.h"

namespace strata::csg {
namespace {

constexpr glm::ivec2 kTile(128, 64);

/// Triangles on the lattice.
struct Soup {
  LatticeVertices vertices;
  std::vector<glm::uvec3> triangles;

  [[nodiscard]] AreaBounds bounds(double steep_from) const {
    LatticeMesh mesh;
    mesh.vertices = vertices;
    mesh.triangles = triangles;
    std::vector<std::uint32_t> all(triangles.size());
    std::iota(all.begin(), all.end(), 0u);
    AreaBounds bounds;
    find_tile_bounds(mesh, all, kTile, steep_from, true, bounds);
    find_area_bounds(mesh, bounds.triangles, kTile, steep_from, true, true, bounds);
    return bounds;
  }
  /// Calls body(triangle, exit, area, depth) for all crossings of the tile.
  template <class Body>
  void for_each_crossing(Body&& body) const {
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      TriangleSetup setup;
      const glm::uvec3& t = triangles[i];
      if (!setup_triangle(vertices[t.x], vertices[t.y], vertices[t.z], AxisFrame(Axis::kZ), setup))
        continue;
      rasterize_exact(setup, {kTile.x, kTile.y, kTile.x + kTileSide, kTile.y + kTileSide},
                      kPictureDepthLimit, [&](int u, int v, std::uint32_t depth) {
                        const int area = (v - kTile.y) / AreaBounds::kSide * AreaBounds::kAcross +
                                         (u - kTile.x) / AreaBounds::kSide;
                        body(i, setup.exit, static_cast<std::size_t>(area), depth, u, v);
                      });
    }
  }
};

void expect_crossings_held() {
  std::mt19937_64 random(7);
  const auto pick = [&](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
  };
  std::size_t crossings = 0;
  for (int round = 0; round < 100; ++round) {
    Soup soup;
    const int spread = pick(0, 1) == 0 ? pick(300, 30000) : pick(30000, 1 << 27);
    const int depth = pick(1, 1 << pick(3, 27));
    for (int i = 0; i < 90; ++i) {
      soup.vertices.emplace_back(kTile.x * 256 + 8192 + pick(-spread, spread),
                                 kTile.y * 256 + 8192 + pick(-spread, spread),
                                 (1 << 22) + pick(-depth, depth));
    }
    for (std::uint32_t i = 0; i < 90; i += 3) soup.triangles.emplace_back(i, i + 1, i + 2);
    const AreaBounds bounds = soup.bounds(pick(0, 3) == 0 ? 0.5 : 4000.0);
    std::vector<std::uint32_t> areas(soup.triangles.size(), 0);
    for (const AreaBounds::Face& face : bounds.faces) areas[face.triangle] = face.areas;
    std::vector<std::uint8_t> in_tile(soup.triangles.size(), 0);
    for (const std::uint32_t triangle : bounds.triangles) in_tile[triangle] = 1;
    soup.for_each_crossing(
        [&](std::uint32_t triangle, bool exit, std::size_t area, std::uint32_t at, int, int) {
          const AreaBounds::Range& range = exit ? bounds.exits : bounds.entries;
          ASSERT_LE(range.nearest[area], at) << "round " << round;
          ASSERT_GE(range.farthest[area], at) << "round " << round;
          ASSERT_NE(areas[triangle] >> area & 1, 0u) << "round " << round;
          ASSERT_LE(range.nearest[AreaBounds::kTile], at) << "round " << round;
          ASSERT_GE(range.farthest[AreaBounds::kTile], at) << "round " << round;
          ASSERT_NE(in_tile[triangle], 0) << "round " << round;
          ++crossings;
        });
  }
  EXPECT_GT(crossings, 300000u);
}

TEST(AreaBounds, HoldTheCrossingsOfAnyTriangles) {
  testkit::for_each_simd_target([](const std::string& target) {
    SCOPED_TRACE(target);
    expect_crossings_held();
  });
}

TEST(AreaBounds, OfALargeTriangleAreItsPlane) {
  Soup soup;
  soup.vertices = {{0, 0, 1 << 20}, {0, 1 << 18, 1 << 21}, {1 << 18, 0, 1 << 22}};
  soup.triangles = {{0, 1, 2}};
  std::array<AreaBounds::Range, 2> seen{};
  std::fill(std::begin(seen[0].nearest), std::end(seen[0].nearest), AreaBounds::kNever);
  soup.for_each_crossing([&](std::uint32_t, bool, std::size_t area, std::uint32_t depth, int, int) {
    seen[0].nearest[area] = std::min(seen[0].nearest[area], depth);
    seen[0].farthest[area] = std::max(seen[0].farthest[area], depth);
  });
  const AreaBounds bounds = soup.bounds(1000.0), steep = soup.bounds(1.0);
  for (std::size_t area = 0; area < AreaBounds::kAreas; ++area) {
    ASSERT_GE(seen[0].nearest[area], bounds.nearest(area)) << area;
    EXPECT_LE(seen[0].nearest[area] - bounds.nearest(area), 16u) << area;
    EXPECT_LE(bounds.farthest(area) - seen[0].farthest[area], 16u) << area;
    EXPECT_LE(steep.nearest(area), 1u << 20) << area;
    EXPECT_GE(steep.farthest(area), 1u << 22) << area;
  }
}

// Where the corners of an area are covered, so is all of it, if the solid is convex.
TEST(AreaBounds, TellWhichAreasAConvexSolidCovers) {
  std::mt19937_64 random(11);
  const auto real = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::size_t covered = 0, open = 0, covered_tiles = 0;
  for (int round = 0; round < 200; ++round) {
    const TriangleSoup mesh =
        round % 2 == 0 ? make_box(glm::dvec3(-1), glm::dvec3(1)) : make_icosphere(1.0, round % 4);
    const glm::dmat4 turn = glm::rotate(glm::dmat4(1.0), real(0, 3), glm::dvec3(1, real(0, 1), 2));
    const double size = real(1000, 40000);
    Soup soup;
    soup.triangles = mesh.triangles;
    const glm::dvec2 at(real(0, 16384), real(0, 16384));
    for (const glm::dvec3& p : mesh.positions) {
      const glm::dvec3 q = glm::dvec3(turn * glm::dvec4(p, 1.0)) * size;
      soup.vertices.emplace_back(std::lround(q.x + at.x) + kTile.x * 256,
                                 std::lround(q.y + at.y) + kTile.y * 256,
                                 std::lround(q.z * 100) + (1 << 23));
    }
    const AreaBounds bounds = soup.bounds(1000.0);
    std::vector<int> entries(kTilePixels, 0);
    soup.for_each_crossing([&](std::uint32_t, bool exit, std::size_t, std::uint32_t, int u, int v) {
      if (!exit) ++entries[static_cast<std::size_t>((v - kTile.y) * kTileSide + u - kTile.x)];
    });
    if ((bounds.covered >> AreaBounds::kTile & 1) != 0) {
      ++covered_tiles;
      for (const int count : entries) ASSERT_GT(count, 0) << "round " << round;
    }
    for (int pixel = 0; pixel < kTilePixels; ++pixel) {
      const int area = pixel / kTileSide / AreaBounds::kSide * AreaBounds::kAcross +
                       pixel % kTileSide / AreaBounds::kSide;
      const bool is_covered = (bounds.covered >> area & 1) != 0;
      if (is_covered) {
        ASSERT_GT(entries[static_cast<std::size_t>(pixel)], 0) << "round " << round;
      }
      ++(is_covered ? covered : open);
    }
  }
  EXPECT_GT(covered, 100000u);
  EXPECT_GT(open, 100000u);
  EXPECT_GT(covered_tiles, 20u);
}

}  // namespace
}  // namespace strata::csg
