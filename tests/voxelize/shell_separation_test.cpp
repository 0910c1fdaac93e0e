#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <queue>

#include "tests/voxelize/shell_testing.h"

// The promise of the thin surface sets: no path of neighbours crosses them.

namespace strata {
namespace {

using namespace shell_testing;  // NOLINT: the vocabulary of this file

// Winding number by solid angles (Van Oosterom and Strackee 1983), in full turns.
double winding(const Mesh& mesh, glm::dvec3 q) {
  double sum = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a = glm::dvec3(mesh.vertices[t.x]) - q, b = glm::dvec3(mesh.vertices[t.y]) - q,
                     c = glm::dvec3(mesh.vertices[t.z]) - q;
    const auto dot3 = [](glm::dvec3 x, glm::dvec3 y) { return x.x * y.x + x.y * y.y + x.z * y.z; };
    const auto norm = [&](glm::dvec3 x) { return std::sqrt(dot3(x, x)); };
    const glm::dvec3 bc(b.y * c.z - b.z * c.y, b.z * c.x - b.x * c.z, b.x * c.y - b.y * c.x);
    sum += 2 * std::atan2(dot3(a, bc), norm(a) * norm(b) * norm(c) + dot3(a, b) * norm(c) +
                                           dot3(b, c) * norm(a) + dot3(c, a) * norm(b));
  }
  return sum / (4 * std::numbers::pi);
}

// Voxels that paths of neighbours from voxel (0, 0, 0) reach without entering `walls`. Neighbours
// differ in up to `most` coordinates.
VoxelSet flood(const VoxelSet& walls, glm::ivec3 dims, int most) {
  VoxelSet reached(dims);
  std::queue<glm::ivec3> queue;
  EXPECT_FALSE(walls.at({0, 0, 0}));
  reached.at({0, 0, 0}) = true;
  queue.push({0, 0, 0});
  while (!queue.empty()) {
    const glm::ivec3 p = queue.front();
    queue.pop();
    for (int i = 0; i < 27; ++i) {
      const glm::ivec3 d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1), q = p + d;
      if (std::abs(d.x) + std::abs(d.y) + std::abs(d.z) > most) continue;
      if (!walls.inside(q) || walls.at(q) || reached.at(q)) continue;
      reached.at(q) = true;
      queue.push(q);
    }
  }
  return reached;
}

// Voxels off the walls that the flood reached although the mesh winds around them, and how many it
// had to keep out of.
struct Leak {
  int leaked = 0, sealed = 0;
};
Leak count_leaks(const VoxelSet& inside, const VoxelSet& walls, glm::ivec3 dims, int most) {
  const VoxelSet reached = flood(walls, dims, most);
  Leak leak;
  walls.for_each([&](glm::ivec3 p) {
    if (walls.at(p) || !inside.at(p)) return;
    ++(reached.at(p) ? leak.leaked : leak.sealed);
  });
  return leak;
}

// Voxels off the walls whose centre the mesh winds around.
VoxelSet wound_around(const Mesh& mesh, const VoxelSet& walls, glm::ivec3 dims) {
  VoxelSet inside(dims);
  walls.for_each([&](glm::ivec3 p) {
    inside.at(p) = !walls.at(p) && std::abs(winding(mesh, glm::dvec3(256 * p + 128))) > 0.5;
  });
  return inside;
}

TEST(Surface, NoPathOfNeighboursCrossesItsThinSet) {
  const glm::ivec3 dims(24);
  const VoxelGrid grid = grid_of(dims.x, dims.y, dims.z);
  int leaks_of_the_wrong_kind = 0;
  for (unsigned seed = 0; seed < 12; ++seed) {
    const double shift = 0.037 * seed;
    Mesh mesh = wavy_sphere({12 + shift, 12 - shift, 12 + 2 * shift}, 7 + 0.2 * seed,
                            seed % 3 * 0.12, seed, seed % 2 == 0 ? 12 : 5);
    if (seed == 11) mesh = cuboid({1024 + 128, 1024, 1024 + 7}, {4096 + 128, 4096, 4096 - 7});
    const VoxelSet thin26 = surface_set(mesh, grid, SurfaceKind::k26);
    const VoxelSet thin6 = surface_set(mesh, grid, SurfaceKind::k6);
    const VoxelSet inside = wound_around(mesh, thin6, dims);  // the smaller set: the more voxels
    const Leak leak26 = count_leaks(inside, thin26, dims, 3);
    const Leak leak6 = count_leaks(inside, thin6, dims, 1);
    EXPECT_EQ(leak26.leaked, 0) << "seed " << seed;
    EXPECT_EQ(leak6.leaked, 0) << "seed " << seed;
    EXPECT_GT(leak26.sealed, 100) << "seed " << seed;
    EXPECT_GE(leak6.sealed, leak26.sealed) << "seed " << seed;
    leaks_of_the_wrong_kind += count_leaks(inside, thin6, dims, 3).leaked > 0;
  }
  EXPECT_GT(leaks_of_the_wrong_kind, 6) << "the 6-separating set should not be 26-separating";
}

TEST(Surface, TheSixSetLiesInTheTwentySixSetLiesInTheConservativeSet) {
  const VoxelGrid grid = grid_of(40, 40, 40);
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Mesh mesh = wavy_sphere({20, 20, 20}, 15, 0.1, seed, 30);
    const VoxelSet six = surface_set(mesh, grid, SurfaceKind::k6);
    const VoxelSet twenty_six = surface_set(mesh, grid, SurfaceKind::k26);
    const VoxelSet all = surface_set(mesh, grid, SurfaceKind::kConservative);
    EXPECT_TRUE(all.contains(twenty_six));
    EXPECT_TRUE(twenty_six.contains(six));
    EXPECT_LT(six.count(), twenty_six.count());
    EXPECT_LT(twenty_six.count(), all.count());
  }
}

}  // namespace
}  // namespace strata
