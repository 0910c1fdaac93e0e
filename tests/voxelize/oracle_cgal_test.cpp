// The point oracle: CGAL says of each voxel centre on which side of the snapped mesh it lies.

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <optional>
#include <tuple>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/shapes.h"
#include "tests/support/corpus.h"
#include "tests/support/trouble.h"
#include "tests/support/voxelized.h"

namespace strata {
namespace {

using namespace testkit;  // NOLINT: the tests' own vocabulary
namespace pmp = CGAL::Polygon_mesh_processing;

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;

/// The snapped mesh with vertices welded and triangles without area left out; nothing when it is
/// not a closed manifold without self-intersections, of which alone the oracle can tell.
std::optional<Mesh> oracle_mesh(const LatticeMesh& lattice) {
  std::vector<Point> points;
  std::vector<std::array<std::size_t, 3>> faces;
  std::map<std::tuple<int, int, int>, std::size_t> indices;
  const auto vertex = [&](unsigned index) {
    const glm::ivec3& p = lattice.vertices[index];
    const auto [found, added] = indices.try_emplace({p.x, p.y, p.z}, points.size());
    if (added) points.emplace_back(p.x, p.y, p.z);
    return found->second;
  };
  for (const auto& t : lattice.triangles) {
    const std::array<std::size_t, 3> face = {vertex(t.x), vertex(t.y), vertex(t.z)};
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) continue;
    faces.push_back(face);
  }
  if (!pmp::is_polygon_soup_a_polygon_mesh(faces)) return std::nullopt;
  Mesh mesh;
  pmp::polygon_soup_to_polygon_mesh(points, faces, mesh);
  if (!CGAL::is_closed(mesh) || pmp::does_self_intersect(mesh)) return std::nullopt;
  return mesh;
}

/// Compares every `stride`th voxel, and all of them next to the solid's boundary. @return voxels
/// compared
int compare(const TriangleSoup& soup, const VoxelGrid& grid, int stride) {
  const auto lattice = snap_to_lattice(soup, grid);
  EXPECT_TRUE(lattice.has_value());
  const std::optional<Mesh> mesh = oracle_mesh(*lattice);
  if (!mesh) return 0;
  const CGAL::Side_of_triangle_mesh<Mesh, Kernel> side_of(*mesh);
  const VoxelSet solid = voxel_set(soup, grid);
  int compared = 0, wrong = 0, index = 0;
  solid.for_each([&](const glm::ivec3& p) {
    bool at_boundary = false;
    for (int axis = 0; axis < 3; ++axis) {
      glm::ivec3 step{};
      step[axis] = 1;
      at_boundary = at_boundary || solid.solid(p + step) != solid.solid(p) ||
                    solid.solid(p - step) != solid.solid(p);
    }
    if (!at_boundary && ++index % stride != 0) return;
    const CGAL::Bounded_side side =
        side_of(Point(p.x * 256 + 128, p.y * 256 + 128, p.z * 256 + 128));
    if (side == CGAL::ON_BOUNDARY) return;
    ++compared;
    wrong += solid.solid(p) != (side == CGAL::ON_BOUNDED_SIDE);
  });
  EXPECT_EQ(wrong, 0) << "of " << compared;
  return compared;
}

// I22
TEST(CgalOracle, AgreesOnEveryCentreOfSimpleSolids) {
  int compared = 0, meshes = 0;
  for (const auto& [name, mesh] : simple_solids()) {
    SCOPED_TRACE(name);
    for (const int longest : {9, 26}) {
      const int n = compare(mesh, grid_around(mesh, longest, 1), 10);
      compared += n;
      meshes += n > 0;
    }
  }
  EXPECT_GT(meshes, 24) << "most of them stay simple when snapped";
  EXPECT_GT(compared, 20'000);
}

TEST(CgalOracle, AgreesWithFacesAndVerticesOnVoxelCentres) {
  const VoxelGrid grid = unit_grid({12, 12, 12});
  TriangleSoup box = make_box({2.5, 3.5, 4.5}, {7.5, 8.5, 9.5});
  EXPECT_GT(compare(box, grid, 1), 1000);
  // An octahedron with all corners on centres.
  TriangleSoup octahedron;
  octahedron.positions = {{1.5, 6.5, 6.5},  {11.5, 6.5, 6.5}, {6.5, 1.5, 6.5},
                          {6.5, 11.5, 6.5}, {6.5, 6.5, 1.5},  {6.5, 6.5, 11.5}};
  octahedron.triangles = {{1, 3, 5}, {3, 0, 5}, {0, 2, 5}, {2, 1, 5},
                          {3, 1, 4}, {0, 3, 4}, {2, 0, 4}, {1, 2, 4}};
  ASSERT_TRUE(is_closed(octahedron));
  EXPECT_GT(compare(octahedron, grid, 1), 1000);
  std::mt19937_64 random(22);
  int compared = 0;
  for (int round = 0; round < 150; ++round) {
    const TriangleSoup one = random_tetrahedra(random, 1, round % 2 == 0 ? 128 : 32, 0, 12 * 256);
    if (signed_volume(one) > 0) compared += compare(one, grid, 3);
  }
  EXPECT_GT(compared, 10'000);
}

TEST(CgalOracle, AgreesOnRealMeshes) {
  int meshes = 0;
  for (const auto& [name, mesh] : scans({"homer", "fandisk", "man", "diplodocus"})) {
    SCOPED_TRACE(name);
    meshes += compare(mesh, grid_around(mesh, 40, 1), 50) > 0;
  }
  for (const auto& [name, mesh] : real_meshes(8'000)) {
    if (diagnose(mesh).inverted || !is_closed(mesh)) continue;
    SCOPED_TRACE(name);
    const Bounds box = bounds(mesh);
    if (box.low == box.high) continue;
    meshes += compare(mesh, grid_around(mesh, 30, 1), 50) > 0;
  }
  if (meshes == 0) GTEST_SKIP() << kNoMeshes;
}

}  // namespace
}  // namespace strata
