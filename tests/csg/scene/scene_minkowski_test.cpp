#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <initializer_list>
#include <map>
#include <random>
#include <string>
#include <utility>

#include "csg/solids/hull.h"
#include "csg/solids/minkowski.h"
#include "strata/mesh/diagnose.h"
#include "strata/mesh/shapes.h"
#include "tests/csg/scene/scene_checks.h"

namespace strata::csg {
namespace {

// --- hull
// -----------------------------------------------------------------------------------------

TEST(Hull, OfRandomPointsHoldsThemAllAndNothingMore) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-3, 3);
  for (int round = 0; round < 50; ++round) {
    std::vector<glm::dvec3> points;
    const glm::dvec3 far = round % 2 ? glm::dvec3(1e5, -2e5, 3e4) : glm::dvec3(0);
    for (int i = 0; i < 5 + 4 * round; ++i) {
      points.push_back(far + glm::dvec3(number(random), number(random), number(random)));
    }
    const auto hull = convex_hull(points);
    ASSERT_TRUE(hull.has_value()) << hull.error().message;
    EXPECT_TRUE(is_closed(*hull));
    EXPECT_GT(signed_volume(*hull), 0.0);
    for (const glm::uvec3& t : hull->triangles) {
      const glm::dvec3 a = hull->positions[t.x];
      const glm::dvec3 normal =
          glm::normalize(glm::cross(hull->positions[t.y] - a, hull->positions[t.z] - a));
      for (const glm::dvec3& p : points) EXPECT_LE(glm::dot(p - a, normal), 1e-9) << round;
    }
    for (const glm::dvec3& v : hull->positions) {
      EXPECT_NE(std::find(points.begin(), points.end(), v), points.end());
    }
  }
}

TEST(Hull, OfGridsAndSpheresIsClosed) {
  std::vector<glm::dvec3> grid;
  for (int i = 0; i < 1000; ++i) grid.emplace_back(i % 10, i / 10 % 10, i / 100);
  const auto cube = convex_hull(grid);
  ASSERT_TRUE(cube.has_value());
  EXPECT_EQ(cube->positions.size(), 8u);
  EXPECT_TRUE(is_closed(*cube));
  EXPECT_DOUBLE_EQ(signed_volume(*cube), 729.0);
  const TriangleSoup sphere = make_uv_sphere(5, 64, 32);  // quads, coplanar to rounding
  const auto hull = convex_hull(sphere.positions);
  ASSERT_TRUE(hull.has_value());
  EXPECT_TRUE(is_closed(*hull));
  EXPECT_NEAR(signed_volume(*hull), signed_volume(sphere), 1e-9);
}

TEST(Hull, OfFlatPointsIsAnError) {
  std::vector<glm::dvec3> points;
  for (int i = 0; i < 20; ++i) points.emplace_back(i, i * i, 3);
  for (const std::size_t count : {0u, 1u, 3u, 20u}) {
    const auto hull = convex_hull(std::span(points).first(count));
    ASSERT_FALSE(hull.has_value());
    EXPECT_EQ(hull.error().code, ErrorCode::kGeometry);
  }
}

TEST(Hull, OfUnionsIsTheHullOfAllLeaves) {
  const Scene scene =
      scene_of("hull() { cube([1,1,1]); group() { " + moved(9, 0, 0) + "cube([1,1,1]); } }");
  ASSERT_EQ(scene.tree.solids().size(), 1u);
  EXPECT_NEAR(volume_of(scene), 10.0, 1e-9);
  EXPECT_EQ(codes_of(scene), "");
}

TEST(Hull, OfDifferencesIsTheHullOfWhatIsLeft) {
  // A cube without its upper half, and a corner cut at points that no operand has.
  EXPECT_NEAR(
      volume_of("hull() difference() { cube([2,2,2]); " + moved(-1, -1, 1) + "cube([9,9,9]); }"),
      4.0, 1e-6);
  EXPECT_NEAR(
      volume_of("hull() intersection() { cube([2,2,2]); " + moved(1, 1, 1) + "cube([9,9,9]); }"),
      1.0, 1e-6);
  const double tip = volume_of("hull() difference() { cylinder($fn=4,h=4,r1=2,r2=0); " +
                               moved(-5, -5, -1) + "cube([10,10,3]); }");
  EXPECT_NEAR(tip, 2.0 * 1 * 1 * 2 / 3, 1e-6);  // the upper half of the pyramid
  EXPECT_NEAR(volume_of("hull() { " + kFrame + "}"), 1000.0, 1e-5);
}

