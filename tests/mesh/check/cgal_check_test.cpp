#include "tests/mesh/check/cgal_check.h"

#include <gtest/gtest.h>

#include <glm/common.hpp>
#include <random>

#include "strata/mesh/check/mesh_check.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"

namespace strata {
namespace {

oracle::CgalCheck cgal(const TriangleSoup& mesh) {
  return oracle::cgal_check(mesh.positions, mesh.triangles);
}

TEST(CgalCheck, AgreesOnSoundMeshes) {
  for (const TriangleSoup& mesh :
       {make_box(glm::dvec3(0), glm::dvec3(1)), make_icosphere(3, 3), make_torus(3, 1, 40, 20),
        make_cone(1, 2, 50), make_torus_knot(2, 3, 0.3, 300, 12)}) {
    EXPECT_TRUE(cgal(mesh).sound()) << cgal(mesh).text();
    EXPECT_TRUE(check_mesh(mesh)->sound());
  }
  TriangleSoup touching = make_box({0, 0, 0}, {1, 1, 1});  // in an edge
  append(touching, make_box({1, 1, 0}, {2, 2, 1}));
  EXPECT_TRUE(cgal(touching).sound()) << cgal(touching).text();
  EXPECT_TRUE(check_mesh(touching)->sound());
}

TEST(CgalCheck, FindsTheSamePairsInShapesThatCross) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> draw(-1, 1);
  int crossing = 0, sound = 0;
  for (int i = 0; i < 40; ++i) {
    TriangleSoup mesh = i % 2 == 0 ? make_icosphere(1, 1) : make_box(glm::dvec3(-1), glm::dvec3(1));
    TriangleSoup other = make_torus(1, 0.4, 9, 7);
    const glm::dvec3 shift = 2.0 * glm::dvec3(draw(random), draw(random), draw(random));
    for (glm::dvec3& p : other.positions) p = glm::dvec3(p.y, p.z, p.x) + shift;
    append(mesh, other);
    // On a lattice of steps that make faces lie in one plane now and then, and sometimes fold over.
    const double steps = i % 4 < 2 ? 4 : 1024;
    for (glm::dvec3& p : mesh.positions) p = glm::round(p * steps) / steps;
    const MeshCheck check = *check_mesh(mesh);
    if (check.degenerate > 0 || check.moved_vertices > 0) continue;  // CGAL counts those otherwise
    const oracle::CgalCheck right = cgal(mesh);
    ASSERT_TRUE(right.mesh);
    EXPECT_EQ(check.meeting_pairs(), right.meeting_pairs) << i;
    (right.meeting_pairs > 0 ? crossing : sound) += 1;
  }
  EXPECT_GT(crossing, 5);
  EXPECT_GT(sound, 0);
}

TEST(CgalCheck, SeesWhatIsNotSound) {
  TriangleSoup box = make_box(glm::dvec3(0), glm::dvec3(1));
  TriangleSoup open = box, inside_out = box;
  open.triangles.pop_back();
  reverse_orientation(inside_out);
  EXPECT_FALSE(cgal(open).sound());
  EXPECT_FALSE(cgal(inside_out).sound());
  box.triangles.push_back(box.triangles.front());
  EXPECT_FALSE(cgal(box).mesh);
}

}  // namespace
}  // namespace strata
