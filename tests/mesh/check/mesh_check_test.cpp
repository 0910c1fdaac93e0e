#include "strata/mesh/check/mesh_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "tests/mesh/check/brute_mesh_check.h"

namespace strata {
namespace {

TriangleSoup box(double low, double high) { return make_box(glm::dvec3(low), glm::dvec3(high)); }

TriangleSoup both(TriangleSoup a, const TriangleSoup& b) {
  append(a, b);
  return a;
}

/// Each triangle with vertices of its own, as in an STL file.
TriangleSoup exploded(const TriangleSoup& mesh) {
  TriangleSoup result;
  for (const glm::uvec3& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(result.positions.size());
    for (int k = 0; k < 3; ++k) result.positions.push_back(mesh.positions[t[k]]);
    result.triangles.emplace_back(first, first + 1, first + 2);
  }
  return result;
}

MeshCheck checked(const TriangleSoup& mesh, int threads = 0) {
  const auto check = check_mesh(mesh, {.threads = threads});
  EXPECT_TRUE(check) << check.error().message;
  return check.value_or(MeshCheck{});
}

TEST(CheckMesh, ShapesAreSoundHoweverTheyAreIndexed) {
  const TriangleSoup shapes[] = {box(0, 1),
                                 make_icosphere(3, 3),
                                 make_uv_sphere(2, 30, 20),
                                 make_torus(3, 1, 40, 20),
                                 make_cylinder(1, 2, 50),
                                 make_cone(1, 2, 50),
                                 make_torus_knot(2, 3, 0.3, 300, 12)};
  for (const TriangleSoup& shape : shapes) {
    const MeshCheck indexed = checked(shape), loose = checked(exploded(shape));
    for (const MeshCheck& check : {indexed, loose}) {
      EXPECT_TRUE(check.sound());
      EXPECT_TRUE(check.closed() && check.manifold());
      EXPECT_EQ(check.triangles, shape.triangles.size());
      EXPECT_EQ(check.edges, shape.triangles.size() / 2 * 3);
      EXPECT_EQ(check.shells, 1u);
      EXPECT_EQ(check.inward_shells, 0u);
      EXPECT_NEAR(check.volume, signed_volume(shape), 1e-12 * check.volume);
    }
    EXPECT_TRUE(indexed.by_index);
    EXPECT_FALSE(loose.by_index);
    EXPECT_EQ(indexed.volume, loose.volume);
    EXPECT_EQ(indexed.centre, loose.centre);
  }
}

TEST(CheckMesh, VolumeAreaAndCentreAreThoseOfABox) {
  const TriangleSoup mesh = make_box({10, -3, 7}, {12, 0, 7.5});
  const MeshCheck check = checked(mesh);
  EXPECT_EQ(check.volume, 3.0);
  EXPECT_EQ(check.area, 17.0);
  EXPECT_EQ(check.centre, glm::dvec3(11, -1.5, 7.25));
  EXPECT_EQ(check.moved_vertices, 0u);
}

TEST(CheckMesh, FloatsStayWhereTheyAre) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<float> draw(-1, 1);
  TriangleSoup mesh = make_icosphere(1, 3);
  for (glm::dvec3& p : mesh.positions) p = glm::dvec3(glm::vec3(p)) + glm::dvec3(1000, -5, 0);
  EXPECT_EQ(checked(mesh).moved_vertices, 0u);
  mesh.positions[5].x = 999.9999999999 + 1e-13;  // a double of its own, near the others
  EXPECT_EQ(checked(mesh).moved_vertices, 0u);
  mesh.positions[5].z = 1e-30;
  EXPECT_EQ(checked(mesh).moved_vertices, 1u);
}

TEST(CheckMesh, AHoleIsNotClosed) {
  TriangleSoup mesh = box(0, 1);
  mesh.triangles.erase(mesh.triangles.begin() + 3);
  const MeshCheck check = checked(mesh);
  EXPECT_FALSE(check.closed());
  EXPECT_FALSE(check.sound());
  EXPECT_EQ(check.unbalanced_edges, 3u);
  EXPECT_EQ(check.meeting_pairs(), 0u);
  EXPECT_TRUE(check.manifold());
  EXPECT_EQ(check.volume, 0.0);
}

TEST(CheckMesh, ATurnedTriangleIsNotClosedAndNothingElse) {
  TriangleSoup mesh = make_icosphere(1, 2);
  std::swap(mesh.triangles[7].x, mesh.triangles[7].y);
  const MeshCheck check = checked(mesh);
  EXPECT_EQ(check.unbalanced_edges, 3u);
  EXPECT_TRUE(check.manifold());
  EXPECT_EQ(check.shells, 1u);
  EXPECT_EQ(check.meeting_pairs(), 0u);
}

TEST(CheckMesh, InsideOutIsNotSoundAndCavitiesAre) {
  TriangleSoup inner = box(1, 2);
  reverse_orientation(inner);
  EXPECT_FALSE(checked(inner).sound());
  EXPECT_EQ(checked(inner).inward_shells, 1u);
  EXPECT_EQ(checked(inner).volume, -1.0);
  const MeshCheck hollow = checked(both(box(0, 4), inner));
  EXPECT_TRUE(hollow.sound());
  EXPECT_EQ(hollow.shells, 2u);
  EXPECT_EQ(hollow.inward_shells, 1u);
  EXPECT_EQ(hollow.volume, 63.0);
}

TEST(CheckMesh, BoxesThatCrossCross) {
  const MeshCheck check = checked(both(box(0, 2), box(1, 3)));
  EXPECT_FALSE(check.sound());
  EXPECT_TRUE(check.closed() && check.manifold());
  EXPECT_GT(check.crossing, 0u);
  EXPECT_EQ(check.overlapping, 0u);
  ASSERT_FALSE(check.meetings.empty());
  for (const MeetingTriangles& pair : check.meetings) {
    EXPECT_LT(pair.first, 12u);
    EXPECT_GE(pair.second, 12u);
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(pair.place[k], 1);
      EXPECT_LE(pair.place[k], 2);
    }
  }
}