/// Faces that coincide but for rounding leave nothing of what is taken away.
TEST(Hull, OfTurnedDifferencesWithFacesInCommon) {
  for (int i = 0; i < 20; ++i) {
    const double c = std::cos(0.1 + i), s = std::sin(0.1 + i);
    const std::string turned = fmt::format(
        "multmatrix([[{},{},0.25,{}],[{},{},0,-2],[0,0.25,1,3],[0,0,0,1]]) ", c, -s, i, s, c);
    const double scale = glm::determinant(glm::dmat3(c, s, 0, -s, c, 0.25, 0.25, 0, 1));
    // A cube without one of its edges: the hull is a prism over a triangle with its tip cut off.
    EXPECT_NEAR(volume_of("hull() { " + turned + "difference() { cube([3,3,3]); " + moved(2, 0, 2) +
                          "cube([1,3,1]); } }"),
                scale * (27 - 1.5), 1e-6)
        << turned;
  }
}

TEST(Hull, TakesFlattenedSolidsAndDropsFlatResults) {
  const std::string flat = "multmatrix([[1,0,0,0],[0,1,0,0],[0,0,0,0],[0,0,0,1]]) ";
  EXPECT_NEAR(volume_of("hull() { " + flat + "cube([2,2,2]); " + moved(0, 0, 3) + flat +
                        "cube([2,2,2]); }"),
              12.0, 1e-9);
  const Scene nothing = scene_of("hull() { " + flat + "cube(); }");
  EXPECT_EQ(codes_of(nothing), "geometry ");
  EXPECT_TRUE(nothing.tree.solids().empty());
}

TEST(Hull, OfFlatThingsIsFlat) {
  EXPECT_NEAR(volume_of("hull() { square(1); " + moved(4, 0, 5) + "square(1); }"), 5.0, 1e-6);
}

// --- minkowski
// ------------------------------------------------------------------------------------

TEST(Minkowski, OfBoxesIsABox) {
  const Scene scene =
      scene_of("minkowski() { cube([1,2,3]); " + moved(5, 0, 0) + "cube([4,4,4]); }");
  ASSERT_EQ(scene.tree.solids().size(), 1u);
  EXPECT_NEAR(volume_of(scene), 5.0 * 6 * 7, 1e-9);
  expect_box(box_of(scene), {5, 0, 0}, {10, 6, 7});
  EXPECT_EQ(scene.tree.solids()[0].mesh->triangles.size(), 12u);
}

TEST(Minkowski, OfThreeOrOneOrEmptyOperands) {
  EXPECT_NEAR(volume_of("minkowski() { cube([1,1,1]); cube([2,2,2]); cube([3,3,3]); }"), 216.0,
              1e-9);
  EXPECT_NEAR(volume_of("minkowski() { cube([2,1,1]); }"), 2.0, 1e-9);
  EXPECT_NEAR(volume_of("minkowski() { group(); cube([2,1,1]); difference(); }"), 2.0, 1e-9);
  EXPECT_TRUE(scene_of("minkowski() { group(); }").tree.solids().empty());
}

TEST(Minkowski, OfRoundAndSharpAddsWhatSteinerSays) {
  // V(K + rB) for a box and the polyhedral ball: the hull of sums, against qhull on its own sums.
  const Scene scene = scene_of("minkowski() { cube([10,20,30]); sphere($fn = 24, r = 1); }");
  const Scene ball = scene_of("sphere($fn = 24, r = 1);");
  std::vector<glm::dvec3> sums;
  for (const glm::dvec3& p : ball.tree.solids()[0].mesh->positions) {
    for (int i = 0; i < 8; ++i) {
      sums.push_back(p + glm::dvec3(i & 1 ? 10 : 0, i & 2 ? 20 : 0, i & 4 ? 30 : 0));
    }
  }
  EXPECT_NEAR(volume_of(scene), signed_volume(*convex_hull(sums)), 1e-6);
  EXPECT_GT(volume_of(scene), 6000 + 2 * (200 + 300 + 600) * 0.98);
}

