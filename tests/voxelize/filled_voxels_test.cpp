// The filled fraction of voxels by lengths along rays: against convex solids that are clipped by
// the planes of each voxel, and against lists that are summed one by one.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "strata/hashbuffer/build_ldi.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "strata/voxelize/voxelize.h"
#include "tests/support/reference_lists.h"
#include "tests/support/simd_targets.h"
#include "tests/support/trouble.h"

namespace strata {
namespace {

using namespace testkit;  // NOLINT: the tests' own vocabulary

constexpr Axis kAxes[] = {Axis::kX, Axis::kY, Axis::kZ};

VoxelizeOptions with_rays(int rays, Axis axis = Axis::kZ) {
  VoxelizeOptions options;
  options.rays = rays;
  options.axis = axis;
  return options;
}

double full(int rays) { return 256.0 * rays * rays * rays; }

/// The labels of all voxels, x fastest.
std::vector<std::uint32_t> labels_of(const VoxelIntervals& set) {
  return to_dense_labels(set).value();
}

/// A convex polygon in space.
using Polygon = std::vector<glm::dvec3>;

/// What is left of a polygon where place[axis] * side <= limit * side.
Polygon clipped(const Polygon& polygon, int axis, double limit, double side, Polygon* cap) {
  Polygon result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double da = (a[axis] - limit) * side, db = (b[axis] - limit) * side;
    if (da <= 0) result.push_back(a);
    if ((da < 0 && db > 0) || (da > 0 && db < 0)) {
      glm::dvec3 cut = a + (b - a) * (da / (da - db));
      cut[axis] = limit;
      result.push_back(cut);
      cap->push_back(cut);
    }
    if (da == 0) cap->push_back(a);
  }
  return result;
}

/// The volume of a convex solid inside a box: its faces clipped by the six planes, each of which
/// closes the cut by the hull of the points on it.
double clipped_volume(std::vector<Polygon> faces, const glm::dvec3& low, const glm::dvec3& high) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {1.0, -1.0}) {
      const double limit = side > 0 ? high[axis] : low[axis];
      Polygon cap;
      std::vector<Polygon> left;
      for (const Polygon& face : faces) {
        Polygon rest = clipped(face, axis, limit, side, &cap);
        if (rest.size() >= 3) left.push_back(std::move(rest));
      }
      faces = std::move(left);
      if (cap.size() < 3) continue;
      // Sorted around the middle, as seen from outside.
      glm::dvec3 middle(0);
      for (const glm::dvec3& p : cap) middle += p / static_cast<double>(cap.size());
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      std::sort(cap.begin(), cap.end(), [&](const glm::dvec3& a, const glm::dvec3& b) {
        return side * std::atan2(a[v] - middle[v], a[u] - middle[u]) <
               side * std::atan2(b[v] - middle[v], b[u] - middle[u]);
      });
      // A face that lies in the plane is there already.
      const bool there = std::any_of(faces.begin(), faces.end(), [&](const Polygon& face) {
        return std::all_of(face.begin(), face.end(),
                           [&](const glm::dvec3& p) { return p[axis] == limit; });
      });
      if (!there) faces.push_back(cap);
    }
  }
  double six = 0;
  for (const Polygon& face : faces) {
    for (std::size_t i = 2; i < face.size(); ++i) {
      six += glm::dot(face[0] - low, glm::cross(face[i - 1] - low, face[i] - low));
    }
  }
  return six / 6;
}

struct Convex {
  TriangleSoup mesh;
  std::vector<Polygon> faces;
};

glm::dvec3 random_lattice_point(std::mt19937_64& random, int voxels) {
  std::uniform_int_distribution<int> step(0, 256 * voxels);
  return at_lattice({step(random), step(random), step(random)});
}

double volume_of(const Convex& solid, int voxels) {
  return clipped_volume(solid.faces, glm::dvec3(0), glm::dvec3(voxels));
}