TEST(CheckMesh, BoxesThatShareAFaceOverlap) {
  const MeshCheck check =
      checked(both(make_box({0, 0, 0}, {1, 1, 1}), make_box({1, 0, 0}, {2, 1, 1})));
  EXPECT_GT(check.overlapping, 0u);
  EXPECT_FALSE(check.sound());
}

TEST(CheckMesh, ASolidMayTouchItselfInAnEdgeThatIsThereTwice) {
  const TriangleSoup two = both(make_box({0, 0, 0}, {1, 1, 1}), make_box({1, 1, 0}, {2, 2, 1}));
  const MeshCheck twice = checked(two);
  EXPECT_TRUE(twice.sound());
  EXPECT_EQ(twice.shells, 2u);
  const MeshCheck once = checked(exploded(two));
  EXPECT_TRUE(once.closed());
  EXPECT_FALSE(once.manifold());
  EXPECT_EQ(once.non_manifold_edges, 1u);
  EXPECT_EQ(once.non_manifold_vertices, 2u);
  EXPECT_EQ(once.meeting_pairs(), 0u);
  ASSERT_EQ(once.edge_examples.size(), 1u);
  EXPECT_EQ(std::min(once.edge_examples[0][0].z, once.edge_examples[0][1].z), 0.0);
  EXPECT_EQ(once.edge_examples[0][0].x, 1.0);
}

TEST(CheckMesh, AVertexOfTwoFansIsNotManifold) {
  const TriangleSoup two = both(box(0, 1), box(1, 2));
  EXPECT_TRUE(checked(two).sound());
  const MeshCheck check = checked(exploded(two));
  EXPECT_EQ(check.non_manifold_edges, 0u);
  EXPECT_EQ(check.non_manifold_vertices, 1u);
  ASSERT_EQ(check.vertex_examples.size(), 1u);
  EXPECT_EQ(check.vertex_examples[0], glm::dvec3(1));
}

TEST(CheckMesh, TrianglesWithoutAreaAndDuplicatesAreCounted) {
  TriangleSoup mesh = box(0, 1);
  mesh.positions.emplace_back(0.5, 0.5, 0.5);
  mesh.triangles.emplace_back(8, 8, 8);
  EXPECT_EQ(checked(mesh).degenerate, 1u);
  mesh.triangles.back() = mesh.triangles.front();
  EXPECT_EQ(checked(mesh).duplicates, 1u);
  std::swap(mesh.triangles.back().x, mesh.triangles.back().y);
  const MeshCheck turned = checked(mesh);
  EXPECT_EQ(turned.duplicates, 1u);
  EXPECT_EQ(turned.degenerate, 0u);
  EXPECT_EQ(turned.meetings.size(), 1u);
}

TEST(CheckMesh, FacesAreNamedAsInTheFile) {
  TriangleSoup mesh = both(box(0, 2), box(1, 3));
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) mesh.face_elements.push_back(t / 2);
  for (const MeetingTriangles& pair : checked(mesh).meetings) {
    EXPECT_LT(pair.first, 6u);
    EXPECT_GE(pair.second, 6u);
    EXPECT_LT(pair.second, 12u);
  }
}

TEST(CheckMesh, TheEmptyMeshIsSound) { EXPECT_TRUE(checked({}).sound()); }