TEST(Minkowski, OfAFrameKeepsItsHole) {
  const Scene scene = scene_of("minkowski() { " + kFrame + " cube([2,2,2], true); }");
  EXPECT_EQ(codes_of(scene), "");
  EXPECT_NEAR(volume_of(scene), 12.0 * 12 * 12 - 4 * 4 * 4, 1e-4);
  expect_box(box_of(scene), {-6, -6, -6}, {6, 6, 6}, 1e-6);
}

TEST(Minkowski, ClosesAHoleThatIsSmall) {
  EXPECT_NEAR(volume_of("minkowski() { " + kFrame + " cube([7,7,7], true); }"), 17.0 * 17 * 17,
              1e-3);
}

TEST(Minkowski, OfAnImportedConcaveSolidIsExact) {
  // An L of two boxes, as one polyhedron: (L + box) is the union of two boxes.
  const std::string prism =
      "polyhedron(points = [[0,0,0],[4,0,0],[4,1,0],[1,1,0],[1,4,0],[0,4,0],[0,0,1],[4,0,1],"
      "[4,1,1],[1,1,1],[1,4,1],[0,4,1]], faces = [[0,1,2,3,4,5],[11,10,9,8,7,6],[0,6,7,1],"
      "[1,7,8,2],[2,8,9,3],[3,9,10,4],[4,10,11,5],[5,11,6,0]]);";
  EXPECT_NEAR(volume_of(prism), 7.0, 1e-9);
  EXPECT_NEAR(volume_of("minkowski() { " + prism + " cube([1,1,1]); }"), 2.0 * (5 * 2 + 5 * 2 - 4),
              1e-4);
  EXPECT_NEAR(volume_of("minkowski() { cube([1,1,1]); " + prism + " }"), 2.0 * (5 * 2 + 5 * 2 - 4),
              1e-4);
}

TEST(Minkowski, OfTwoConcaveOperandsIsExact) {
  // Two frames in the plane, one unit high: a hole of 8 and bars of 1; a hole of 1 and bars of 1.
  const std::string big = "difference() { cube([10,10,1], true); cube([8,8,3], true); }";
  const std::string small = "difference() { cube([3,3,1], true); cube([1,1,3], true); }";
  EXPECT_NEAR(volume_of("minkowski() { " + big + small + " }"), 2.0 * (13 * 13 - 5 * 5), 1e-3);
}

TEST(Minkowski, OfSeparatePiecesTakesEach) {
  const std::string pair = "cube([1,1,1]); " + moved(10, 0, 0) + "cube([1,1,1]);";
  EXPECT_NEAR(volume_of("minkowski() { group() { " + pair + " } cube([1,1,1]); }"), 16.0, 1e-6);
  const std::string far = "difference() { cube([11,1,1]); " + moved(1, -1, -1) + "cube([9,3,3]); }";
  EXPECT_NEAR(volume_of("minkowski() { " + far + far + " }"), 8.0 * 3, 1e-3);
}

/// Whether every edge has two faces, vertices being the same where their positions are.
bool is_manifold(const TriangleSoup& mesh) {
  using Point = std::array<double, 3>;
  std::map<std::pair<Point, Point>, int> faces;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      const glm::dvec3 p = mesh.positions[t[i]], q = mesh.positions[t[(i + 1) % 3]];
      ++faces[std::minmax(Point{p.x, p.y, p.z}, Point{q.x, q.y, q.z})];
    }
  }
  return std::all_of(faces.begin(), faces.end(), [](const auto& edge) { return edge.second == 2; });
}

TEST(Minkowski, OfConcaveOperandsIsAUnionOfClosedSolids) {
  for (const std::string& text :
       std::initializer_list<std::string>{"minkowski() { difference() { cube([6,6,6]); "
                                          "cube([2,2,20],center=true); } cube([1,1,1]); }",
                                          "minkowski() { difference() { cube(6); " +
                                              moved(2, 2, 2) + "cube(6); } sphere(r=1,$fn=6); }"}) {
    const Scene scene = scene_of(text);
    EXPECT_GT(scene.tree.solids().size(), 2u);
    for (const Solid& solid : scene.tree.solids()) {
      EXPECT_TRUE(is_manifold(*solid.mesh)) << solid.mesh->triangles.size();
    }
  }
  // As OpenSCAD has it.
  EXPECT_NEAR(volume_of("minkowski() { difference() { cube(6); " + moved(2, 2, 2) +
                        "cube(6); } sphere(r=1,$fn=6); }"),
              393.5425, 1e-3);
}

