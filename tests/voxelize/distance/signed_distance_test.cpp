// Distances against brute force on the rounded mesh, signs against the solid voxels.

#include "strata/voxelize/distance/signed_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <stop_token>
#include <string>
#include <vector>

#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "tests/support/simd_targets.h"
#include "tests/support/voxelized.h"

namespace strata {
namespace {

using namespace testkit;  // NOLINT: the tests' own vocabulary

using Real = double;
using Point = glm::vec<3, Real>;

Real distance_to_segment(const Point& p, const Point& a, const Point& b) {
  const Point along = b - a;
  const Real square = glm::dot(along, along);
  const Real t = square > 0 ? glm::clamp(glm::dot(p - a, along) / square, Real(0), Real(1)) : 0;
  return glm::length(p - a - t * along);
}

/// Within the three half-spaces of the edges the plane decides, else the nearest edge.
Real distance_to_triangle(const Point& p, const Point& a, const Point& b, const Point& c) {
  const Real edges = std::min(
      {distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
  const Point normal = glm::cross(b - a, c - a);
  if (glm::dot(normal, normal) == 0) return edges;
  const auto within = [&](const Point& u, const Point& v) {
    return glm::dot(glm::cross(v - u, p - u), normal) >= 0;
  };
  if (!within(a, b) || !within(b, c) || !within(c, a)) return edges;
  return std::min(edges, std::abs(glm::dot(normal, p - a)) / glm::length(normal));
}

/// floor((p - origin) / size * 256 + 0.5) / 256 voxels, in world units from the origin.
Point snapped(const glm::dvec3& p, const VoxelGrid& grid) {
  return Point(glm::floor((p - grid.origin) / grid.voxel_size * 256.0 + 0.5)) / Real(256) *
         Point(grid.voxel_size);
}

Real brute_force(const std::vector<Point>& corners, const VoxelGrid& grid,
                 const glm::ivec3& voxel) {
  const Point centre = (Point(voxel) + Real(0.5)) * Point(grid.voxel_size);
  Real least = INFINITY;
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    least =
        std::min(least, distance_to_triangle(centre, corners[i], corners[i + 1], corners[i + 2]));
  }
  return least;
}

ScalarField distances(const TriangleSoup& mesh, const VoxelGrid& grid,
                      const DistanceOptions& options = {}, const Execution& execution = {},
                      DistanceReport* report = nullptr) {
  auto field = signed_distance(mesh, grid, options, execution, report);
  EXPECT_TRUE(field.has_value()) << field.error().message;
  return field ? *std::move(field) : ScalarField(grid.dims);
}

template <class Visit>
void for_each_voxel(const VoxelGrid& grid, Visit&& visit) {
  for (int k = 0; k < grid.dims.z; ++k) {
    for (int j = 0; j < grid.dims.y; ++j) {
      for (int i = 0; i < grid.dims.x; ++i) visit(i, j, k);
    }
  }
}

/// Compares all voxels. @return those in the band
std::uint64_t expect_right(const TriangleSoup& mesh, const VoxelGrid& grid,
                           const DistanceOptions& options = {}, double tolerance = 1e-5) {
  DistanceReport report;
  const ScalarField field = distances(mesh, grid, options, {}, &report);
  const VoxelIntervals solid = voxelized(mesh, grid, options.solid);
  const double side = std::max({grid.voxel_size.x, grid.voxel_size.y, grid.voxel_size.z});
  const double band = options.everywhere ? 1e9 : options.band * side;
  EXPECT_TRUE(options.everywhere || band_in_world(grid, options.band) == band);
  std::vector<Point> corners;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) corners.push_back(snapped(mesh.positions[t[i]], grid));
  }
  std::uint64_t in_band = 0, inside = 0;
  int wrong = 0;
  for_each_voxel(grid, [&](int i, int j, int k) {
    const float value = field.value(i, j, k);
    const auto right = brute_force(corners, grid, {i, j, k});
    if (std::abs(value) < static_cast<float>(band)) {
      ++in_band;
      inside += value < 0;
    }
    const bool sign = (value < 0) == solid.contains(i, j, k);
    const bool size = std::abs(std::abs(value) - std::min(right, band)) <=
                      tolerance * side + 1e-6 * std::abs(value);
    if ((!sign || !size) && ++wrong < 5) {
      ADD_FAILURE() << "voxel " << i << " " << j << " " << k << ": " << value << ", not " << right
                    << (solid.contains(i, j, k) ? " inside" : " outside");
    }
  });
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(report.band_voxels, in_band);
  EXPECT_EQ(report.inside_voxels, inside);
  EXPECT_EQ(report.band, options.everywhere ? 0.0 : static_cast<float>(band));
  return in_band;
}

TriangleSoup random_triangles(std::mt19937_64& random, const glm::dvec3& low,
                              const glm::dvec3& high, int triangles) {
  TriangleSoup mesh;
  const int points = triangles + 2;
  for (int i = 0; i < points; ++i) {
    glm::dvec3 p;
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] = std::uniform_real_distribution<double>(low[axis], high[axis])(random);
    }
    // Some of them on a coarse lattice, so that triangles degenerate and centres lie on them.
    mesh.positions.push_back(random() % 2 == 0 ? glm::floor(p * 2.0) / 2.0 : p);
  }
  std::uniform_int_distribution<std::uint32_t> pick(0, static_cast<std::uint32_t>(points - 1));
  for (int t = 0; t < triangles; ++t) {
    const glm::uvec4 v(pick(random), pick(random), pick(random), pick(random));
    mesh.triangles.emplace_back(v.x, v.y, v.z);
    if (triangles % 2 == 0) continue;
    // A tetrahedron, which is closed.
    mesh.triangles.emplace_back(v.x, v.w, v.y);
    mesh.triangles.emplace_back(v.y, v.w, v.z);
    mesh.triangles.emplace_back(v.z, v.w, v.x);
  }
  return mesh;
}

