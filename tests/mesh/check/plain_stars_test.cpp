#include "mesh/check/plain_stars.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
#include <numbers>
#include <random>

#include "mesh/check/triangles_meet.h"
#include "strata/mesh/shapes.h"

namespace strata {
namespace {

using exact::FilePoint;

struct FileMesh {
  std::vector<FilePoint> points;
  std::vector<glm::uvec3> triangles;

  [[nodiscard]] TriangleCorners corners(std::size_t t) const {
    return {points[triangles[t].x], points[triangles[t].y], points[triangles[t].z]};
  }
  [[nodiscard]] std::vector<std::uint8_t> plain(int threads = 0) const {
    return plain_stars(std::span<const FilePoint>(points), triangles, {.threads = threads});
  }
};

FileMesh rounded(const TriangleSoup& mesh, double scale) {
  FileMesh result{{}, mesh.triangles};
  for (const glm::dvec3& p : mesh.positions) result.points.emplace_back(glm::round(p * scale));
  return result;
}

/// Pairs of triangles at vertices that are said to be plain, and how many of them are not clean.
struct Pairs {
  int all = 0, wrong = 0;
};
Pairs pairs_of(const FileMesh& mesh, const std::vector<std::uint8_t>& plain) {
  Pairs pairs;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t v = mesh.triangles[i][k];
        const glm::uvec3& t = mesh.triangles[j];
        if (plain[v] == 0 || (v != t.x && v != t.y && v != t.z)) continue;
        ++pairs.all;
        pairs.wrong += !is_clean(triangles_meet(mesh.corners(i), mesh.corners(j)));
      }
    }
  }
  return pairs;
}

TEST(PlainStars, AreMostOfASurfaceAndNeverWrong) {
  std::mt19937_64 random(9);
  int all = 0, vertices = 0, plain_vertices = 0;
  for (int i = 0; i < 60; ++i) {
    FileMesh mesh =
        rounded(i % 2 == 0 ? make_icosphere(1, 2) : make_torus(2, 1, 12, 9), i % 3 == 0 ? 5 : 1e6);
    // Some are smooth, in others neighbours fold over and coincide.
    const int noise = i % 3 == 0 ? i / 20 : i * 3000;
    for (FilePoint& p : mesh.points) {
      for (int k = 0; k < 3; ++k) {
        p[k] += static_cast<std::int64_t>(random() % static_cast<unsigned>(noise + 1)) - noise / 2;
      }
    }
    const std::vector<std::uint8_t> plain = mesh.plain(1 + i % 3);
    const Pairs pairs = pairs_of(mesh, plain);
    EXPECT_EQ(pairs.wrong, 0) << i;
    all += pairs.all;
    if (noise > 0) continue;
    for (const std::uint8_t one : plain) {
      ++vertices;
      plain_vertices += one;
    }
  }
  EXPECT_GT(all, 10000);
  EXPECT_GT(vertices, 100);
  EXPECT_GT(plain_vertices, vertices / 2);
}

TEST(PlainStars, AreAllOfABoxOnItsAxes) {
  for (const std::uint8_t plain : rounded(make_box(glm::dvec3(0), glm::dvec3(1)), 8).plain()) {
    EXPECT_EQ(plain, 1);
  }
}

// The triangles around the tips turn left everywhere, but go around more than once.
TEST(PlainStars, TurnAroundOnce) {
  for (const int turns : {1, 2, 3, 255, 257, 65537}) {
    const int count = 5 * turns;
    FileMesh mesh;
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * turns * i / count + 0.1;
      mesh.points.emplace_back(std::lround(1e9 * std::cos(angle)),
                               std::lround(1e9 * std::sin(angle)), turns == 1 ? 0 : i);
    }
    mesh.points.emplace_back(0, 0, 1000000000);
    mesh.points.emplace_back(0, 0, -1000000000);
    const auto n = static_cast<std::uint32_t>(count);
    for (std::uint32_t i = 0; i < n; ++i) {
      mesh.triangles.emplace_back(i, (i + 1) % n, n);
      mesh.triangles.emplace_back((i + 1) % n, i, n + 1);
    }
    const std::vector<std::uint8_t> plain = mesh.plain();
    EXPECT_EQ(plain[n], turns == 1) << turns;
    EXPECT_EQ(plain[n + 1], turns == 1) << turns;
  }
}

TEST(PlainStars, FoldsAndTrianglesWithoutAreaAreNotPlain) {
  FileMesh fold = rounded(make_icosphere(1, 2), 1000);
  EXPECT_EQ(fold.plain()[0], 1);
  for (const FilePoint& p : fold.points) {  // to the other side of its neighbours
    const glm::dvec3 apart(p - fold.points[0]);
    const double distance = std::sqrt(apart.x * apart.x + apart.y * apart.y + apart.z * apart.z);
    if (distance < 700 || distance > 900) continue;
    fold.points[0] = p;
    break;
  }
  EXPECT_EQ(fold.plain()[0], 0);
  FileMesh line = rounded(make_icosphere(1, 1), 1000);
  for (FilePoint& p : line.points) p.y = p.z = 2 * p.x;
  for (const std::uint8_t plain : line.plain()) EXPECT_EQ(plain, 0);
}

}  // namespace
}  // namespace strata
