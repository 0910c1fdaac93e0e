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
      ++((out.planes.front() & FaceTriangles::kNotSimple) != 0 ? others : simple);
    }
  }
  EXPECT_GT(simple, 300);
  EXPECT_GT(others, 300);
}

std::multiset<std::array<std::uint32_t, 3>> turned_triangles(const FaceTriangles& out) {
  std::multiset<std::array<std::uint32_t, 3>> result;
  for (const glm::uvec3& t : out.triangles) {
    std::array corners{t.x, t.y, t.z};
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    result.insert(corners);
  }
  return result;
}
std::multiset<std::array<std::uint32_t, 3>> wedge_edges(const FaceTriangles& out) {
  std::multiset<std::array<std::uint32_t, 3>> result;
  for (const WedgeEdge& edge : out.wedges) {
    const glm::uvec3& t = out.triangles[edge.triangle];
    const int k = static_cast<int>(edge.corner);
    result.insert({t[k], t[(k + 1) % 3], edge.wedge});
  }
  return result;
}

TEST(FaceTriangulation, SmallFacesAreCutAsAllOthers) {
  int compared = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    PlaneGrid grid(2 + static_cast<int>(seed % 2), 1000, seed % 3 == 0 ? 0 : 150, random);
    grid.set_cells(test::random_cells(grid.size(), 0.4, random));
    const auto positions = rounded_positions(grid.faces, 1);
    // A corner as a touch changes nothing, but the face is not taken for a small one.
    BoundaryFaces others = grid.faces;
    for (BoundaryPlane& plane : others.planes) {
      plane.first_touch = static_cast<std::uint32_t>(others.touches.size());
      plane.touch_count = 1;
      others.touches.push_back(others.edges[plane.first_edge].from);
    }
    FaceTriangulation small(grid.faces, positions), large(others, positions);
    for (std::uint32_t p = 0; p < grid.faces.planes.size(); ++p) {
      FaceTriangles out, other;
      ASSERT_TRUE(small.append(p, out));
      ASSERT_TRUE(large.append(p, other));
      ASSERT_EQ(turned_triangles(out), turned_triangles(other));
      ASSERT_EQ(wedge_edges(out), wedge_edges(other));
      compared += grid.faces.planes[p].edge_count == 4 ? 1 : 0;
    }
  }
  EXPECT_GT(compared, 200);
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