TEST(SignedDistance, RandomTrianglesHaveBruteForcesDistances) {
  std::uint64_t in_band = 0;
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    VoxelGrid grid;
    for (int axis = 0; axis < 3; ++axis) {
      grid.dims[axis] = std::uniform_int_distribution<int>(1, seed % 50 == 0 ? 40 : 11)(random);
      grid.origin[axis] = std::uniform_real_distribution<double>(-9, 9)(random);
      if (seed % 3 == 0) {
        grid.voxel_size[axis] = std::uniform_real_distribution<double>(0.2, 3)(random);
      }
    }
    const glm::dvec3 high = grid.origin + glm::dvec3(grid.dims) * grid.voxel_size;
    const TriangleSoup mesh =
        random_triangles(random, grid.origin - 3.0, high + 3.0, 1 + static_cast<int>(random() % 9));
    DistanceOptions options;
    options.band = seed % 4 == 0 ? std::uniform_real_distribution<double>(0.5, 9)(random) : 3.0;
    options.solid.rule = kAllRules[seed % 3];
    in_band += expect_right(mesh, grid, options);
    if (HasFailure()) return;
  }
  EXPECT_GT(in_band, 50000u);
}

TEST(SignedDistance, EverywhereIsBruteForceToo) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    VoxelGrid grid;
    for (int axis = 0; axis < 3; ++axis) {
      grid.dims[axis] = std::uniform_int_distribution<int>(1, seed % 50 == 0 ? 40 : 14)(random);
      if (seed % 3 == 0) {
        grid.voxel_size[axis] = std::uniform_real_distribution<double>(0.2, 3)(random);
      }
    }
    const TriangleSoup mesh = random_triangles(random, glm::dvec3(-30), glm::dvec3(40),
                                               1 + static_cast<int>(random() % 20));
    DistanceOptions options;
    options.everywhere = true;
    options.band = seed % 2 == 0 ? 3.0 : 1.0;
    EXPECT_EQ(expect_right(mesh, grid, options), static_cast<std::uint64_t>(grid.dims.x) *
                                                     static_cast<std::uint64_t>(grid.dims.y) *
                                                     static_cast<std::uint64_t>(grid.dims.z));
    if (HasFailure()) return;
  }
}

TEST(SignedDistance, EverywhereTheSetOfTrianglesDecides) {
  const TriangleSoup torus = make_torus(1.0, 0.4, 40, 20);
  DistanceOptions options;
  options.everywhere = true;
  const VoxelGrid grid{{40, 36, 24}, glm::dvec3(-1.5, -1.5, -0.8), glm::dvec3(0.08)};
  const ScalarField first = distances(torus, grid, options, {.threads = 1});
  const auto expect_same = [&](const ScalarField& other, const std::string& what) {
    int wrong = 0;
    for_each_voxel(
        grid, [&](int i, int j, int k) { wrong += first.value(i, j, k) != other.value(i, j, k); });
    EXPECT_EQ(wrong, 0) << what;
  };
  TriangleSoup shuffled = torus;
  std::mt19937_64 random(7);
  std::shuffle(shuffled.triangles.begin(), shuffled.triangles.end(), random);
  expect_same(distances(shuffled, grid, options, {.threads = 4}), "order");
  for_each_simd_target([&](const std::string& name) {
    expect_same(distances(torus, grid, options, {.threads = 1}), name);
  });
  const auto nothing = signed_distance({}, grid, options);
  ASSERT_FALSE(nothing.has_value());
  EXPECT_EQ(nothing.error().code, ErrorCode::kGeometry);
}

