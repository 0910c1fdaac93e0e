#include "csg/boundary/triangulate_boundary.h"

#include <gtest/gtest.h>

#include <bit>
#include <boost/multiprecision/cpp_int.hpp>
#include <numeric>

#include "mesh/check/triangles_meet.h"
#include "tests/csg/boundary/plane_grid.h"

namespace strata::csg {
namespace {

using boost::multiprecision::cpp_int;
using exact::FilePoint;
using test::PlaneGrid;

const Lattice kUnit;

TriangulatedBoundary triangulated(const BoundaryFaces& faces, int threads = 1,
                                  bool float_positions = false) {
  Execution execution;
  execution.threads = threads;
  auto result = triangulate_boundary(faces, kUnit, float_positions, execution);
  EXPECT_TRUE(result.has_value()) << (result ? "" : result.error().message);
  return result ? *std::move(result) : TriangulatedBoundary{};
}

cpp_int six_volumes(const TriangulatedBoundary& mesh) {
  cpp_int sum = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const FilePoint &a = mesh.points[t.x], &b = mesh.points[t.y], &c = mesh.points[t.z];
    sum += cpp_int(a.x) * (cpp_int(b.y) * c.z - cpp_int(b.z) * c.y) +
           cpp_int(a.y) * (cpp_int(b.z) * c.x - cpp_int(b.x) * c.z) +
           cpp_int(a.z) * (cpp_int(b.x) * c.y - cpp_int(b.y) * c.x);
  }
  return sum;
}

// Each directed edge has its opposite exactly once, and the triangles at a vertex are one fan.
testing::AssertionResult is_manifold(const TriangulatedBoundary& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  std::vector<std::map<std::uint32_t, std::uint32_t>> links(mesh.points.size());
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      ++edges[{t[k], t[(k + 1) % 3]}];
      links[t[k]][t[(k + 1) % 3]] = t[(k + 2) % 3];
    }
  }
  for (const auto& [edge, count] : edges) {
    const auto opposite = edges.find({edge.second, edge.first});
    if (count != 1 || opposite == edges.end() || opposite->second != 1) {
      return testing::AssertionFailure() << "edge " << edge.first << " to " << edge.second;
    }
  }
  for (std::size_t v = 0; v < links.size(); ++v) {
    if (links[v].empty()) return testing::AssertionFailure() << "lonely vertex " << v;
    std::size_t steps = 0;
    auto at = links[v].begin()->first;
    do {
      at = links[v].at(at);
    } while (++steps <= links[v].size() && at != links[v].begin()->first);
    if (steps != links[v].size()) return testing::AssertionFailure() << "fans at vertex " << v;
  }
  return testing::AssertionSuccess();
}

bool in_canonical_order(const TriangulatedBoundary& mesh) {
  const auto key = [](const FilePoint& p) { return std::array{p.x, p.y, p.z}; };
  for (std::size_t v = 1; v < mesh.points.size(); ++v) {
    if (key(mesh.points[v]) < key(mesh.points[v - 1])) return false;
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const glm::uvec3& c = mesh.triangles[t];
    if (c.x > c.y || c.x > c.z) return false;
    if (t == 0) continue;
    const glm::uvec3& d = mesh.triangles[t - 1];
    if (std::array{c.x, c.y, c.z} < std::array{d.x, d.y, d.z}) return false;
  }
  return true;
}

bool equal(const TriangulatedBoundary& a, const TriangulatedBoundary& b) {
  return a.points == b.points && a.positions == b.positions && a.triangles == b.triangles &&
         a.labels == b.labels && a.shells == b.shells && a.vertices_split == b.vertices_split;
}

// By bits, since g++ 12 may leave out a conversion to float and back.
bool all_are_floats(const TriangulatedBoundary& mesh) {
  constexpr std::uint64_t kBeyondFloat = (std::uint64_t{1} << 29) - 1;
  return std::all_of(mesh.positions.begin(), mesh.positions.end(), [](const glm::dvec3& p) {
    return ((std::bit_cast<std::uint64_t>(p.x) | std::bit_cast<std::uint64_t>(p.y) |
             std::bit_cast<std::uint64_t>(p.z)) &
            kBeyondFloat) == 0;
  });
}

