#include "strata/mesh/orient.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"

namespace strata {
namespace {

TriangleSoup box(double low, double high) { return make_box(glm::dvec3(low), glm::dvec3(high)); }

TriangleSoup turned_around(TriangleSoup mesh) {
  reverse_orientation(mesh);
  return mesh;
}

TriangleSoup joined(std::initializer_list<TriangleSoup> meshes) {
  TriangleSoup all;
  for (const TriangleSoup& mesh : meshes) append(all, mesh);
  return all;
}

/// Every `nth` triangle turned.
TriangleSoup mixed(TriangleSoup mesh, std::size_t nth) {
  for (std::size_t t = 0; t < mesh.triangles.size(); t += nth) {
    std::swap(mesh.triangles[t].x, mesh.triangles[t].y);
  }
  return mesh;
}

/// The same mesh with its triangles, and the corners of each, in another order.
TriangleSoup in_another_order(TriangleSoup mesh, unsigned seed) {
  std::mt19937 random(seed);
  std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
  for (glm::uvec3& t : mesh.triangles) {
    for (auto turns = random() % 3; turns != 0; --turns) t = {t.y, t.z, t.x};
  }
  return mesh;
}

/// The triangles as positions, each from its least corner on, sorted.
std::vector<std::array<double, 9>> faces_of(const TriangleSoup& mesh) {
  std::vector<std::array<double, 9>> faces;
  for (glm::uvec3 t : mesh.triangles) {
    const auto less = [&](std::uint32_t a, std::uint32_t b) {
      const glm::dvec3 &p = mesh.positions[a], &q = mesh.positions[b];
      return std::tie(p.x, p.y, p.z) < std::tie(q.x, q.y, q.z);
    };
    while (less(t.y, t.x) || less(t.z, t.x)) t = {t.y, t.z, t.x};
    auto& face = faces.emplace_back();
    for (int k = 0; k < 9; ++k) face[static_cast<std::size_t>(k)] = mesh.positions[t[k / 3]][k % 3];
  }
  std::sort(faces.begin(), faces.end());
  return faces;
}

/// What becomes of a mesh: the expected one, in any order of the triangles, on any threads.
Orientation expect_becomes(const TriangleSoup& mesh, const TriangleSoup& expected) {
  Orientation first;
  for (unsigned seed = 0; seed < 4; ++seed) {
    TriangleSoup result = seed == 0 ? mesh : in_another_order(mesh, seed);
    Execution execution;
    execution.threads = static_cast<int>(seed % 3) + 1;
    const Orientation found = orient_parts(result, execution);
    EXPECT_EQ(faces_of(result), faces_of(expected)) << "order " << seed;
    EXPECT_EQ(found.closed, is_closed(result));
    if (seed == 0) first = found;
    EXPECT_EQ(found.turned_parts, first.turned_parts);
    EXPECT_EQ(found.turned_triangles, first.turned_triangles);
  }
  return first;
}

void expect_stays(const TriangleSoup& mesh) { EXPECT_FALSE(expect_becomes(mesh, mesh).changed()); }

TEST(Orient, APartInsideOutBesideAnotherIsTurned) {
  const TriangleSoup a = box(0, 1), b = box(2, 3);
  for (const auto& mesh : {joined({a, turned_around(b)}), joined({turned_around(a), b})}) {
    const Orientation found = expect_becomes(mesh, joined({a, b}));
    EXPECT_EQ(found.turned_parts, 1u);
    EXPECT_EQ(found.parts, 2u);
    EXPECT_TRUE(found.closed);
    EXPECT_EQ(sentences(found, true),
              std::vector<std::string>{"1 of 2 parts were inside out and were reversed"});
  }
}

TEST(Orient, PartsThatOverlapWithoutOneHoldingTheOtherAreTurned) {
  const TriangleSoup a = box(0, 2), b = box(1, 3);
  expect_becomes(joined({a, turned_around(b)}), joined({a, b}));
}

TEST(Orient, PartsThatMeetInAVertexOrAnEdgeAreTurnedEachByItself) {
  const TriangleSoup a = box(0, 1);
  expect_becomes(joined({a, turned_around(box(1, 3))}), joined({a, box(1, 3)}));
  const TriangleSoup beside = make_box({1, 1, 0}, {3, 3, 1});
  expect_becomes(joined({a, turned_around(beside)}), joined({a, beside}));
}

TEST(Orient, PartsThatShareAFaceAreToldApartByTheFilesVertices) {
  const TriangleSoup a = box(0, 1), b = make_box({1, 0, 0}, {3, 1, 1});
  expect_becomes(joined({a, turned_around(b)}), joined({a, b}));
}

TEST(Orient, ACavityStaysOneAndAnIslandInItIsSolid) {
  const TriangleSoup outer = box(0, 10), cavity = turned_around(box(1, 9)), island = box(2, 8),
                     hole = turned_around(box(3, 7));
  expect_stays(joined({outer, cavity}));
  expect_stays(joined({outer, cavity, island, hole}));
  // Of the island's own the inner one is a hole; the island alone is wrong.
  expect_becomes(joined({outer, cavity, turned_around(island)}), joined({outer, cavity, island}));
  // Solids within solids are no matter.
  expect_stays(joined({outer, box(1, 9)}));
}

TEST(Orient, AMeshInsideOutIsTurnedWithItsCavities) {
  const TriangleSoup whole = joined({box(0, 10), turned_around(box(1, 9)), box(2, 8)});
  const Orientation found = expect_becomes(turned_around(whole), whole);
  EXPECT_TRUE(found.all_turned);
  EXPECT_TRUE(sentences(found, true).empty());
  // One of two such things.
  const glm::dmat4 beside = glm::translate(glm::dmat4(1.0), glm::dvec3(20, 0, 0));
  const TriangleSoup other = transform(whole, beside);
  EXPECT_EQ(
      expect_becomes(joined({turned_around(whole), other}), joined({whole, other})).turned_parts,
      3u);
}

TEST(Orient, ManyCavitiesAreFoundAtOnce) {
  TriangleSoup foam = box(0, 40), wrong;
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec3 at = 2.0 + 4.0 * glm::dvec3(i % 10, i / 10 % 10, i / 100);
    append(foam, turned_around(make_box(at - 1.0, at + 1.0)));
  }
  expect_stays(foam);
  append(wrong, foam);
  append(wrong, turned_around(make_box(glm::dvec3(50), glm::dvec3(51))));
  append(foam, make_box(glm::dvec3(50), glm::dvec3(51)));
  expect_becomes(wrong, foam);
}

TEST(Orient, TrianglesThatFaceTheOtherWayAreTurned) {
  const TriangleSoup sphere = make_icosphere(1.0, 3);
  for (const std::size_t nth : {2u, 3u, 10u, 500u}) {
    const Orientation found = expect_becomes(mixed(sphere, nth), sphere);
    EXPECT_EQ(found.mixed_parts, 1u);
    EXPECT_EQ(found.turned_triangles, (sphere.triangles.size() + nth - 1) / nth);
    EXPECT_TRUE(found.closed);
  }
  // More than half of them.
  expect_becomes(turned_around(mixed(sphere, 10)), sphere);
  // A cavity among them stays one.
  const TriangleSoup cavity = turned_around(make_icosphere(0.5, 3));
  expect_becomes(joined({mixed(sphere, 3), mixed(cavity, 3)}), joined({sphere, cavity}));
  // Each triangle with vertices of its own.
  TriangleSoup apart;
  for (const glm::uvec3& t : mixed(sphere, 3).triangles) {
    const auto base = static_cast<std::uint32_t>(apart.positions.size());
    for (int k = 0; k < 3; ++k) apart.positions.push_back(sphere.positions[t[k]]);
    apart.triangles.emplace_back(base, base + 1, base + 2);
  }
  expect_becomes(apart, sphere);
}

TEST(Orient, AnOpenPartIsMadeToAgree) {
  TriangleSoup open = make_icosphere(1.0, 3);
  open.triangles.resize(open.triangles.size() - 50);
  EXPECT_FALSE(expect_becomes(mixed(open, 3), open).closed);
  // As a whole by its volume.
  EXPECT_LT(expect_becomes(turned_around(open), open).turned_open_volume, 0.0);
  // And no closed part is turned with what is open.
  TriangleSoup bowl = turned_around(open);
  for (auto& p : bowl.positions) p = 10.0 * p + 30.0;
  const TriangleSoup cube = box(0, 1);
  expect_becomes(joined({cube, bowl}), joined({cube, turned_around(bowl)}));
}

TEST(Orient, ADoubleSidedSolidIsOneSolid) {
  const TriangleSoup cube = box(0, 1), sphere = make_icosphere(1.0, 2);
  for (const TriangleSoup& mesh : {cube, sphere}) {
    const Orientation found = expect_becomes(joined({mesh, turned_around(mesh)}), mesh);
    EXPECT_EQ(found.double_faces, mesh.triangles.size());
    EXPECT_TRUE(found.closed);
    expect_becomes(joined({turned_around(mesh), mesh}), mesh);
  }
  // By the same vertices.
  TriangleSoup both = cube;
  for (const glm::uvec3& t : cube.triangles) both.triangles.emplace_back(t.y, t.x, t.z);
  EXPECT_EQ(expect_becomes(both, cube).double_faces, 12u);
  // Elements keep their names.
  orient_parts(both);
  ASSERT_EQ(both.face_elements.size(), 12u);
  // A sheet with two sides bounds nothing, and neither does a wall within a solid.
  TriangleSoup sheet;
  sheet.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 2, 1}, {0, 3, 2}};
  expect_stays(sheet);
  for (auto& p : sheet.positions) p.z = 0.5;
  expect_stays(joined({cube, sheet}));
}

