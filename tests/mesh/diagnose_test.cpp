#include "strata/mesh/diagnose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include "mesh/edge_balance.h"
#include "strata/mesh/shapes.h"

namespace strata {
namespace {

TriangleSoup unit_cube() { return make_box({0, 0, 0}, {1, 1, 1}); }

/// Every triangle with corners of its own.
TriangleSoup unwelded(const TriangleSoup& mesh) {
  TriangleSoup result;
  for (const glm::uvec3& t : mesh.triangles) {
    const auto base = static_cast<std::uint32_t>(result.positions.size());
    for (int k = 0; k < 3; ++k) result.positions.push_back(mesh.positions[t[k]]);
    result.triangles.emplace_back(base, base + 1, base + 2);
  }
  return result;
}

TriangleSoup shuffled(TriangleSoup mesh, unsigned seed) {
  std::mt19937 random(seed);
  std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
  for (glm::uvec3& t : mesh.triangles) {
    for (unsigned turns = static_cast<unsigned>(random() % 3); turns != 0; --turns)
      t = {t.y, t.z, t.x};
  }
  return mesh;
}

TEST(Diagnose, CubeIsClosedWithItsExactMeasures) {
  const MeshDiagnosis d = diagnose(unit_cube());
  EXPECT_TRUE(d.closed);
  EXPECT_TRUE(d.even);
  EXPECT_FALSE(d.inverted);
  EXPECT_EQ(d.triangles, 12u);
  EXPECT_EQ(d.welded_vertices, 8u);
  EXPECT_EQ(d.edges, 18u);
  EXPECT_EQ(d.components, 1u);
  EXPECT_EQ(d.volume, 1.0);
  EXPECT_EQ(d.area, 6.0);
  EXPECT_EQ(d.bounds, (Bounds{{0, 0, 0}, {1, 1, 1}}));
  EXPECT_EQ(d.boundary_edges + d.non_manifold_edges + d.unbalanced_edges + d.misoriented_edges, 0u);
  EXPECT_TRUE(d.examples.empty());
}

TEST(Diagnose, MissingTriangleLeavesThreeBoundaryEdgesNamedByPlace) {
  TriangleSoup mesh = unit_cube();
  mesh.triangles.erase(mesh.triangles.begin());
  mesh.face_elements = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  const MeshDiagnosis d = diagnose(mesh);
  EXPECT_FALSE(d.closed);
  EXPECT_FALSE(d.even);
  EXPECT_EQ(d.boundary_edges, 3u);
  EXPECT_EQ(d.unbalanced_edges, 3u);
  ASSERT_EQ(d.examples.size(), 3u);
  EXPECT_EQ(d.examples[0].element, 1u);  // the other half of the same side
  EXPECT_EQ(d.examples[0].forward, 1u);
  EXPECT_EQ(d.examples[0].backward, 0u);
  // The diagonal of that side, as triangle 1 runs along it.
  EXPECT_EQ(d.examples[0].from, glm::dvec3(0, 0, 0));
  EXPECT_EQ(d.examples[0].to, glm::dvec3(1, 1, 0));
}

TEST(Diagnose, OneTurnedTriangleIsEvenButNotClosed) {
  TriangleSoup mesh = unit_cube();
  std::swap(mesh.triangles[5].x, mesh.triangles[5].y);
  const MeshDiagnosis d = diagnose(mesh);
  EXPECT_FALSE(d.closed);
  EXPECT_TRUE(d.even);
  EXPECT_EQ(d.misoriented_edges, 3u);
  EXPECT_EQ(d.boundary_edges, 0u);
}

TEST(Diagnose, InsideOutIsInverted) {
  TriangleSoup mesh = make_icosphere(1.0, 2);
  reverse_orientation(mesh);
  const MeshDiagnosis d = diagnose(mesh);
  EXPECT_TRUE(d.closed);
  EXPECT_TRUE(d.inverted);
  EXPECT_LT(d.volume, 0.0);
}

TEST(Diagnose, NonManifoldMayBeClosed) {
  TriangleSoup mesh = unit_cube();
  append(mesh, make_box({1, 1, 0}, {2, 2, 1}));  // shares an edge
  append(mesh, make_box({2, 2, 1}, {3, 3, 2}));  // shares a vertex
  const MeshDiagnosis d = diagnose(mesh);
  EXPECT_TRUE(d.closed);
  EXPECT_EQ(d.non_manifold_edges, 1u);
  EXPECT_EQ(d.components, 1u);
  EXPECT_EQ(d.vertices, 24u);
  EXPECT_EQ(d.welded_vertices, 21u);
  EXPECT_EQ(d.volume, 3.0);
}

TEST(Diagnose, DuplicateTriangleOpensTheMesh) {
  TriangleSoup mesh = unit_cube();
  const glm::uvec3 t = mesh.triangles[3];
  mesh.triangles.emplace_back(t.y, t.z, t.x);
  const MeshDiagnosis d = diagnose(mesh);
  EXPECT_EQ(d.duplicate_faces, 1u);
  EXPECT_FALSE(d.closed);
  mesh.triangles.back() = {t.z, t.y, t.x};  // turned around: another face
  EXPECT_EQ(diagnose(mesh).duplicate_faces, 0u);
}

TEST(Diagnose, DegenerateAndNonFiniteFacesAreCounted) {
  TriangleSoup mesh = unit_cube();
  mesh.triangles.emplace_back(0, 0, 1);
  mesh.triangles.emplace_back(0, 0, 1);
  mesh.positions.emplace_back(0.5, 0, 0);
  mesh.triangles.emplace_back(0, 8, 1);
  mesh.positions.emplace_back(std::numeric_limits<double>::quiet_NaN(), 0, 0);
  mesh.triangles.emplace_back(0, 9, 1);
  const MeshDiagnosis d = diagnose(mesh);
  EXPECT_EQ(d.degenerate_faces, 3u);
  EXPECT_EQ(d.non_finite_faces, 1u);
  EXPECT_EQ(d.duplicate_faces, 0u);
  EXPECT_EQ(d.bounds, (Bounds{{0, 0, 0}, {1, 1, 1}}));
}

TEST(Diagnose, MinusZeroIsZero) {
  TriangleSoup mesh = unwelded(unit_cube());
  for (std::size_t i = 0; i < mesh.positions.size(); i += 2) {
    for (int k = 0; k < 3; ++k) {
      if (mesh.positions[i][k] == 0.0) mesh.positions[i][k] = -0.0;
    }
  }
  EXPECT_TRUE(is_closed(mesh));
  const MeshDiagnosis d = diagnose(mesh);
  EXPECT_TRUE(d.closed);
  EXPECT_EQ(d.welded_vertices, 8u);
}

TEST(Diagnose, VolumesAndAreasApproachTheFormulas) {
  constexpr double kPi = std::numbers::pi;
  const auto expect = [](const TriangleSoup& mesh, double volume, double area) {
    const MeshDiagnosis d = diagnose(mesh);
    EXPECT_TRUE(d.closed);
    EXPECT_NEAR(d.volume, volume, 2e-3 * volume);
    EXPECT_NEAR(d.area, area, 2e-3 * area);
    EXPECT_EQ(d.components, 1u);
    EXPECT_EQ(d.degenerate_faces, 0u);
    EXPECT_EQ(d.non_manifold_edges, 0u);
  };
  expect(make_uv_sphere(2.0, 200, 100), 32.0 / 3 * kPi, 16 * kPi);
  expect(make_icosphere(2.0, 5), 32.0 / 3 * kPi, 16 * kPi);
  expect(make_torus(3.0, 1.0, 200, 100), 6 * kPi * kPi, 12 * kPi * kPi);
  expect(make_cylinder(1.0, 3.0, 300), 3 * kPi, 8 * kPi);
  expect(make_cone(3.0, 4.0, 300), 12 * kPi, 24 * kPi);
}

TEST(Diagnose, VolumeOfAFarMeshKeepsItsDigits) {
  const TriangleSoup far = make_box({1e8, 1e8, 1e8}, {1e8 + 1, 1e8 + 1, 1e8 + 1});
  EXPECT_EQ(signed_volume(far), 1.0);
}

TEST(Diagnose, SameForAnyThreads) {
  TriangleSoup mesh = shuffled(make_torus_knot(2, 3, 0.4, 600, 60), 3);
  mesh.triangles.resize(mesh.triangles.size() - 100);
  Execution one;
  one.threads = 1;
  const MeshDiagnosis a = diagnose(mesh, one);
  for (const int threads : {2, 3, 8}) {
    Execution many;
    many.threads = threads;
    const MeshDiagnosis b = diagnose(mesh, many);
    EXPECT_EQ(a.volume, b.volume);
    EXPECT_EQ(a.area, b.area);
    EXPECT_EQ(a.unbalanced_edges, b.unbalanced_edges);
    EXPECT_EQ(a.components, b.components);
    ASSERT_EQ(a.examples.size(), b.examples.size());
    for (std::size_t i = 0; i < a.examples.size(); ++i) {
      EXPECT_EQ(a.examples[i].from, b.examples[i].from);
      EXPECT_EQ(a.examples[i].element, b.examples[i].element);
    }
  }
}

TEST(IsClosed, IndexedUnweldedAndShuffledMeshesAgree) {
  for (const TriangleSoup& mesh :
       {make_torus(2.0, 0.7, 150, 100), make_uv_sphere(1.0, 300, 80), make_cone(1.0, 1.0, 20000)}) {
    for (const int threads : {1, 2, 5}) {
      Execution execution;
      execution.threads = threads;
      EXPECT_TRUE(is_closed(mesh, execution));
      EXPECT_TRUE(is_closed(shuffled(mesh, 5), execution));
      EXPECT_TRUE(is_closed(unwelded(shuffled(mesh, 6)), execution));
      TriangleSoup open = mesh;
      open.triangles.erase(open.triangles.begin() + 777);
      EXPECT_FALSE(is_closed(open, execution));
      EXPECT_FALSE(is_closed(unwelded(open), execution));
      TriangleSoup turned = mesh;
      std::swap(turned.triangles[999].x, turned.triangles[999].y);
      EXPECT_FALSE(is_closed(turned, execution));
    }
  }
}

TEST(IsClosed, SnappingKeepsAMeshClosedAndMayCloseOne) {
  const TriangleSoup mesh = make_torus(2.0, 0.7, 60, 30);
  const auto snap = [](const TriangleSoup& soup, double steps) {
    std::vector<glm::ivec3> snapped;
    for (const glm::dvec3& p : soup.positions) snapped.emplace_back(glm::floor(p * steps + 0.5));
    return snapped;
  };
  for (const double steps : {1.0, 4.0, 100.0}) {
    const auto snapped = snap(unwelded(mesh), steps);
    EXPECT_TRUE(is_closed(snapped, unwelded(mesh).triangles));
  }
  TriangleSoup cracked = unwelded(mesh);
  cracked.positions[100].x += 1e-9;
  EXPECT_FALSE(is_closed(cracked));
  EXPECT_TRUE(is_closed(snap(cracked, 64.0), cracked.triangles));
}

/// The definition, by a map.
bool slowly_closed(const std::vector<glm::ivec3>& positions,
                   const std::vector<glm::uvec3>& triangles) {
  std::map<std::array<int, 6>, int> sums;
  for (const glm::uvec3& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      const glm::ivec3 a = positions[t[k]], b = positions[t[(k + 1) % 3]];
      ++sums[{a.x, a.y, a.z, b.x, b.y, b.z}];
      --sums[{b.x, b.y, b.z, a.x, a.y, a.z}];
    }
  }
  return std::all_of(sums.begin(), sums.end(), [](const auto& entry) { return entry.second == 0; });
}

TEST(IsClosed, AgreesWithTheDefinitionOnRandomSoups) {
  std::mt19937 random(21);
  int closed = 0;
  for (int round = 0; round < 3000; ++round) {
    // Few positions and vertices: collapses, fins, hubs with more uses than a bucket holds.
    std::vector<glm::ivec3> positions(4 + random() % 12);
    for (glm::ivec3& p : positions) {
      p = glm::ivec3(static_cast<int>(random() % 2), static_cast<int>(random() % 2),
                     static_cast<int>(random() % 2));
    }
    std::vector<glm::uvec3> triangles;
    const auto vertex = [&] { return static_cast<std::uint32_t>(random() % positions.size()); };
    for (auto n = random() % 40; n != 0; --n) {
      const glm::uvec4 v(vertex(), vertex(), vertex(), vertex());
      if (random() % 8 == 0) {
        triangles.emplace_back(v);
        continue;
      }
      // A tetrahedron is closed.
      for (const glm::uvec3& t : {glm::uvec3(v.x, v.y, v.z), glm::uvec3(v.x, v.w, v.y),
                                  glm::uvec3(v.y, v.w, v.z), glm::uvec3(v.z, v.w, v.x)}) {
        triangles.push_back(t);
      }
    }
    std::shuffle(triangles.begin(), triangles.end(), random);
    const bool expected = slowly_closed(positions, triangles);
    closed += expected;
    ASSERT_EQ(is_closed(positions, triangles), expected) << "round " << round;
    TriangleSoup soup;
    for (const glm::ivec3& p : positions) soup.positions.emplace_back(p);
    soup.triangles = triangles;
    ASSERT_EQ(diagnose(soup).closed, expected) << "round " << round;
  }
  EXPECT_GT(closed, 100);
  EXPECT_LT(closed, 2900);
}

/// The unbalanced edges by the definition.
std::vector<detail::EdgeSum> slowly_unbalanced(const std::vector<glm::uvec3>& triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::int64_t> sums;
  for (const glm::uvec3& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if (a != b) sums[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  }
  std::vector<detail::EdgeSum> result;
  for (const auto& [edge, sum] : sums) {
    if (sum != 0) result.push_back({edge.first, edge.second, sum});
  }
  return result;
}

TEST(EdgeBalance, IsThatOfAMapInAnyOrderOfManyTriangles) {
  // Above the sizes at which threads share the work, and at which neighbours are no longer sought.
  const TriangleSoup torus = make_torus(2.0, 0.7, 400, 200);
  std::mt19937 random(31);
  const auto any = [&] { return static_cast<std::uint32_t>(random() % torus.positions.size()); };
  for (const bool mixed : {false, true}) {
    TriangleSoup mesh = mixed ? shuffled(torus, 8) : torus;
    for (int round = 0; round < 3; ++round) {
      const std::vector<detail::EdgeSum> expected = slowly_unbalanced(mesh.triangles);
      EXPECT_EQ(expected.empty(), round == 0);
      for (const int threads : {1, 2, 5}) {
        Execution execution;
        execution.threads = threads;
        EXPECT_EQ(detail::unbalanced_by_index(mesh.triangles, mesh.positions.size(), execution),
                  expected)
            << mixed << round << threads;
      }
      // A few faults, then half of all.
      for (std::size_t i = 0; i < (round == 0 ? 20u : 80000u); ++i) {
        glm::uvec3& t = mesh.triangles[random() % mesh.triangles.size()];
        if (random() % 2 == 0) std::swap(t.x, t.y);
        if (random() % 2 == 0) t.z = any();
        if (random() % 4 == 0) t = mesh.triangles[random() % mesh.triangles.size()];
      }
    }
  }
}

TEST(IsClosed, EmptyMeshIsClosed) {
  EXPECT_TRUE(is_closed(TriangleSoup{}));
  EXPECT_TRUE(diagnose(TriangleSoup{}).closed);
  EXPECT_TRUE(bounds(TriangleSoup{}).empty());
}

TEST(SoupTools, UnusedVerticesDoNotWidenTheBounds) {
  TriangleSoup mesh = unit_cube();
  mesh.positions.emplace_back(100, 100, 100);
  EXPECT_EQ(bounds(mesh), (Bounds{{0, 0, 0}, {1, 1, 1}}));
}

TEST(SoupTools, AppendKeepsElementsAsOfOneFile) {
  TriangleSoup mesh = unit_cube();
  append(mesh, unit_cube());
  EXPECT_TRUE(mesh.face_elements.empty());
  TriangleSoup quads = unit_cube();
  quads.face_elements = {0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5};
  append(quads, unit_cube());
  ASSERT_EQ(quads.face_elements.size(), 24u);
  EXPECT_EQ(quads.face_elements[12], 6u);
  EXPECT_EQ(quads.face_elements[23], 17u);
  EXPECT_EQ(quads.triangles[12], unit_cube().triangles[0] + 8u);
}

}  // namespace
}  // namespace strata