TEST(TriangulateBoundary, ACubeHasTwelveTriangles) {
  std::mt19937 random(1);
  PlaneGrid grid(1, 5, 0, random);
  grid.set_cells({{0, 0, 0}});
  const TriangulatedBoundary mesh = triangulated(grid.faces);
  EXPECT_EQ(mesh.triangles.size(), 12u);
  EXPECT_EQ(mesh.points.size(), 8u);
  EXPECT_EQ(mesh.shells, 1u);
  EXPECT_EQ(mesh.vertices_split, 0u);
  EXPECT_EQ(mesh.positions.back(), glm::dvec3(5));
  EXPECT_TRUE(is_manifold(mesh));
  EXPECT_EQ(six_volumes(mesh), cpp_int(6 * 125) << 72);
}

TEST(TriangulateBoundary, CubesThatTouchInAnEdgeAreTwo) {
  std::mt19937 random(1);
  PlaneGrid grid(2, 5, 0, random);
  grid.set_cells({{0, 0, 0}, {1, 1, 0}});
  const TriangulatedBoundary mesh = triangulated(grid.faces);
  EXPECT_EQ(mesh.triangles.size(), 24u);
  EXPECT_EQ(mesh.points.size(), 16u);
  EXPECT_EQ(mesh.vertices_split, 2u);
  EXPECT_EQ(mesh.shells, 2u);
  EXPECT_TRUE(is_manifold(mesh));
}

TEST(TriangulateBoundary, RandomCellsGiveClosedManifoldsOfTheirVolume) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const int size = 1 + static_cast<int>(seed % 7);
    PlaneGrid grid(size, 3, 0, random);
    const std::set<test::Cell> cells =
        test::random_cells(size, 0.1 + 0.8 * (seed % 11) / 10, random);
    grid.set_cells(cells);
    const TriangulatedBoundary mesh = triangulated(grid.faces);
    ASSERT_TRUE(is_manifold(mesh));
    ASSERT_TRUE(in_canonical_order(mesh));
    ASSERT_EQ(six_volumes(mesh), cpp_int(6 * 27 * cells.size()) << 72);
    ASSERT_TRUE(equal(mesh, triangulated(test::shuffled(grid.faces, random), 3)));
  }
}

TEST(TriangulateBoundary, TiltedPlanesWithRationalPointsGiveClosedManifolds) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const int size = 1 + static_cast<int>(seed % 6);
    PlaneGrid grid(size, 1000, 150, random);
    grid.set_cells(test::random_cells(size, 0.1 + 0.8 * (seed % 11) / 10, random));
    if (grid.faces.planes.empty()) continue;
    const TriangulatedBoundary mesh = triangulated(grid.faces);
    ASSERT_TRUE(is_manifold(mesh));
    ASSERT_TRUE(in_canonical_order(mesh));
    ASSERT_GT(six_volumes(mesh), 0);
    ASSERT_TRUE(equal(mesh, triangulated(test::shuffled(grid.faces, random), 3)));
  }
}

// Whether no two triangles meet but in vertices and edges of both.
testing::AssertionResult is_clean_mesh(const TriangulatedBoundary& mesh) {
  const auto corners = [&](const glm::uvec3& t) {
    return TriangleCorners{mesh.points[t.x], mesh.points[t.y], mesh.points[t.z]};
  };
  for (std::size_t s = 0; s < mesh.triangles.size(); ++s) {
    const TriangleCorners a = corners(mesh.triangles[s]);
    if (a[0] == a[1] || a[1] == a[2] || a[2] == a[0]) {
      return testing::AssertionFailure() << "triangle " << s << " has two equal corners";
    }
    for (std::size_t t = 0; t < s; ++t) {
      if (!is_clean(triangles_meet(a, corners(mesh.triangles[t])))) {
        return testing::AssertionFailure() << "triangles " << t << " and " << s << " meet";
      }
    }
  }
  return testing::AssertionSuccess();
}