Convex random_tetrahedron(std::mt19937_64& random, int voxels) {
  glm::dvec3 p[4];
  for (glm::dvec3& corner : p) corner = random_lattice_point(random, voxels);
  if (glm::dot(p[1] - p[0], glm::cross(p[2] - p[0], p[3] - p[0])) < 0) std::swap(p[0], p[1]);
  Convex result;
  result.mesh.positions.assign(p, p + 4);
  for (const glm::uvec3 t : {glm::uvec3(0, 2, 1), {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}) {
    result.mesh.triangles.push_back(t);
    result.faces.push_back({p[t.x], p[t.y], p[t.z]});
  }
  return result;
}

/// A box turned and sheared so that its corners are lattice points.
Convex random_parallelepiped(std::mt19937_64& random, int voxels) {
  glm::dvec3 edges[3];
  for (glm::dvec3& edge : edges) {
    edge = (random_lattice_point(random, voxels) - glm::dvec3(voxels / 2.0)) / 2.0;
    edge = glm::floor(edge * 256.0) / 256.0;
  }
  if (glm::dot(edges[0], glm::cross(edges[1], edges[2])) < 0) std::swap(edges[0], edges[1]);
  const glm::dvec3 centre = glm::dvec3(voxels / 2.0);
  const glm::dvec3 low =
      glm::floor((centre - (edges[0] + edges[1] + edges[2]) / 2.0) * 256.0) / 256.0;
  Convex result;
  for (int i = 0; i < 8; ++i) {
    result.mesh.positions.push_back(low + edges[0] * double(i & 1) + edges[1] * double(i >> 1 & 1) +
                                    edges[2] * double(i >> 2));
  }
  const unsigned quads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& q : quads) {
    result.mesh.triangles.push_back({q[0], q[1], q[2]});
    result.mesh.triangles.push_back({q[0], q[2], q[3]});
    Polygon& face = result.faces.emplace_back();
    for (const unsigned corner : q) face.push_back(result.mesh.positions[corner]);
  }
  return result;
}

struct Errors {
  double largest = 0, sum = 0;
  int soft = 0;  // voxels that are neither empty nor full
};

void compare(const Convex& solid, int voxels, int rays, Axis axis, Errors& errors) {
  const VoxelGrid grid = unit_grid(glm::ivec3(voxels));
  const auto labels = labels_of(voxelize(solid.mesh, grid, with_rays(rays, axis)).value());
  std::size_t at = 0;
  for (int k = 0; k < voxels; ++k) {
    for (int j = 0; j < voxels; ++j) {
      for (int i = 0; i < voxels; ++i, ++at) {
        const glm::dvec3 low(i, j, k);
        const double exact = clipped_volume(solid.faces, low, low + 1.0);
        const double error = std::abs(labels[at] / full(rays) - exact);
        errors.largest = std::max(errors.largest, error);
        errors.sum += error;
        errors.soft += exact > 1e-9 && exact < 1 - 1e-9 ? 1 : 0;
      }
    }
  }
}

TEST(Coverage, IsThatOfClippedConvexSolidsUpToTheBound) {
  constexpr int kVoxels = 7;
  double mean_before = 1;
  for (const int rays : {1, 2, 4, 8, 16, 32}) {
    std::mt19937_64 random(7);
    Errors errors;
    for (int n = 0; n < 12; ++n) {
      for (const Axis axis : kAxes) {
        compare(random_tetrahedron(random, kVoxels), kVoxels, rays, axis, errors);
        compare(random_parallelepiped(random, kVoxels), kVoxels, rays, axis, errors);
      }
    }
    const double mean = errors.sum / errors.soft;
    // Lengths rise and then fall along a row of rays, and so do their sums from row to row: each
    // of the two sums is off by 1 / rays at most. Depths are rounded up to a lattice step.
    EXPECT_LE(errors.largest, 2.0 / rays + 1.0 / (256 * rays)) << rays;
    EXPECT_LT(mean, 0.15 / rays) << rays;
    EXPECT_LT(mean, mean_before / 1.8) << rays;
    EXPECT_GT(errors.soft, 2000) << rays;
    mean_before = mean;
  }
}