TEST(Minkowski, ResultsAreMovedAndColouredAsWhole) {
  const Scene scene = scene_of("color([1,0,0]) " + moved(100, 0, 0) + "minkowski() { " + kFrame +
                               " color([0,0,1]) cube([2,2,2], true); }");
  for (const Solid& solid : scene.tree.solids()) {
    EXPECT_EQ(solid.colour, glm::vec4(1, 0, 0, 1));
    EXPECT_EQ(solid.name.substr(0, 9), "minkowski");
  }
  expect_box(box_of(scene), {94, -6, -6}, {106, 6, 6}, 1e-6);
}

/// Whether a point is inside a node: rays against all triangles.
bool is_inside(const Tree& tree, Tree::NodeId node, const glm::dvec3& at) {
  const Tree::Node& entry = tree.nodes()[node];
  if (entry.operation == Operation::kSolid) {
    const glm::dvec3 way(0.48123, 0.3517, 0.80311);
    int winding = 0;
    const TriangleSoup mesh = world_mesh(tree.solids()[entry.first]);
    for (const glm::uvec3& t : mesh.triangles) {
      const glm::dvec3 a = mesh.positions[t.x] - at, b = mesh.positions[t.y] - at,
                       c = mesh.positions[t.z] - at;
      const double x = glm::dot(way, glm::cross(a, b)), y = glm::dot(way, glm::cross(b, c)),
                   z = glm::dot(way, glm::cross(c, a));
      const bool leaves = x > 0 && y > 0 && z > 0, enters = x < 0 && y < 0 && z < 0;
      if (!leaves && !enters) continue;
      if (glm::dot(a, glm::cross(b, c)) * (x + y + z) > 0) winding += leaves ? 1 : -1;
    }
    return winding > 0;
  }
  const auto operands = tree.operands(node);
  const auto inside = [&](Tree::NodeId operand) { return is_inside(tree, operand, at); };
  if (entry.operation == Operation::kUnion) {
    return std::any_of(operands.begin(), operands.end(), inside);
  }
  if (entry.operation == Operation::kIntersection) {
    return std::all_of(operands.begin(), operands.end(), inside);
  }
  return inside(operands[0]) && std::none_of(operands.begin() + 1, operands.end(), inside);
}

/// Unit cubes of a block of cubes.
struct Cubes {
  glm::ivec3 size{1};
  std::vector<bool> filled;

  [[nodiscard]] bool at(const glm::ivec3& p) const {
    for (int i = 0; i < 3; ++i) {
      if (p[i] < 0 || p[i] >= size[i]) return false;
    }
    return filled[static_cast<std::size_t>((p.z * size.y + p.y) * size.x + p.x)];
  }
  template <class Body>
  void for_each(const Body& body) const {
    for (int i = 0; i < size.x * size.y * size.z; ++i) {
      const glm::ivec3 p(i % size.x, i / size.x % size.y, i / size.x / size.y);
      body(p, at(p));
    }
  }
  /// The block without the cubes that are not filled.
  [[nodiscard]] std::string text() const {
    std::string text = fmt::format("difference() {{ cube([{},{},{}]);", size.x, size.y, size.z);
    for_each([&](const glm::ivec3& p, bool is_filled) {
      if (!is_filled) text += moved(p.x, p.y, p.z) + "cube(1);";
    });
    return text + "}";
  }
};

