#include "voxelize/shell_voxels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <glm/common.hpp>
#include <random>
#include <stop_token>
#include <string>
#include <vector>

#include "tests/support/predicate_intervals.h"
#include "tests/voxelize/shell_testing.h"
#include "voxelize/overlap/shell_overlap.h"

namespace strata {
namespace {

using namespace shell_testing;  // NOLINT: the vocabulary of this file

__extension__ typedef __int128 Wide;  // not ISO C++: -Wpedantic
using WideVector = std::array<Wide, 3>;

// --- the oracle: separating axes, one by one, in 128 bits ---------------------------------------

WideVector wide(glm::ivec3 p) { return {p.x, p.y, p.z}; }
WideVector minus(const WideVector& a, const WideVector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
WideVector cross(const WideVector& a, const WideVector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Wide dot(const WideVector& a, const WideVector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Whether the hulls of two point sets, projected on `axis`, leave a gap.
template <class A, class B>
bool separated(const WideVector& axis, const A& a, const B& b) {
  Wide a_low = dot(axis, a[0]), a_high = a_low, b_low = dot(axis, b[0]), b_high = b_low;
  for (const WideVector& p : a)
    a_low = std::min(a_low, dot(axis, p)), a_high = std::max(a_high, dot(axis, p));
  for (const WideVector& p : b)
    b_low = std::min(b_low, dot(axis, p)), b_high = std::max(b_high, dot(axis, p));
  return a_high < b_low || b_high < a_low;
}

struct OracleTriangle {
  std::array<WideVector, 3> p, e;
  WideVector n;
  OracleTriangle(glm::ivec3 a, glm::ivec3 b, glm::ivec3 c) : p{wide(a), wide(b), wide(c)} {
    for (std::size_t i = 0; i < 3; ++i) e[i] = minus(p[(i + 1) % 3], p[i]);
    n = cross(e[0], e[1]);
  }
};

bool oracle_box(const OracleTriangle& t, glm::ivec3 voxel) {
  std::array<WideVector, 8> box;
  for (int i = 0; i < 8; ++i) {
    box[static_cast<std::size_t>(i)] = wide(256 * (voxel + glm::ivec3(i & 1, i >> 1 & 1, i >> 2)));
  }
  constexpr std::array<WideVector, 3> kUnits = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (const WideVector& unit : kUnits) {
    if (separated(unit, t.p, box)) return false;
  }
  for (const WideVector& unit : kUnits) {
    for (const WideVector& e : t.e) {
      if (separated(cross(unit, e), t.p, box)) return false;
    }
  }
  return !separated(t.n, t.p, box);
}

// A triangle and a segment. More axes than one needs; none can be wrong, since a gap is a gap.
bool oracle_segment(const OracleTriangle& t, const WideVector& centre, const WideVector& d) {
  std::array<WideVector, 2> segment;
  for (std::size_t i = 0; i < 3; ++i) {
    segment[0][i] = centre[i] - 128 * d[i];
    segment[1][i] = centre[i] + 128 * d[i];
  }
  std::vector<WideVector> axes = {t.n, d, cross(t.n, d)};
  for (std::size_t i = 0; i < 3; ++i) {
    const WideVector to = minus(t.p[i], centre), side = cross(d, t.e[i]);
    axes.insert(axes.end(), {t.e[i], cross(t.n, t.e[i]), side, cross(d, side), cross(t.e[i], side),
                             cross(d, to), cross(d, cross(d, to))});
  }
  return std::none_of(axes.begin(), axes.end(),
                      [&](const WideVector& axis) { return separated(axis, t.p, segment); });
}

bool oracle_thin(const OracleTriangle& t, glm::ivec3 voxel, int most_nonzero) {
  if (!oracle_box(t, voxel)) return false;  // the segments lie within the box
  const WideVector centre = wide(256 * voxel + 128);
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const int nonzero = std::abs(x) + std::abs(y) + std::abs(z);
        if (nonzero == 0 || nonzero > most_nonzero) continue;
        if (oracle_segment(t, centre, {x, y, z})) return true;
      }
    }
  }
  return false;
}

bool oracle(const OracleTriangle& t, glm::ivec3 voxel, SurfaceKind kind) {
  if (kind == SurfaceKind::kConservative) return oracle_box(t, voxel);
  return oracle_thin(t, voxel, kind == SurfaceKind::k6 ? 1 : 3);
}

VoxelSet oracle_set(const Mesh& mesh, const VoxelGrid& grid, SurfaceKind kind) {
  VoxelSet set(grid.dims);
  for (const glm::uvec3& t : mesh.triangles) {
    const OracleTriangle triangle(mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z]);
    set.for_each([&](glm::ivec3 p) {
      if (!set.at(p) && oracle(triangle, p, kind)) set.at(p) = true;
    });
  }
  return set;
}

// Random points around a grid; `step` > 1 puts many on corners, faces and centres of voxels.
glm::ivec3 random_point(std::mt19937_64& random, glm::ivec3 dims, int step, int margin = 300) {
  glm::ivec3 p;
  for (int i = 0; i < 3; ++i) {
    std::uniform_int_distribution<int> pick(-margin / step, (256 * dims[i] + margin) / step);
    p[i] = pick(random) * step;
  }
  return p;
}

glm::ivec3 random_offset(std::mt19937_64& random, int radius, int step) {
  std::uniform_int_distribution<int> pick(-radius / step, radius / step);
  return step * glm::ivec3(pick(random), pick(random), pick(random));
}

void expect_like_oracle(const Mesh& mesh, const VoxelGrid& grid, const char* what, int round) {
  for (const SurfaceKind kind : kAllKinds) {
    const VoxelSet expected = oracle_set(mesh, grid, kind);
    for (const Axis axis : kAllAxes) {
      ASSERT_TRUE(surface_set(mesh, grid, kind, axis) == expected)
          << what << " " << round << ", kind " << static_cast<int>(kind) << ", axis "
          << static_cast<int>(axis);
    }
  }
}

// --- against the oracle -------------------------------------------------------------------------

TEST(Surface, EqualsTheThirteenAxesTestOnRandomTriangles) {
  std::mt19937_64 random(1);
  const VoxelGrid grid = grid_of(5, 6, 4);
  for (int round = 0; round < 400; ++round) {
    const int step = std::array{1, 1, 64, 128, 256}[static_cast<std::size_t>(round % 5)];
    const int radius = std::array{200, 600, 2000}[static_cast<std::size_t>(round % 3)];
    Mesh mesh;
    const glm::ivec3 p = random_point(random, grid.dims, step);
    mesh.add(p, p + random_offset(random, radius, step), p + random_offset(random, radius, step));
    expect_like_oracle(mesh, grid, "triangle", round);
  }
}

TEST(Surface, EqualsTheOracleOnTrianglesSeenEdgeOn) {
  std::mt19937_64 random(2);
  const VoxelGrid grid = grid_of(5, 4, 6);
  for (int round = 0; round < 300; ++round) {
    const int step = std::array{1, 64, 128}[static_cast<std::size_t>(round % 3)];
    Mesh mesh;
    std::array<glm::ivec3, 3> p;
    for (glm::ivec3& q : p) q = random_point(random, grid.dims, step);
    const int axis = round % 2 + round / 100 % 2;
    if (round % 4 == 0) p[1][axis] = p[2][axis] = p[0][axis];                // in an axis plane
    if (round % 4 == 1) p[1][axis] = p[0][axis];                             // one edge in it
    if (round % 4 == 2) p[1] = p[0] + glm::ivec3(0, 0, p[1].z), p[2].z = 0;  // a wall
    if (round % 4 == 3) {  // along a diagonal plane: segments lie within the triangle
      for (glm::ivec3& q : p) q[(axis + 1) % 3] = q[axis];
    }
    mesh.add(p[0], p[1], p[2]);
    expect_like_oracle(mesh, grid, "edge-on triangle", round);
  }
}

TEST(Surface, EqualsTheOracleOnSegmentsAndPoints) {
  std::mt19937_64 random(3);
  const VoxelGrid grid = grid_of(5, 4, 3);
  for (int round = 0; round < 400; ++round) {
    const int step = std::array{1, 64, 128, 256}[static_cast<std::size_t>(round % 4)];
    Mesh mesh;
    const glm::ivec3 p = random_point(random, grid.dims, step);
    glm::ivec3 along = random_offset(random, 500, step);
    if (round % 5 == 0) along = {0, 0, 0};
    if (round % 5 == 1) along = {step, -step, step};
    if (round % 5 == 2) along = {0, along.y, 0};
    const int k = round % 7 - 2;
    mesh.add(p, p + along, p + k * along);  // collinear, in any order
    expect_like_oracle(mesh, grid, "segment", round);
  }
}

TEST(Surface, EqualsTheOracleAcrossTilesAndSlabs) {
  std::mt19937_64 random(4);
  for (int round = 0; round < 3; ++round) {
    glm::ivec3 dims(3);
    dims[round % 3] = 130;
    dims[(round + 1) % 3] = 70;
    const VoxelGrid grid = grid_of(dims.x, dims.y, dims.z);
    Mesh mesh;
    for (int i = 0; i < 3; ++i) {
      mesh.add(random_point(random, dims, 1), random_point(random, dims, 1),
               random_point(random, dims, 1));
    }
    for (const SurfaceKind kind : kAllKinds) {
      const VoxelSet expected = oracle_set(mesh, grid, kind);
      for (const Axis axis : kAllAxes) {
        ASSERT_TRUE(surface_set(mesh, grid, kind, axis, 3) == expected) << round;
        VoxelSet by_slabs(dims);
        const int rows = dims[AxisFrame(axis).v];
        for (int v = 0; v < rows; v += 64) {
          const auto slab = voxelize_shell(mesh.lattice(), grid, kind, axis, v,
                                           std::min(v + 64, rows), Execution{});
          ASSERT_TRUE(slab.has_value());
          add_to(by_slabs, *slab);
        }
        ASSERT_TRUE(by_slabs == expected) << round;
      }
    }
  }
}

TEST(Surface, HugeTrianglesAreClippedExactlyByTheGrid) {
  std::mt19937_64 random(5);
  const VoxelGrid grid = grid_of(7, 6, 5);
  std::uniform_int_distribution<int> far(-kMaxLatticeCoordinate, kMaxLatticeCoordinate);
  int touched = 0;
  for (int round = 0; round < 200; ++round) {
    Mesh mesh;
    std::array<glm::ivec3, 3> p;
    for (glm::ivec3& q : p) q = {far(random), far(random), far(random)};
    if (round % 2 == 0) {
      // Through the grid: a corner mirrored at a point of it, the third vertex nearby or far.
      p[0] /= 2;
      p[1] = random_point(random, grid.dims, 1, 0) * 2 - p[0];
    }
    if (round % 4 == 0) p[2] = random_point(random, grid.dims, 1);
    if (round % 8 == 2) {  // the extreme corners: the largest products
      for (glm::ivec3& q : p) {
        for (int i = 0; i < 3; ++i)
          q[i] = q[i] < 0 ? -kMaxLatticeCoordinate : kMaxLatticeCoordinate;
      }
      p[2] = random_point(random, grid.dims, 1);
    }
    mesh.add(p[0], p[1], p[2]);
    expect_like_oracle(mesh, grid, "huge triangle", round);
    touched += surface_set(mesh, grid, SurfaceKind::k6).count() > 0;
  }
  EXPECT_GT(touched, 60);
}

// By the kernels themselves: a whole slab of the largest grid would take seconds.
TEST(SurfaceOverlap, HugeTrianglesAreExactAtTheFarCornerOfTheLargestGrid) {
  std::mt19937_64 random(9);
  const int side = kMaxGridSide;
  const glm::ivec3 corner(side - 5, side - 4, side - 6);
  const shell::Window window{corner.x, side, corner.y, side, side};
  std::uniform_int_distribution<int> far(-kMaxLatticeCoordinate, kMaxLatticeCoordinate);
  int touched = 0;
  for (int round = 0; round < 400; ++round) {
    const glm::ivec3 near = 256 * corner + random_point(random, {5, 4, 6}, 1, 0);
    glm::ivec3 p(far(random), far(random), far(random));
    // 2 near - p must stay within the limits.
    p = glm::max(p, 2 * near - kMaxLatticeCoordinate);
    const std::array<glm::ivec3, 3> corners = {p, glm::ivec3(far(random), far(random), far(random)),
                                               2 * near - p};
    const OracleTriangle expected(corners[0], corners[1], corners[2]);
    shell::Triangle triangle;
    for (std::size_t i = 0; i < 3; ++i) triangle[i] = {corners[i].x, corners[i].y, corners[i].z};
    for (const SurfaceKind kind : kAllKinds) {
      VoxelSet found({5, 4, 6});
      shell::SegmentTest thin(triangle, kind == SurfaceKind::k26);
      const auto add = [&](int u, int v, int first, int last) {
        for (int w = std::max(first, corner.z); w <= last; ++w) {
          found.at(glm::ivec3(u, v, w) - corner) = true;
        }
      };
      shell::conservative_runs(triangle, window, [&](int u, int v, int first, int last) {
        if (kind == SurfaceKind::kConservative) return add(u, v, first, last);
        first = std::max(first, corner.z);
        if (first <= last) {
          thin.runs(u, v, first, last, [&](int begin, int end) { add(u, v, begin, end); });
        }
      });
      found.for_each([&](glm::ivec3 voxel) {
        ASSERT_EQ(found.at(voxel), oracle(expected, voxel + corner, kind)) << "round " << round;
        touched += found.at(voxel);
      });
    }
  }
  EXPECT_GT(touched, 5000);
}

TEST(Surface, ASegmentOfALongThinTriangleFarAwayIsExact) {
  // Slope of one part in 2^28: floating point of 24 or 53 bits would put its rows elsewhere.
  const VoxelGrid grid = grid_of(40, 3, 5);
  Mesh mesh;
  const int m = kMaxLatticeCoordinate;
  mesh.add({-m, 300, 511}, {m, 300, 513}, {m, 301, 514});
  expect_like_oracle(mesh, grid, "sliver", 0);
}

// --- what the set is and is not ----

TEST(Surface, APlateOfATenthOfAVoxelIsHeldWhole) {
  const VoxelGrid grid = grid_of(20, 20, 20);
  // 26 lattice steps thick, between two planes of centres: no centre is inside it.
  const Mesh plate = cuboid({300, 300, 2600}, {4700, 4700, 2626});
  const VoxelSet set = surface_set(plate, grid, SurfaceKind::kConservative);
  VoxelSet expected(grid.dims);
  expected.for_each([&](glm::ivec3 p) {
    expected.at(p) = p.z == 10 && p.x >= 1 && p.x <= 18 && p.y >= 1 && p.y <= 18;
  });
  EXPECT_TRUE(set == expected);

  // Tilted: every point of its surface lies in a voxel of the set.
  Mesh tilted = plate;
  for (glm::ivec3& p : tilted.vertices) p.z += p.x / 7 - p.y / 3;
  const VoxelSet tilted_set = surface_set(tilted, grid, SurfaceKind::kConservative);
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> pick(0, 1);
  for (int i = 0; i < 20000; ++i) {
    const glm::uvec3& t = tilted.triangles[static_cast<std::size_t>(i) % tilted.triangles.size()];
    double a = pick(random), b = pick(random);
    if (a + b > 1) a = 1 - a, b = 1 - b;
    const glm::dvec3 p0(tilted.vertices[t.x]), p1(tilted.vertices[t.y]), p2(tilted.vertices[t.z]);
    const glm::dvec3 p = (p0 + a * (p1 - p0) + b * (p2 - p0)) / 256.0;
    const glm::ivec3 voxel(static_cast<int>(std::floor(p.x)), static_cast<int>(std::floor(p.y)),
                           static_cast<int>(std::floor(p.z)));
    ASSERT_TRUE(tilted_set.inside(voxel));
    ASSERT_TRUE(tilted_set.at(voxel)) << i;
  }
}

TEST(Surface, AFaceOnAVoxelBoundaryFillsBothSides) {
  const VoxelGrid grid = grid_of(4, 4, 4);
  Mesh mesh;
  mesh.add({300, 300, 512}, {500, 300, 512}, {300, 500, 512});
  const VoxelSet set = surface_set(mesh, grid, SurfaceKind::kConservative);
  EXPECT_EQ(set.count(), 2);
  EXPECT_TRUE(set.at({1, 1, 1}));
  EXPECT_TRUE(set.at({1, 1, 2}));
}

TEST(Surface, DoesNotDependOnThreadsAxisOrOrderOfTriangles) {
  const VoxelGrid grid = grid_of(70, 80, 90);
  Mesh mesh = wavy_sphere({35, 40, 45}, 33, 0.05, 9, 24);
  Mesh shuffled = mesh;
  std::mt19937_64 random(7);
  std::shuffle(shuffled.triangles.begin(), shuffled.triangles.end(), random);
  for (glm::uvec3& t : shuffled.triangles) t = {t.z, t.x, t.y};
  for (std::size_t i = 0; i < shuffled.triangles.size(); i += 2) {
    std::swap(shuffled.triangles[i].x, shuffled.triangles[i].y);
  }
  for (const SurfaceKind kind : kAllKinds) {
    const VoxelSet expected = surface_set(mesh, grid, kind, Axis::kZ, 1);
    EXPECT_GT(expected.count(), 7000);
    for (const Axis axis : kAllAxes) {
      for (const int threads : {1, 2, 5}) {
        EXPECT_TRUE(surface_set(mesh, grid, kind, axis, threads) == expected);
        EXPECT_TRUE(surface_set(shuffled, grid, kind, axis, threads) == expected);
      }
    }
  }
}

TEST(Surface, NothingOutsideTheGridAndNothingFromAnEmptyMesh) {
  const VoxelGrid grid = grid_of(5, 5, 5);
  Mesh mesh;
  EXPECT_EQ(surface_set(mesh, grid, SurfaceKind::kConservative).count(), 0);
  mesh.add({-1, 0, 0}, {-1, 1280, 0}, {-1, 0, 1280});
  mesh.add({0, 0, 1281}, {1280, 0, 1281}, {0, 1280, 1281});
  EXPECT_EQ(surface_set(mesh, grid, SurfaceKind::kConservative).count(), 0);
  // The grid's own border is part of its closed voxels.
  mesh.add({1280, 10, 10}, {1280, 20, 10}, {1280, 10, 20});
  EXPECT_EQ(surface_set(mesh, grid, SurfaceKind::kConservative).count(), 1);
}

TEST(Surface, ManyTrianglesUponEachOtherStayWithinMemory) {
  const VoxelGrid grid = grid_of(64, 64, 8);
  Mesh mesh;
  mesh.vertices = {{10, 10, 300}, {16000, 20, 700}, {30, 16000, 500}};
  for (int i = 0; i < 1500; ++i) mesh.triangles.emplace_back(0, 1, 2);  // 3 million runs
  Mesh one = mesh;
  one.triangles.resize(1);
  EXPECT_TRUE(surface_set(mesh, grid, SurfaceKind::kConservative) ==
              surface_set(one, grid, SurfaceKind::kConservative));
}

TEST(Surface, AMemoryLimitIsAnErrorThatNamesIt) {
  const Mesh mesh = wavy_sphere({65, 70, 75}, 60, 0.05, 9, 40);
  Execution execution;
  execution.memory_limit = 10000;
  const auto slab = voxelize_shell(mesh.lattice(), grid_of(130, 140, 150),
                                   SurfaceKind::kConservative, Axis::kZ, 0, 140, execution);
  ASSERT_FALSE(slab.has_value());
  EXPECT_EQ(slab.error().code, ErrorCode::kLimit);
  EXPECT_NE(slab.error().message.find("10000"), std::string::npos) << slab.error().message;
}

TEST(Surface, AStopRequestCancels) {
  const Mesh mesh = wavy_sphere({10, 10, 10}, 8, 0, 1);
  std::stop_source stop;
  stop.request_stop();
  Execution execution;
  execution.stop = stop.get_token();
  const auto slab = voxelize_shell(mesh.lattice(), grid_of(20, 20, 20), SurfaceKind::k6, Axis::kY,
                                   0, 20, execution);
  ASSERT_FALSE(slab.has_value());
  EXPECT_EQ(slab.error().code, ErrorCode::kCancelled);
}

TEST(Surface, ProgressEndsAtOne) {
  const Mesh mesh = wavy_sphere({100, 100, 10}, 8, 0, 1);
  Execution execution;
  execution.threads = 1;
  double last = 0;
  execution.progress = [&](double fraction) {
    EXPECT_GT(fraction, last);
    last = fraction;
  };
  ASSERT_TRUE(voxelize_shell(mesh.lattice(), grid_of(200, 200, 20), SurfaceKind::k26, Axis::kZ, 0,
                             200, execution));
  EXPECT_EQ(last, 1.0);
}

TEST(UnionIntervals, HoldsTheVoxelsOfEitherSet) {
  std::mt19937_64 random(8);
  const VoxelGrid grid = grid_of(70, 9, 80);
  for (int round = 0; round < 20; ++round) {
    const unsigned density = static_cast<unsigned>(round % 5) * 25;
    const auto noise = [&](VoxelSet& set) {
      set.for_each([&](glm::ivec3 p) { set.at(p) = p.x + p.z > 60 && random() % 100 < density; });
    };
    VoxelSet a(grid.dims), b(grid.dims), expected(grid.dims);
    noise(a);
    if (round % 4 != 0) noise(b);
    expected.for_each([&](glm::ivec3 p) { expected.at(p) = a.at(p) || b.at(p); });
    const Axis axis = kAllAxes[static_cast<std::size_t>(round % 3)];
    const auto intervals = [&](const VoxelSet& set) {
      return intervals_from_predicate(grid, axis, [&](int i, int j, int k) {
        return set.at({i, j, k});
      });
    };
    Execution execution;
    execution.threads = 1 + round % 3;
    const auto result = union_intervals(intervals(a), intervals(b), execution);
    ASSERT_TRUE(result.has_value());
    VoxelSet set(grid.dims);
    add_to(set, *result);
    ASSERT_TRUE(set == expected) << round;
    ASSERT_EQ(result->interval_count(), intervals(expected).interval_count());
  }
}

TEST(UnionIntervals, RefusesSetsOfDifferentGrids) {
  const VoxelIntervals a(grid_of(3, 3, 3), Axis::kZ), b(grid_of(3, 3, 4), Axis::kZ);
  const auto result = union_intervals(a, b);
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().code, ErrorCode::kUsage);
  EXPECT_FALSE(union_intervals(a, VoxelIntervals(grid_of(3, 3, 3), Axis::kX)).has_value());
}

}  // namespace
}  // namespace strata