TEST(Coverage, TheOracleIsRightForBoxes) {
  std::mt19937_64 random(3);
  const Convex solid = random_parallelepiped(random, 8);
  const auto& p = solid.mesh.positions;
  EXPECT_NEAR(volume_of(solid, 8),
              std::abs(glm::dot(p[1] - p[0], glm::cross(p[2] - p[0], p[4] - p[0]))), 1e-9);
}

TEST(Coverage, IsExactAlongTheRays) {
  // Walls along the rays are at quarters of voxels, those across them anywhere on the lattice.
  std::mt19937_64 random(11);
  std::uniform_int_distribution<int> quarter(0, 32), step(0, 8 * 256 * 4);
  for (int n = 0; n < 40; ++n) {
    for (const Axis axis : kAxes) {
      const AxisFrame frame(axis);
      glm::dvec3 low(0), high(0);
      for (const int side : {frame.u, frame.v, frame.w}) {
        double a = side == frame.w ? step(random) / 1024.0 : quarter(random) / 4.0;
        double b = side == frame.w ? step(random) / 1024.0 : quarter(random) / 4.0;
        if (a == b) b += 0.25;
        low[side] = std::min(a, b), high[side] = std::max(a, b);
      }
      const VoxelGrid grid = unit_grid(glm::ivec3(8));
      const auto labels =
          labels_of(voxelize(make_box(low, high), grid, with_rays(4, axis)).value());
      const auto share = [&](int side, int voxel) {
        return std::max(0.0,
                        std::min(voxel + 1.0, high[side]) - std::max<double>(voxel, low[side]));
      };
      for (int at = 0; at < 512; ++at) {
        const double expected =
            full(4) * share(0, at % 8) * share(1, at / 8 % 8) * share(2, at / 64);
        ASSERT_EQ(labels[static_cast<std::size_t>(at)], expected) << at;
      }
    }
  }
}

TEST(Coverage, OfSolidsBeyondTheGridIsFullThere) {
  const VoxelGrid grid = unit_grid({9, 5, 7});
  for (const Axis axis : kAxes) {
    const VoxelIntervals set =
        voxelize(make_box(glm::dvec3(-50), glm::dvec3(50)), grid, with_rays(8, axis)).value();
    for (const std::uint32_t label : labels_of(set)) ASSERT_EQ(label, full(8));
  }
}

/// Lengths by the reference rasterizer, ray by ray and lattice step by lattice step.
std::vector<std::uint32_t> summed(const TriangleSoup& mesh, const VoxelGrid& grid, int rays,
                                  Axis axis, InsideRule rule) {
  VoxelGrid fine = grid;
  fine.dims *= rays;
  fine.voxel_size /= rays;
  const auto lattice = snap_to_lattice(mesh, fine).value();
  const RasterTarget target = target_of(fine, axis);
  const auto lists = reference_lists<DepthItem>(lattice, target);
  const AxisFrame frame(axis);
  std::vector<std::uint32_t> sums(
      static_cast<std::size_t>(grid.dims.x * grid.dims.y * grid.dims.z));
  for (int v = 0; v < target.height; ++v) {
    for (int u = 0; u < target.width; ++u) {
      const auto list = lists.list(static_cast<std::size_t>(v * target.width + u));
      int winding = 0;
      for (std::size_t i = 0; i + 1 < list.size(); ++i) {
        winding += list[i].exit() ? -1 : 1;
        if (!is_inside(rule, winding)) continue;
        // By the tie rule a plane at a whole depth lies below it.
        const auto upper = [](DepthItem item) { return item.depth() == 0 ? 0 : item.depth() + 1; };
        for (std::uint32_t depth = upper(list[i]); depth < upper(list[i + 1]); ++depth) {
          glm::ivec3 at(0);
          at[frame.u] = u / rays, at[frame.v] = v / rays;
          at[frame.w] = static_cast<int>(depth) / (256 * rays);
          ++sums[static_cast<std::size_t>((at.z * grid.dims.y + at.y) * grid.dims.x + at.x)];
        }
      }
    }
  }
  return sums;
}