// A double cone over a polygon of lattice points: two vertices with `corners` triangles each.
BoundaryFaces double_cone(std::uint32_t corners, std::vector<exact::LatticePoint>& vertices) {
  const auto base = static_cast<std::uint32_t>(vertices.size());
  for (std::uint32_t i = 0; i < corners; ++i) {
    const double angle = 6.283185307179586 * i / corners;
    vertices.emplace_back(std::llround(1e6 * std::cos(angle)), std::llround(1e6 * std::sin(angle)),
                          0);
  }
  vertices.emplace_back(0, 0, 1000000);
  vertices.emplace_back(0, 0, -1000000);
  BoundaryFaces faces;
  for (std::uint32_t i = 0; i < corners; ++i) {
    const std::uint32_t a = base + i, b = base + (i + 1) % corners;
    faces.wholes.push_back({{a, b, base + corners}, 1});
    faces.wholes.push_back({{b, a, base + corners + 1}, 2});
  }
  return faces;
}

TEST(TriangulateBoundary, WholeTrianglesAreTakenAsTheyAre) {
  std::vector<exact::LatticePoint> vertices;
  BoundaryFaces faces = double_cone(1000, vertices);
  faces.points = BoundaryPoints(vertices, {});
  const TriangulatedBoundary mesh = triangulated(faces);
  EXPECT_EQ(mesh.triangles.size(), 2000u);
  EXPECT_EQ(mesh.points.size(), 1002u);
  EXPECT_EQ(mesh.shells, 1u);
  EXPECT_EQ(std::accumulate(mesh.labels.begin(), mesh.labels.end(), 0u), 3000u);
  EXPECT_TRUE(is_manifold(mesh));
  EXPECT_TRUE(in_canonical_order(mesh));
  std::mt19937 random(1);
  EXPECT_TRUE(equal(mesh, triangulated(test::shuffled(faces, random), 3)));
}

TEST(TriangulateBoundary, SolidsThatShareAVertexBecomeShells) {
  // Ten double cones from one vertex on, along the axis and mirrored.
  std::vector<exact::LatticePoint> vertices;
  BoundaryFaces faces = double_cone(100, vertices);
  for (int i = 1; i < 10; ++i) {
    const auto base = static_cast<std::uint32_t>(vertices.size());
    const BoundaryFaces next = double_cone(100, vertices);
    for (std::size_t v = base; v < vertices.size(); ++v) vertices[v].z += 2000000 * i;
    for (BoundaryFaces::Whole whole : next.wholes) {
      for (int k = 0; k < 3; ++k) {  // its lower tip is the upper tip below
        if (whole.points[k] == base + 101) whole.points[k] = base - 2;
      }
      faces.wholes.push_back(whole);
    }
  }
  faces.points = BoundaryPoints(vertices, {});
  const TriangulatedBoundary mesh = triangulated(faces);
  EXPECT_EQ(mesh.shells, 10u);
  EXPECT_EQ(mesh.vertices_split, 9u);
  EXPECT_EQ(mesh.points.size(), 10 * 102u);
  EXPECT_TRUE(is_manifold(mesh));
  EXPECT_TRUE(in_canonical_order(mesh));
  std::mt19937 random(1);
  EXPECT_TRUE(equal(mesh, triangulated(test::shuffled(faces, random), 3)));
}