TEST(CheckMesh, ExtremeCoordinatesAreNoProblem) {
  for (const double scale : {1e-300, 1e-30, 1e30, 1e100}) {
    TriangleSoup mesh = make_icosphere(1, 2);
    for (glm::dvec3& p : mesh.positions) p *= scale;
    EXPECT_TRUE(checked(mesh).closed() && checked(mesh).manifold()) << scale;
    EXPECT_EQ(checked(mesh).meeting_pairs(), 0u) << scale;
  }
  TriangleSoup flat = box(0, 1);
  for (glm::dvec3& p : flat.positions) p = glm::dvec3(5);
  EXPECT_EQ(checked(flat).degenerate, 12u);
}

TEST(CheckMesh, RefusesWhatIsNoPosition) {
  TriangleSoup mesh = box(0, 1);
  mesh.positions[6].y = std::numeric_limits<double>::quiet_NaN();
  auto check = check_mesh(mesh);
  ASSERT_FALSE(check);
  EXPECT_EQ(check.error().code, ErrorCode::kGeometry);
  EXPECT_EQ(check.error().message, "vertex 6 of the mesh has a coordinate that is not finite");
  mesh.positions[6].y = 1.7e308;
  mesh.positions[5].y = -1.7e308;
  check = check_mesh(mesh);
  ASSERT_FALSE(check);
  EXPECT_EQ(check.error().code, ErrorCode::kGeometry);
}

TEST(CheckMesh, StopsAndKeepsTheMemoryLimit) {
  const TriangleSoup mesh = make_icosphere(1, 5);
  std::stop_source stop;
  stop.request_stop();
  Execution execution;
  execution.stop = stop.get_token();
  auto check = check_mesh(mesh, execution);
  ASSERT_FALSE(check);
  EXPECT_EQ(check.error().code, ErrorCode::kCancelled);
  check = check_mesh(mesh, {.memory_limit = 100000});
  ASSERT_FALSE(check);
  EXPECT_EQ(check.error().code, ErrorCode::kLimit);
  EXPECT_NE(check.error().message.find("20480 triangles"), std::string::npos)
      << check.error().message;
}

// Random triangles between the points of a small grid, where all kinds of faults coincide; the
// brute-force checker of the laws agrees on each pair.
TEST(CheckMesh, RandomMeshesAreAsBruteForceSays) {
  std::mt19937_64 random(17);
  int sound = 0, faulty = 0;
  for (int i = 0; i < 150; ++i) {
    TriangleSoup mesh;
    const auto below = [&](std::size_t end) { return static_cast<std::uint32_t>(random() % end); };
    const std::uint32_t side = 2 + below(3);
    for (std::uint32_t v = 0; v < side * side * side; ++v) {
      mesh.positions.emplace_back(v % side, v / side % side, v / side / side);
    }
    const std::uint32_t count = 1 + below(12);
    for (std::uint32_t t = 0; t < count; ++t) {
      const std::size_t end = mesh.positions.size();
      mesh.triangles.emplace_back(below(end), below(end), below(end));
    }
    const MeshCheck check = checked(mesh, 1 + i % 3);
    const oracle::MeshFaults right = oracle::faults_of(mesh.positions, mesh.triangles);
    EXPECT_EQ(check.meeting_pairs(), right.pairs.size());
    EXPECT_EQ(check.unbalanced_edges, right.unbalanced_edges);
    EXPECT_EQ(check.degenerate, right.degenerate);
    (right.pairs.empty() ? sound : faulty) += 1;
  }
  EXPECT_GT(sound, 10);
  EXPECT_GT(faulty, 20);
}

TEST(CheckMesh, ResultsDoNotDependOnThreads) {
  TriangleSoup mesh = both(make_icosphere(1, 5), make_torus(1, 0.4, 60, 40));
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 997)
    mesh.triangles.push_back(mesh.triangles[i]);
  const MeshCheck one = checked(mesh, 1);
  EXPECT_GT(one.crossing, 100u);
  for (const int threads : {2, 5}) {
    const MeshCheck other = checked(mesh, threads);
    EXPECT_EQ(other.crossing, one.crossing);
    EXPECT_EQ(other.overlapping, one.overlapping);
    EXPECT_EQ(other.touching, one.touching);
    EXPECT_EQ(other.area, one.area);
    EXPECT_EQ(other.non_manifold_edges, one.non_manifold_edges);
    EXPECT_EQ(other.edge_examples, one.edge_examples);
    ASSERT_EQ(other.meetings.size(), one.meetings.size());
    for (std::size_t i = 0; i < one.meetings.size(); ++i) {
      EXPECT_EQ(other.meetings[i].first, one.meetings[i].first);
      EXPECT_EQ(other.meetings[i].second, one.meetings[i].second);
      EXPECT_EQ(other.meetings[i].place, one.meetings[i].place);
    }
  }
}

}  // namespace
}  // namespace strata