TEST(Coverage, IsTheSumOfTheListsForEveryRuleAxisAndStore) {
  const VoxelGrid grid = unit_grid({11, 12, 10});
  std::uint64_t total = 0;
  for (auto& [name, mesh] : closed_trouble()) {
    SCOPED_TRACE(name);
    for (const int rays : {1, 2, 4}) {
      for (const InsideRule rule :
           {InsideRule::kWinding, InsideRule::kNonzero, InsideRule::kParity}) {
        const Axis axis = kAxes[static_cast<int>(rule)];
        const auto expected = summed(mesh, grid, rays, axis, rule);
        for (const StoreKind store : {StoreKind::kHaBuffer, StoreKind::kCountScan}) {
          VoxelizeOptions options = with_rays(rays, axis);
          options.rule = rule;
          options.store = store;
          VoxelizeReport report;
          const VoxelIntervals set = voxelize(mesh, grid, options, {}, &report).value();
          ASSERT_EQ(labels_of(set), expected) << rays;
          std::uint64_t sum = 0;
          for (const std::uint32_t label : expected) sum += label;
          EXPECT_EQ(report.filled_steps, sum);
          total += sum;
        }
      }
    }
  }
  EXPECT_GT(total, 1000000u);
}

TEST(Coverage, IsTheSameForEverySimdTargetAndNumberOfThreads) {
  const TriangleSoup mesh = make_torus_knot(2, 3, 0.4, 120, 20);
  const VoxelGrid grid = grid_around(mesh, 70, 1);
  Execution one;
  one.threads = 1;
  const auto expected = labels_of(voxelize(mesh, grid, with_rays(8), one).value());
  const int targets = for_each_simd_target([&](const std::string& name) {
    for (const int threads : {1, 3}) {
      Execution execution;
      execution.threads = threads;
      EXPECT_EQ(labels_of(voxelize(mesh, grid, with_rays(8), execution).value()), expected)
          << name << " " << threads;
    }
  });
  EXPECT_GE(targets, 1);
}

TEST(Coverage, AddsUpToTheVolumeOfTheMesh) {
  const TriangleSoup ball = make_icosphere(10.0, 4);
  double six = 0;
  for (const glm::uvec3& t : ball.triangles) {
    six += glm::dot(ball.positions[t.x], glm::cross(ball.positions[t.y], ball.positions[t.z]));
  }
  const VoxelGrid grid = grid_around(ball, 20, 1);
  const glm::dvec3 s = grid.voxel_size;
  for (const Axis axis : kAxes) {
    for (const auto& [rays, bound] : {std::pair{2, 2e-3}, {4, 6e-4}, {8, 2e-4}, {16, 6e-5}}) {
      VoxelizeReport report;
      ASSERT_TRUE(voxelize(ball, grid, with_rays(rays, axis), {}, &report));
      const double volume = static_cast<double>(report.filled_steps) / full(rays) * s.x * s.y * s.z;
      EXPECT_NEAR(volume, six / 6, bound * six / 6) << rays;
    }
  }
}

TEST(Coverage, OfSlabsIsThatOfThePiece) {
  const TriangleSoup ball = make_icosphere(1.0, 3);
  const VoxelGrid grid = grid_around(ball, 150, 0);
  for (const int rays : {1, 2, 16}) {
    VoxelizeReport piece;
    const VoxelIntervals whole = voxelize(ball, grid, with_rays(rays), {}, &piece).value();
    Execution execution;
    execution.memory_limit = 1;  // the smallest slabs
    int rows = 0, slabs = 0, wrong = 0;
    const auto report =
        voxelize_slabs(ball, grid, with_rays(rays), execution, [&](const VoxelIntervals& slab) {
          EXPECT_EQ(slab.v_begin(), rows);
          rows = slab.v_end();
          ++slabs;
          for (int v = slab.v_begin(); v < slab.v_end(); ++v) {
            for (int u = 0; u < slab.columns(); ++u) {
              wrong += std::ranges::equal(slab.column(u, v), whole.column(u, v)) ? 0 : 1;
              wrong +=
                  std::ranges::equal(slab.column_labels(u, v), whole.column_labels(u, v)) ? 0 : 1;
            }
          }
          return Result<void>();
        });
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->filled_steps, piece.filled_steps);
    EXPECT_GT(piece.filled_steps, 0u);
    EXPECT_EQ(rows, grid.dims.y);
    EXPECT_EQ(slabs, 3);
    EXPECT_EQ(wrong, 0);
  }
}