TEST(TriangulateBoundary, WhereASolidTouchesAFaceTheFaceHasAVertex) {
  std::mt19937 random(1);
  PlaneGrid grid(1, 1000, 0, random);
  grid.set_cells({{0, 0, 0}});
  BoundaryFaces faces = grid.faces;
  ASSERT_EQ(faces.planes.size(), 6u);
  // The first plane is at x = 0.
  const auto middle = faces.points.add({BoundaryPoints::Kind::kThreePlanes, {0, 0, 0}},
                                       exact::file_point({0, 300, 400}));
  const auto outside = faces.points.add({BoundaryPoints::Kind::kThreePlanes, {0, 0, 0}},
                                        exact::file_point({0, 3000, 400}));
  const auto corner = faces.edges[faces.planes[0].first_edge].from;
  faces.touches = {outside, middle, corner, middle};
  faces.planes[0].touch_count = 4;
  const TriangulatedBoundary mesh = triangulated(faces);
  EXPECT_EQ(mesh.triangles.size(), 14u);
  EXPECT_EQ(mesh.points.size(), 9u);
  EXPECT_TRUE(is_manifold(mesh));
  EXPECT_EQ(six_volumes(mesh), cpp_int(6'000'000'000) << 72);
}

TEST(TriangulateBoundary, StopsOnRequest) {
  std::mt19937 random(1);
  PlaneGrid grid(5, 1000, 100, random);
  grid.set_cells(test::random_cells(5, 0.5, random));
  std::stop_source source;
  source.request_stop();
  Execution execution;
  execution.stop = source.get_token();
  const auto mesh = triangulate_boundary(grid.faces, kUnit, false, execution);
  ASSERT_FALSE(mesh.has_value());
  EXPECT_EQ(mesh.error().code, ErrorCode::kCancelled);
}

TEST(TriangulateBoundary, FloatPositionsAreCleanAndExact) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const int size = 1 + static_cast<int>(seed % 4);
    PlaneGrid grid(size, 1000, 150, random);
    grid.set_cells(test::random_cells(size, 0.1 + 0.8 * (seed % 11) / 10, random));
    if (grid.faces.planes.empty()) continue;
    // Distances of floats: 32 to 256 steps.
    const Lattice lattice{glm::dvec3(std::ldexp(1.0, 28 + static_cast<int>(seed % 4))), 1.0};
    const auto mesh = triangulate_boundary(grid.faces, lattice, true);
    ASSERT_TRUE(mesh.has_value());
    ASSERT_TRUE(all_are_floats(*mesh));
    ASSERT_TRUE(is_manifold(*mesh));
    ASSERT_TRUE(in_canonical_order(*mesh));
    ASSERT_TRUE(is_clean_mesh(*mesh));
    const auto again = triangulate_boundary(test::shuffled(grid.faces, random), lattice, true);
    ASSERT_TRUE(again.has_value());
    ASSERT_TRUE(equal(*mesh, *again));
  }
}

TEST(TriangulateBoundary, FloatsAsCoarseAsTheSolidAreRepairedOrRefused) {
  int repaired = 0, refused = 0;
  for (unsigned seed = 0; seed < 280; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const int size = 1 + static_cast<int>(seed % 4);
    PlaneGrid grid(size, 1000, 150, random);
    grid.set_cells(test::random_cells(size, 0.1 + 0.8 * (seed % 11) / 10, random));
    if (grid.faces.planes.empty()) continue;
    // Distances of floats: 512 to 4096 steps, in cells of about 1000.
    const Lattice lattice{glm::dvec3(std::ldexp(1.0, 32 + static_cast<int>(seed % 3))), 1.0};
    Execution execution;
    execution.threads = 1;
    const auto mesh = triangulate_boundary(grid.faces, lattice, true, execution);
    if (!mesh) {
      ASSERT_EQ(mesh.error().code, ErrorCode::kGeometry);
      ++refused;
      continue;
    }
    repaired += mesh->repaired != 0 ? 1 : 0;
    ASSERT_TRUE(all_are_floats(*mesh));
    ASSERT_TRUE(is_manifold(*mesh));
    ASSERT_TRUE(in_canonical_order(*mesh));
    ASSERT_TRUE(is_clean_mesh(*mesh));
    execution.threads = 3;
    const auto again =
        triangulate_boundary(test::shuffled(grid.faces, random), lattice, true, execution);
    ASSERT_TRUE(again.has_value());
    ASSERT_TRUE(equal(*mesh, *again));
  }
  EXPECT_GT(repaired, 40);
  EXPECT_LT(refused, 4);
}

}  // namespace
}  // namespace strata::csg