TEST(SignedDistance, SolidsOverTilesBoundariesAreRight) {
  const TriangleSoup torus = make_torus(1.0, 0.4, 12, 6);
  const VoxelGrid grid{{70, 36, 37}, glm::dvec3(-1.5, -1.5, -0.8), glm::dvec3(3.0 / 70)};
  EXPECT_GT(expect_right(torus, grid), 10000u);
}

TEST(SignedDistance, OpenMeshesAreRightAndHaveTheVotesSigns) {
  TriangleSoup sphere = make_icosphere(1.0, 1);
  sphere.triangles.erase(sphere.triangles.begin(), sphere.triangles.begin() + 15);
  const VoxelGrid grid{glm::ivec3(34), glm::dvec3(-1.25), glm::dvec3(2.5 / 34)};
  EXPECT_GT(expect_right(sphere, grid), 4000u);
  DistanceOptions surface;
  surface.solid.open = OpenMode::kSurface;
  const ScalarField field = distances(sphere, grid, surface);
  EXPECT_EQ(field.range().greatest, static_cast<float>(band_in_world(grid, 3)));
  EXPECT_GE(field.range().least, 0.0f);
}

TEST(SignedDistance, LargeTrianglesAndNeedlesAreRight) {
  // A cylinder's sides and ends: triangles as long as the grid, with angles of a thousandth.
  const TriangleSoup cylinder = make_cylinder(0.2, 40.0, 24);
  const glm::dmat4 turn = glm::rotate(glm::dmat4(1.0), 0.7, glm::dvec3(1, 2, 3));
  const TriangleSoup mesh = transform(cylinder, turn);
  const Bounds box = bounds(mesh);
  const double size = 0.11;
  const VoxelGrid tip{glm::ivec3(36), box.high - 34 * size, glm::dvec3(size)};
  const VoxelGrid far{{24, 24, 24}, (box.low + box.high) / 2.0 - 12 * size, glm::dvec3(size)};
  expect_right(mesh, tip);
  EXPECT_GT(expect_right(mesh, far), 1000u);
  // Far away from the origin of the grid the rounding of float must not grow.
  const VoxelGrid fine{glm::ivec3(20), box.high - glm::dvec3(0.3), glm::dvec3(0.02)};
  expect_right(mesh, fine);
}

TEST(SignedDistance, AGridThatCutsTheMeshSeesTrianglesBeyondIt) {
  const TriangleSoup box = make_box(glm::dvec3(-100), glm::dvec3(100.3));
  const VoxelGrid grid{{12, 9, 20}, glm::dvec3(92.0), glm::dvec3(1.0)};
  EXPECT_GT(expect_right(box, grid), 100u);
  // The face lies one voxel beyond the grid.
  const VoxelGrid below{{8, 8, 8}, {0.0, 0.0, 91.3}, glm::dvec3(1.0)};
  EXPECT_GT(expect_right(box, below), 100u);
  // A cavity without faces near is all inside.
  DistanceReport report;
  const ScalarField deep =
      distances(box, {{40, 8, 8}, glm::dvec3(0.0), glm::dvec3(1)}, {}, {}, &report);
  EXPECT_EQ(deep.range().greatest, -3.0f);
  EXPECT_EQ(report.band_voxels, 0u);
}

TEST(SignedDistance, WallsBelowAVoxelAndCentresOnFacesHaveTheSolidsSigns) {
  const TriangleSoup wall = make_box({1.0, 1.0, 3.6}, {9.0, 9.0, 3.8});
  const VoxelGrid grid{glm::ivec3(10), glm::dvec3(0.0), glm::dvec3(1.0)};
  expect_right(wall, grid);
  EXPECT_GE(distances(wall, grid).range().least, 0.0f);  // no centre is inside
  // Faces through centres: half of those voxels are inside, at a distance of 0.
  const TriangleSoup on_centres = make_box(glm::dvec3(2.5), glm::dvec3(6.5));
  expect_right(on_centres, grid);
  const ScalarField field = distances(on_centres, grid);
  const VoxelIntervals solid = voxelized(on_centres, grid);
  std::uint64_t inside = 0;
  for_each_voxel(grid, [&](int i, int j, int k) { inside += field.value(i, j, k) < 0.0f; });
  EXPECT_EQ(inside, solid.solid_voxels());
  EXPECT_EQ(inside, 64u);
}

TEST(SignedDistance, CavitiesAndOverlapsHaveTheRulesSigns) {
  TriangleSoup mesh = make_icosphere(1.0, 1), inner = make_icosphere(0.6, 1),
               other = transform(make_icosphere(0.7, 1),
                                 glm::translate(glm::dmat4(1.0), glm::dvec3(0.9, 0.1, 0.0)));
  reverse_orientation(inner);
  append(mesh, inner);
  append(mesh, other);
  const VoxelGrid grid{{36, 28, 28}, glm::dvec3(-1.2), glm::dvec3(2.4 / 28)};
  for (const InsideRule rule : kAllRules) {
    DistanceOptions options;
    options.solid.rule = rule;
    EXPECT_GT(expect_right(mesh, grid, options), 3000u);
  }
}

