#include "strata/mesh/shapes.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "strata/mesh/diagnose.h"

namespace strata {
namespace {

TEST(Shapes, AreClosedOutwardManifoldAndOfTheStatedSize) {
  const struct {
    const char* name;
    TriangleSoup mesh;
    std::size_t triangles;
  } shapes[] = {{"box", make_box({-1, 2, 3}, {4, 5, 6}), 12},
                {"uv sphere", make_uv_sphere(1.0, 7, 5), 56},
                {"least uv sphere", make_uv_sphere(1.0, 3, 2), 6},
                {"icosahedron", make_icosphere(1.0, 0), 20},
                {"icosphere", make_icosphere(1.0, 3), 1280},
                {"torus", make_torus(2.0, 0.5, 11, 7), 154},
                {"cylinder", make_cylinder(1.0, 2.0, 9), 36},
                {"cone", make_cone(1.0, 2.0, 9), 18},
                {"knot", make_torus_knot(2, 3, 0.3, 100, 8), 1600}};
  for (const auto& shape : shapes) {
    const MeshDiagnosis d = diagnose(shape.mesh);
    EXPECT_EQ(shape.mesh.triangles.size(), shape.triangles) << shape.name;
    EXPECT_TRUE(d.closed) << shape.name;
    EXPECT_GT(d.volume, 0.0) << shape.name;
    EXPECT_EQ(d.non_manifold_edges + d.degenerate_faces + d.duplicate_faces, 0u) << shape.name;
    EXPECT_EQ(d.components, 1u) << shape.name;
    EXPECT_EQ(d.welded_vertices, d.vertices) << shape.name;
    // Euler: 2 for spheres, 0 for tori.
    const auto euler = static_cast<long>(d.vertices + d.triangles) - static_cast<long>(d.edges);
    EXPECT_TRUE(euler == 2 || euler == 0) << shape.name;
  }
}

TEST(Shapes, SubdividingKeepsTheShapeAndTheElements) {
  const TriangleSoup box = make_box({0, 0, 0}, {1, 2, 3});
  const TriangleSoup fine = subdivide(subdivide(box));
  EXPECT_EQ(fine.triangles.size(), 12u * 16);
  const MeshDiagnosis d = diagnose(fine);
  EXPECT_TRUE(d.closed);
  EXPECT_EQ(d.volume, 6.0);
  EXPECT_EQ(d.area, 22.0);
  EXPECT_EQ(fine.face_elements.back(), 11u);
}

TEST(Shapes, MirroringKeepsTheOutsideOutside) {
  const TriangleSoup box = make_box({0, 0, 0}, {1, 1, 1});
  const glm::dmat4 mirror = glm::scale(glm::dmat4(1.0), glm::dvec3(-2, 1, 1));
  const MeshDiagnosis d = diagnose(transform(box, mirror));
  EXPECT_EQ(d.volume, 2.0);
  EXPECT_EQ(d.bounds, (Bounds{{-2, 0, 0}, {0, 1, 1}}));
  EXPECT_EQ(bounds(transform(box, glm::translate(glm::dmat4(1.0), glm::dvec3(5, 0, 0)))),
            (Bounds{{5, 0, 0}, {6, 1, 1}}));
}

}  // namespace
}  // namespace strata