/// The oracle: the sum of two unit cubes is the cube of side 2 from the sum of their corners on.
TEST(Minkowski, OfRandomSetsOfCubesIsTheSumOfTheCubes) {
  std::mt19937 random(20);
  const auto some = [&](const glm::ivec3& size, int holes) {
    Cubes cubes{size, std::vector<bool>(static_cast<std::size_t>(size.x * size.y * size.z), true)};
    for (int i = 0; i < holes; ++i) cubes.filled[random() % cubes.filled.size()] = false;
    return cubes;
  };
  const std::string turned =
      "multmatrix([[0.8,-0.6,0.25,1],[0.6,0.8,0,-2],[0,0.25,1,3],[0,0,0,1]]) ";
  const glm::dmat3 turn(0.8, 0.6, 0, -0.6, 0.8, 0.25, 0.25, 0, 1);
  for (int round = 0; round < 12; ++round) {
    const Cubes a = some({3, 3, round % 2 ? 3 : 1}, 1 + round % 5);
    const Cubes b =
        round % 3 == 0 ? some({1, 1, 1}, 0) : some({2, 2, 1 + round % 2}, 1 + round % 2);
    std::vector<bool> wanted;
    std::vector<glm::ivec3> places;
    const glm::ivec3 size = a.size + b.size;
    for (int i = 0; i < size.x * size.y * size.z; ++i) {
      const glm::ivec3 p(i % size.x, i / size.x % size.y, i / size.x / size.y);
      bool is_in = false;
      a.for_each([&](const glm::ivec3& q, bool in_a) {
        if (!in_a) return;
        b.for_each([&](const glm::ivec3& r, bool in_b) {
          const glm::ivec3 d = p - q - r;
          is_in |= in_b && d.x >= 0 && d.y >= 0 && d.z >= 0 && d.x < 2 && d.y < 2 && d.z < 2;
        });
      });
      places.push_back(p);
      wanted.push_back(is_in);
    }
    const bool turns = round % 4 == 1;
    const std::string before = turns ? turned : std::string();
    const std::string text = "minkowski() { " + before + a.text() + before + b.text() + " }";
    const Scene scene = scene_of(text);
    EXPECT_EQ(codes_of(scene), "") << text;
    Bounds box;
    for (std::size_t i = 0; i < places.size(); ++i) {
      for (int corner = 0; corner < 8 && wanted[i]; ++corner) {
        const glm::dvec3 p =
            glm::dvec3(places[i]) + glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2);
        box.include(turns ? turn * p + glm::dvec3(2, -4, 6) : p);
      }
      for (int k = 0; k < 3; ++k) {  // off the middle as well
        const glm::dvec3 in_cube(0.5 + 0.4 * (k - 1), 0.5 - 0.3 * (k - 1), 0.5 + 0.1 * k);
        const glm::dvec3 p = glm::dvec3(places[i]) + in_cube;
        const glm::dvec3 at = turns ? turn * p + glm::dvec3(2, -4, 6) : p;
        ASSERT_EQ(is_inside(scene.tree, scene.tree.root(), at), wanted[i])
            << text << "\nat " << p.x << " " << p.y << " " << p.z;
      }
    }
    SCOPED_TRACE(text);
    expect_box(bounds(scene.tree, scene.tree.root()), box.low, box.high, 1e-9);
  }
}

/// The sums of all pairs of points, against the walk over the polytopes' edges.
TEST(Minkowski, OfConvexSolidsHasTheHullOfAllPairs) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1, 1);
  std::vector<TriangleSoup> solids;
  for (const int count : {8, 60, 300}) {
    std::vector<glm::dvec3> points;
    for (int i = 0; i < count; ++i) {
      points.push_back(glm::normalize(glm::dvec3(number(random), number(random), number(random))));
    }
    solids.push_back(*convex_hull(points));
  }
  // Edges and faces that are parallel to each other's, in hundreds.
  solids.push_back(make_uv_sphere(2, 24, 12));
  solids.push_back(make_uv_sphere(1, 12, 24));
  for (const int count : {40, 80}) {
    TriangleSoup prism;
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * 3.14159265358979 * i / count;
      for (const double z : {0.0, 2.0}) {
        prism.positions.emplace_back(std::cos(angle), std::sin(angle), z);
      }
    }
    solids.push_back(*convex_hull(prism.positions));
  }
  for (const TriangleSoup& a : solids) {
    for (const TriangleSoup& b : solids) {
      std::vector<glm::dvec3> pairs;
      for (const glm::dvec3& p : a.positions) {
        for (const glm::dvec3& q : b.positions) pairs.push_back(p + q);
      }
      const auto wanted = convex_hull(pairs);
      const MinkowskiPart parts[2] = {*make_part(a, 0, {}), *make_part(b, 1, {})};
      const auto sum =
          minkowski_sum(std::span(parts, 1), std::span(parts + 1, 1), false, Execution{});
      ASSERT_TRUE(sum.has_value());
      ASSERT_EQ(sum->size(), 1u);
      const TriangleSoup& found = (*sum)[0].hull.mesh;
      EXPECT_NEAR(signed_volume(found), signed_volume(*wanted), 1e-9);
      EXPECT_EQ(bounds(found), bounds(*wanted));
      EXPECT_TRUE(is_closed(found));
    }
  }
}