TEST(SignedDistance, BitsDoNotDependOnThreadsOrSimdOrOrder) {
  TriangleSoup mesh = make_torus_knot(2, 3, 0.4, 90, 17);
  const VoxelGrid grid{{70, 66, 33}, glm::dvec3(-3.5, -3.5, -1.6), {0.1, 0.105, 0.097}};
  const ScalarField first = distances(mesh, grid, {}, {.threads = 1});
  const auto expect_same = [&](const ScalarField& other, const std::string& what) {
    int wrong = 0;
    for_each_voxel(grid, [&](int i, int j, int k) {
      const float a = first.value(i, j, k), b = other.value(i, j, k);
      wrong += a != b || std::signbit(a) != std::signbit(b);
    });
    EXPECT_EQ(wrong, 0) << what;
  };
  expect_same(distances(mesh, grid, {}, {.threads = 5}), "threads");
  for_each_simd_target([&](const std::string& name) {
    expect_same(distances(mesh, grid, {}, {.threads = 1}), name);
  });
  std::mt19937_64 random(5);
  std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
  expect_same(distances(mesh, grid), "order");
}

TEST(SignedDistance, SlabsAreTheWhole) {
  const TriangleSoup mesh = make_icosphere(1.0, 2);
  const VoxelGrid grid{{50, 40, 75}, glm::dvec3(-1.2, -1.2, -1.8), {0.05, 0.06, 0.05}};
  const ScalarField whole = distances(mesh, grid);
  int next = 0, wrong = 0;
  const auto done = signed_distance_slabs(
      mesh, grid, {}, {}, [&](const ScalarField& layers, int z_begin) -> Result<void> {
        EXPECT_EQ(z_begin, next);
        EXPECT_EQ(z_begin % 64, 0);
        EXPECT_EQ(glm::ivec2(layers.dims()), glm::ivec2(grid.dims));
        for_each_voxel({layers.dims()}, [&](int i, int j, int k) {
          wrong += layers.value(i, j, k) != whole.value(i, j, z_begin + k);
        });
        next += layers.dims().z;
        return {};
      });
  ASSERT_TRUE(done.has_value()) << done.error().message;
  EXPECT_EQ(next, grid.dims.z);
  EXPECT_EQ(wrong, 0);
}

TEST(SignedDistance, DistancesMayBeThoseToAnotherSurface) {
  // Two boxes that overlap: the walls between them are not the solid's.
  TriangleSoup mesh = make_box(glm::dvec3(2), {12, 10, 10}),
               other = make_box({8, 2, 2}, {18, 10, 10});
  append(mesh, other);
  const TriangleSoup boundary = make_box(glm::dvec3(2), {18, 10, 10});
  const VoxelGrid grid{{20, 12, 12}, glm::dvec3(0.0), glm::dvec3(1.0)};
  DistanceOptions options;
  options.surface = &boundary;
  const ScalarField field = distances(mesh, grid, options), right = distances(boundary, grid);
  int wrong = 0;
  for_each_voxel(
      grid, [&](int i, int j, int k) { wrong += field.value(i, j, k) != right.value(i, j, k); });
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(field.value(10, 5, 5), -3.0f);
  EXPECT_NE(distances(mesh, grid).value(11, 5, 5), -3.0f);
}

TEST(SignedDistance, RefusesBandsAndStops) {
  const TriangleSoup mesh = make_icosphere(1.0, 2);
  const VoxelGrid grid{glm::ivec3(64), glm::dvec3(-1.2), glm::dvec3(2.4 / 64)};
  for (const double band : {0.0, 0.4, -3.0, 1e9, std::nan("")}) {
    const auto field = signed_distance(mesh, grid, {.band = band});
    ASSERT_FALSE(field.has_value()) << band;
    EXPECT_EQ(field.error().code, ErrorCode::kUsage);
  }
  std::stop_source stop;
  stop.request_stop();
  const auto stopped = signed_distance(mesh, grid, {}, {.stop = stop.get_token()});
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  const auto failed = signed_distance_slabs(
      mesh, grid, {}, {},
      [](const ScalarField&, int) -> Result<void> { return fail(ErrorCode::kOutput, "full"); });
  ASSERT_FALSE(failed.has_value());
  EXPECT_EQ(failed.error().code, ErrorCode::kOutput);
  double last = 0;
  Execution execution;
  execution.progress = [&](double share) {
    EXPECT_GE(share, last);
    last = share;
  };
  ASSERT_TRUE(signed_distance(mesh, grid, {}, execution).has_value());
  EXPECT_EQ(last, 1.0);
}

}  // namespace
}  // namespace strata