TEST(Orient, SidesOfADoubleSidedSolidMayBeCutAlongOtherDiagonals) {
  // As of quadrilaterals "f 1 2 3 4" and "f 4 3 2 1", which are fans from their first corners.
  constexpr std::uint32_t kFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                          {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  TriangleSoup mesh;
  for (int i = 0; i < 8; ++i) mesh.positions.emplace_back(i & 1, i >> 1 & 1, i >> 2);
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    const auto element = static_cast<std::uint32_t>(mesh.triangles.size() / 2);
    mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}});
    mesh.face_elements.insert(mesh.face_elements.end(), 2, element);
  };
  for (const auto& f : kFaces) add(f[0], f[1], f[2], f[3]);
  for (const auto& f : kFaces) add(f[3], f[2], f[1], f[0]);
  for (const bool turned : {false, true}) {
    TriangleSoup both = mesh;
    if (turned) std::reverse(both.triangles.begin(), both.triangles.end());
    const Orientation found = orient_parts(both);
    EXPECT_EQ(found.double_faces, 12u);
    EXPECT_TRUE(found.closed);
    EXPECT_EQ(both.triangles.size(), 12u);
    EXPECT_EQ(signed_volume(both), 1.0);
  }
}

TEST(Orient, AMoebiusStripStaysAsItIs) {
  TriangleSoup strip;
  constexpr std::uint32_t kSteps = 12;
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    const double around = 2 * M_PI * i / kSteps, half = around / 2;
    for (const double side : {-1.0, 1.0}) {
      const double r = 4 + side * std::cos(half);
      strip.positions.emplace_back(r * std::cos(around), r * std::sin(around),
                                   side * std::sin(half));
    }
  }
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    const std::uint32_t a = 2 * i, b = a + 1;
    const bool last = i + 1 == kSteps;
    const std::uint32_t c = last ? 1 : a + 2, d = last ? 0 : a + 3;
    strip.triangles.emplace_back(a, c, b);
    strip.triangles.emplace_back(b, c, d);
  }
  TriangleSoup result = strip;
  const Orientation found = orient_parts(result);
  EXPECT_EQ(found.not_orientable, 1u);
  EXPECT_FALSE(found.closed);
  EXPECT_EQ(found.turned_triangles + found.turned_parts, 0u);
}

TEST(Orient, WithoutChangeOnlyLooks) {
  const TriangleSoup mesh = joined({box(0, 1), turned_around(box(2, 3)), mixed(box(4, 5), 5)});
  TriangleSoup same = mesh;
  const Orientation found = orient_parts(same, {}, {.change = false});
  EXPECT_EQ(same.triangles, mesh.triangles);
  EXPECT_EQ(found.turned_parts, 1u);
  EXPECT_EQ(found.turned_triangles, 3u);
  EXPECT_FALSE(found.closed);
}

}  // namespace
}  // namespace strata