TEST(Minkowski, OfLargeConvexSolidsIsExact) {
  // 14,450,000 pairs of vertices: V(A + B) of two balls of the same shape is V((1 + 1/2) A).
  const Scene scene = scene_of(
      "minkowski() { sphere($fn = 85, r = 2); multmatrix([[0.5,0,0,0],[0,0.5,0,0],[0,0,0.5,0],"
      "[0,0,0,1]]) sphere($fn = 85, r = 2); }");
  EXPECT_EQ(codes_of(scene), "");
  const double whole = signed_volume(*scene_of("sphere($fn = 85, r = 3);").tree.solids()[0].mesh);
  EXPECT_NEAR(volume_of(scene), whole, 1e-6);
}

TEST(Minkowski, FacesThatLieInOnePlaneBecomeOneFacet) {
  TriangleSoup l;  // an L: six corners, four triangles
  for (const glm::dvec2& p : {glm::dvec2(0, 0), glm::dvec2(4, 0), glm::dvec2(4, 1),
                              glm::dvec2(1, 1), glm::dvec2(1, 4), glm::dvec2(0, 4)}) {
    l.positions.emplace_back(p, p.x);
  }
  l.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}};
  const Facets facets = merge_facets(l);
  EXPECT_EQ(facets.size(), 2u);
  EXPECT_EQ(facets.corners.size(), 8u);
  EXPECT_EQ(merge_facets(make_uv_sphere(1, 16, 8)).size(), 16u * 8);
}

TEST(Minkowski, ThatWouldTakeTooLongIsRefusedBeforeTheWork) {
  const std::string many = "difference() { sphere($fn=90, r=5); cube([1,1,99], true); }";
  const std::string text = "group();\n  minkowski() { " + many + many + " }";
  const auto scene = parse_scene(text, "test.csg");
  ASSERT_FALSE(scene.has_value());
  EXPECT_EQ(scene.error().code, ErrorCode::kLimit);
  EXPECT_EQ(scene.error().message.find("test.csg:2:3: 'minkowski': the sum needs "), 0u)
      << scene.error().message;
  EXPECT_NE(scene.error().message.find("convex pieces"), std::string::npos);

  Execution execution;
  execution.memory_limit = 20'000'000;
  const std::string less =
      "minkowski() { difference() { sphere($fn=40); cube([1,1,9], true); } "
      "sphere($fn=40); }";
  const auto small = parse_scene(less, "test.csg", {}, execution);
  ASSERT_FALSE(small.has_value());
  EXPECT_EQ(small.error().code, ErrorCode::kLimit);
}

TEST(Minkowski, AndHullHearAStop) {
  std::stop_source source;
  source.request_stop();
  std::vector<glm::dvec3> points;
  for (int i = 0; i < 20000; ++i) {
    const double z = 1 - 2 * (i + 0.5) / 20000, r = std::sqrt(1 - z * z);
    points.emplace_back(r * std::cos(2.4 * i), r * std::sin(2.4 * i), z);
  }
  const auto hull = convex_hull(points, source.get_token());
  ASSERT_FALSE(hull.has_value());
  EXPECT_EQ(hull.error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(convex_hull(points).has_value());

  // During the work: the stop comes with the first report of progress.
  std::stop_source later;
  Execution execution;
  execution.stop = later.get_token();
  double reported = 0;
  execution.progress = [&](double done) {
    EXPECT_GE(done, reported);
    reported = done;
    if (done > 0) later.request_stop();
  };
  const auto scene = parse_scene(
      "minkowski() { difference() { sphere($fn=40); cube([1,1,9], true); } sphere($fn=30); }",
      "test.csg", {}, execution);
  ASSERT_FALSE(scene.has_value());
  EXPECT_EQ(scene.error().code, ErrorCode::kCancelled);
  EXPECT_LT(reported, 0.5);
}

}  // namespace
}  // namespace strata::csg
