#include "csg/boundary/face_triangulation.h"

#include <gtest/gtest.h>

#include "tests/csg/boundary/plane_grid.h"

namespace strata::csg {
namespace {

using exact::FilePoint;
using test::PlaneGrid;
using DirectedEdge = std::pair<std::uint32_t, std::uint32_t>;

// Whether each edge of the plane belongs to one triangle, and each other one to two.
testing::AssertionResult has_its_outline(const BoundaryFaces& faces, const BoundaryPlane& plane,
                                         const FaceTriangles& out) {
  std::multiset<DirectedEdge> edges;
  for (const glm::uvec3& t : out.triangles) {
    for (int k = 0; k < 3; ++k) edges.emplace(t[k], t[(k + 1) % 3]);
  }
  for (std::uint32_t i = 0; i < plane.edge_count; ++i) {
    const BoundaryEdge& edge = faces.edges[plane.first_edge + i];
    const auto found = edges.find({edge.from, edge.to});
    if (found == edges.end()) return testing::AssertionFailure() << "no edge " << edge.from;
    edges.erase(found);
  }
  for (const auto& [from, to] : edges) {
    if (edges.count({from, to}) != 1 || edges.count({to, from}) != 1) {
      return testing::AssertionFailure() << "an edge too much: " << from << " to " << to;
    }
  }
  return testing::AssertionSuccess();
}

std::vector<FilePoint> rounded_positions(const BoundaryFaces& faces, int bits) {
  std::vector<FilePoint> positions;
  for (std::uint32_t i = 0; i < faces.points.size(); ++i) {
    const FilePoint half(std::int64_t{1} << (bits - 1));
    positions.push_back((faces.points.rounded(i) + half) >> FilePoint(bits) << FilePoint(bits));
  }
  return positions;
}

TEST(FaceTriangulation, EveryEdgeKeepsItsTriangleHoweverCoarselyPointsAreRounded) {
  int simple = 0, others = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const int size = 2 + static_cast<int>(seed % 5);
    PlaneGrid grid(size, 1000, 150, random);
    grid.set_cells(test::random_cells(size, 0.2 + 0.6 * (seed % 7) / 6, random));
    // To multiples of 256 to 4096 steps: in the end all points are a few.
    const auto positions =
        rounded_positions(grid.faces, exact::kFileBits + 8 + static_cast<int>(seed % 5));
    FaceTriangulation triangulation(grid.faces, positions);
    for (std::uint32_t p = 0; p < grid.faces.planes.size(); ++p) {
      FaceTriangles out;
      ASSERT_TRUE(triangulation.append(p, out));
      ASSERT_TRUE(has_its_outline(grid.faces, grid.faces.planes[p], out));
      ++(out.planes.front() == FaceTriangles::kNotSimple ? others : simple);
    }
  }
  EXPECT_GT(simple, 300);
  EXPECT_GT(others, 300);
}

TEST(FaceTriangulation, RefusesEdgesThatBoundNoRegion) {
  std::mt19937 random(1);
  PlaneGrid grid(1, 1000, 0, random);
  grid.set_cells({{0, 0, 0}});
  std::swap(grid.faces.edges[1].from, grid.faces.edges[1].to);
  const auto positions = rounded_positions(grid.faces, 1);
  FaceTriangulation triangulation(grid.faces, positions);
  FaceTriangles out;
  EXPECT_FALSE(triangulation.append(0, out));
  EXPECT_TRUE(triangulation.append(1, out));
}

}  // namespace
}  // namespace strata::csg