TEST(Coverage, OfAnOpenMeshDiffersFromTheClosedOneNearItsHoleAlone) {
  TriangleSoup ball = make_icosphere(1.0, 3);
  const VoxelGrid grid = grid_around(ball, 21, 1);
  const glm::dvec3 hole = ball.positions[ball.triangles.back().x];
  const auto closed = labels_of(voxelize(ball, grid, with_rays(4)).value());
  ball.triangles.resize(ball.triangles.size() - 5);
  const auto open = labels_of(voxelize(ball, grid, with_rays(4)).value());
  std::size_t differ = 0;
  for (std::size_t i = 0; i < open.size(); ++i) {
    if (open[i] == closed[i]) continue;
    ++differ;
    const auto at = static_cast<int>(i);
    const glm::dvec3 voxel(at % grid.dims.x, at / grid.dims.x % grid.dims.y,
                           at / grid.dims.x / grid.dims.y);
    EXPECT_LT(glm::distance(grid.origin + (voxel + 0.5) * grid.voxel_size, hole), 0.6);
    EXPECT_NEAR(open[i] / full(4), closed[i] / full(4), 0.5);
  }
  EXPECT_GT(differ, 0u);
  EXPECT_LT(differ, 100u);
}

/// Where winding numbers decide, labels are those of samples in the columns that have steps.
TEST(Coverage, OfDoubtfulHolesIsNearTheSharesOfSamples) {
  TriangleSoup ball = make_icosphere(1.0, 3);
  for (std::size_t i = 0; i < ball.triangles.size(); i += 3) {
    ball.triangles[i] = ball.triangles.back();
    ball.triangles.pop_back();
  }
  const VoxelGrid grid = grid_around(ball, 12, 1);
  VoxelizeOptions samples;
  samples.samples = 8;
  const auto counted = labels_of(voxelize(ball, grid, samples).value());
  const auto covered = labels_of(voxelize(ball, grid, with_rays(8)).value());
  std::size_t there = 0;
  for (std::size_t i = 0; i < counted.size(); ++i) {
    // Of each ray the two differ by half a fine voxel at a crossing.
    EXPECT_NEAR(covered[i] / full(8), counted[i] / 512.0, 1.0 / 16) << i;
    there += counted[i] > 0 ? 1 : 0;
  }
  EXPECT_GT(there, 300u);
}

TEST(Coverage, NeedsASolidAndAPowerOfTwo) {
  const TriangleSoup box = make_box({0, 0, 0}, {1, 1, 1});
  const VoxelGrid grid = unit_grid({2, 2, 2});
  for (const int rays : {-1, 3, 12, 128}) {
    const auto refused = voxelize(box, grid, with_rays(rays));
    ASSERT_FALSE(refused) << rays;
    EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
  }
  VoxelizeOptions surface = with_rays(4);
  surface.surface = true;
  EXPECT_FALSE(voxelize(box, grid, surface));
  VoxelizeOptions samples = with_rays(4);
  samples.samples = 2;
  EXPECT_FALSE(voxelize(box, grid, samples));
  TriangleSoup open = box;
  open.triangles.pop_back();
  VoxelizeOptions kept = with_rays(4);
  kept.open = OpenMode::kSurface;
  const auto refused = voxelize(open, grid, kept);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kGeometry);
  VoxelGrid wide = unit_grid({20000, 1, 1});
  EXPECT_TRUE(voxelize(box, wide, with_rays(2)));
  EXPECT_FALSE(voxelize(box, wide, with_rays(4)));
}

}  // namespace
}  // namespace strata
