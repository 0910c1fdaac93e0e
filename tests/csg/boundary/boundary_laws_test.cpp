// The laws of boundary meshes: what holds of the result of any tree. measure_laws_test.cpp and
// live_zone_laws_test.cpp have those of measures and of dead space.

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <tuple>

#include "csg/arrangement/cell_values.h"
#include "csg/boundary/boundary_arrangement.h"
#include "csg/boundary/open_edges.h"
#include "csg/lattice/live_zone.h"
#include "strata/csg/solid_lists.h"
#include "strata/hashbuffer/build_ldi.h"
#include "tests/csg/boundary/boundary_laws.h"
#include "tests/csg/boundary/brute_meeting.h"
#include "tests/support/voxelized.h"

namespace strata::csg {
namespace {

// The same solids, with triangles, vertices, operands and solids in another order.
class Shuffler {
 public:
  Shuffler(const Tree& from, std::mt19937_64& random) : from_(from), random_(random) {
    if (from.root() != Tree::kNone) result.set_root(copy(from.root()));
  }
  Tree result;

 private:
  Tree::NodeId copy(Tree::NodeId node) {
    const Tree::Node& what = from_.nodes()[node];
    if (what.operation == Operation::kSolid) {
      Solid solid = from_.solids()[what.first];
      solid.mesh = std::make_shared<const TriangleSoup>(shuffled(*solid.mesh));
      return result.add_solid(solid);
    }
    const auto operands = from_.operands(node);
    std::vector<std::size_t> order(operands.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::shuffle(order.begin(), order.end(), random_);
    std::vector<Tree::NodeId> copies(operands.size());
    for (const std::size_t i : order) copies[i] = copy(operands[i]);
    const auto first = copies.begin() + (what.operation == Operation::kDifference ? 1 : 0);
    if (!copies.empty()) std::shuffle(first, copies.end(), random_);
    return result.add(what.operation, copies);
  }

  TriangleSoup shuffled(const TriangleSoup& mesh) {
    TriangleSoup result_mesh = mesh;
    std::vector<std::uint32_t> place(mesh.positions.size());
    std::iota(place.begin(), place.end(), 0u);
    std::shuffle(place.begin(), place.end(), random_);
    for (std::size_t v = 0; v < place.size(); ++v) {
      result_mesh.positions[place[v]] = mesh.positions[v];
    }
    std::shuffle(result_mesh.triangles.begin(), result_mesh.triangles.end(), random_);
    for (glm::uvec3& t : result_mesh.triangles) {
      const auto turn = static_cast<int>(random_() % 3);
      const glm::uvec3 old = t;
      for (int k = 0; k < 3; ++k) t[k] = place[old[(k + turn) % 3]];
    }
    return result_mesh;
  }

  const Tree& from_;
  std::mt19937_64& random_;
};

// Laws L1, L9.

TEST(BoundaryLaws, EveryMeshIsClosedAndManifold) {
  std::size_t triangles = 0;
  for (const TinyKind kind : {TinyKind::kBoxes, TinyKind::kConvex, TinyKind::kAny}) {
    for_random_trees(100000, 100, 6, kind, [&](const Tree& tree, TinyTrees&) {
      const SolidMesh mesh = framed(tree);
      ASSERT_EQ(broken(mesh), "") << size_of(mesh);
      triangles += mesh.triangles.size() - 24;
    });
  }
  EXPECT_GT(triangles, 10000u);
}

// Law L2, at the positions of the mesh.
TEST(BoundaryLaws, TrianglesMeetInVerticesAndEdgesOnly) {
  int touching = 0;
  for_random_trees(150000, 100, 5, TinyKind::kAny, [&](const Tree& part, TinyTrees&) {
    const Tree tree = part | tiny_frame();
    const auto made = boundary_mesh(tree, tree.root(), kTiny);
    ASSERT_TRUE(made.has_value());
    const auto found = BruteMeeting::find(made->mesh);
    ASSERT_FALSE(found) << found->first << " " << found->second;
    touching += made->report.vertices_split > 0;
  });
  EXPECT_GT(touching, 5);
}

TEST(BoundaryLaws, TheBruteCheckSeesTrianglesThatMeet) {
  const auto pair = [](const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                       const glm::dvec3& d, const glm::dvec3& e, const glm::dvec3& f) {
    SolidMesh mesh;
    mesh.positions = {a, b, c, d, e, f};
    mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
    return BruteMeeting::find(mesh).has_value();
  };
  const glm::dvec3 a(0, 0, 0), b(4, 0, 0), c(0, 4, 0);
  EXPECT_TRUE(pair(a, b, c, {1, 1, -1}, {1, 1, 1}, {5, 5, 1}));   // pierced
  EXPECT_TRUE(pair(a, b, c, {1, 1, 0}, {1, 1, 1}, {5, 5, 1}));    // touched within
  EXPECT_TRUE(pair(a, b, c, {2, 0, 0}, {1, -1, 1}, {3, -1, 1}));  // touched in an edge
  EXPECT_TRUE(pair(a, b, c, {1, 1, 0}, {5, 1, 0}, {1, 5, 0}));    // overlap in a plane
  EXPECT_TRUE(pair(a, b, c, a, {4, 1, 0}, {1, 4, 0}));            // the same, with a common corner
  EXPECT_TRUE(pair(a, b, c, a, b, {1, 1, 0}));                    // on the same side of an edge
  EXPECT_TRUE(pair(a, b, c, c, b, a));                            // the same place
  EXPECT_TRUE(pair(a, b, c, a, {2, 2, 1}, {2, 2, -1}));           // from a common corner through
  EXPECT_FALSE(pair(a, b, c, a, b, {1, -1, 0}));
  EXPECT_FALSE(pair(a, b, c, a, b, {1, 1, 1}));
  EXPECT_FALSE(pair(a, b, c, a, {-1, -1, 0}, {-1, 0, 1}));
  EXPECT_FALSE(pair(a, b, c, {5, 5, 0}, {6, 5, 0}, {5, 6, 0}));
  EXPECT_FALSE(pair(a, b, c, {5, 0, 0}, {6, 0, 0}, {5, -1, 3}));
}

TEST(BoundaryLaws, PointsAreInsideWhereTheTreeSaysSo) {
  int inside = 0, outside = 0;
  for_random_trees(200000, 200, 6, TinyKind::kAny, [&](const Tree& tree, TinyTrees& trees) {
    const SolidMesh mesh = framed(tree);
    const ExactWinding result(mesh.positions, mesh.triangles);
    ASSERT_TRUE(result.all_exact());
    const TreeOracle oracle(tree);
    for (int i = 0; i < 100; ++i) {
      glm::dvec3 point;
      for (int k = 0; k < 3; ++k) point[k] = trees.pick(-64, 8 * 1024 + 64) / 1024.0;
      const auto expected = oracle.at(point);
      const auto winding = result.at(point);
      if (!expected || !winding) continue;
      ASSERT_EQ(*winding, *expected ? 1 : 0) << point.x << " " << point.y << " " << point.z;
      ++(*expected ? inside : outside);
    }
  });
  EXPECT_GT(inside, 500);
  EXPECT_GT(outside, 5000);
}

// The winding number by doubles; nothing where they may be wrong.
std::optional<int> rounded_winding(std::span<const glm::dvec3> positions,
                                   std::span<const glm::uvec3> triangles, const glm::dvec3& point) {
  int winding = 0;
  for (const glm::uvec3& t : triangles) {
    const glm::dvec3 a = positions[t.x] - point, b = positions[t.y] - point,
                     c = positions[t.z] - point;
    const auto side = [](const glm::dvec3& p, const glm::dvec3& q) {
      return p.y * q.z - p.z * q.y;
    };
    const double sides[] = {side(a, b), side(b, c), side(c, a)};
    const double least = *std::min_element(sides, sides + 3);
    const double most = *std::max_element(sides, sides + 3);
    if (least < -1e-9 && most > 1e-9) continue;
    if (std::max({a.x, b.x, c.x}) < 0) continue;
    if (std::max({a.y, b.y, c.y}) < 0 || std::min({a.y, b.y, c.y}) > 0) continue;
    if (std::max({a.z, b.z, c.z}) < 0 || std::min({a.z, b.z, c.z}) > 0) continue;
    const double height = glm::dot(a, glm::cross(b, c));
    if (std::min(std::abs(least), std::abs(most)) < 1e-9 || std::abs(height) < 1e-9) return {};
    if ((height > 0) == (most > 0)) winding += most > 0 ? 1 : -1;
  }
  return winding;
}

TEST(BoundaryLaws, SolidsInGeneralPositionKeepThem) {
  int inside = 0;
  for (int i = 0; i < rounds(60); ++i) {
    SCOPED_TRACE("seed " + std::to_string(i));
    RandomTree trees(static_cast<std::uint64_t>(i));
    Tree tree, other;
    tree.set_root(trees.grow(tree, trees.pick(1, 9), i % 4 == 3));
    other.set_root(trees.grow(other, trees.pick(1, 4), i % 4 == 3));
    const SolidMesh mesh = mesh_of(tree, {});
    ASSERT_EQ(broken(mesh), "") << size_of(mesh);
    for (int k = 0; k < 50; ++k) {
      const glm::dvec3 point(trees.real(-9, 9), trees.real(-9, 9), trees.real(-9, 9));
      bool sure = true;
      const bool expected = evaluate(tree, tree.root(), [&](std::uint32_t s) {
        const TriangleSoup solid =
            transform(*tree.solids()[s].mesh, tree.solids()[s].world_from_mesh);
        const auto winding = rounded_winding(solid.positions, solid.triangles, point);
        sure = sure && winding;
        return winding.value_or(0) > 0;
      });
      const auto winding = rounded_winding(mesh.positions, mesh.triangles, point);
      if (!sure || !winding) continue;
      ASSERT_EQ(*winding, expected ? 1 : 0);
      inside += *winding;
    }
    const auto exact_volume = [&](const Tree& part) {
      const auto made = exact_measures(part, part.root());
      EXPECT_TRUE(made.has_value());
      return made ? made->volume : 0;
    };
    const double a = exact_volume(tree), b = exact_volume(other);
    // The lattices differ, as the boxes do: each moves surfaces by half a step.
    ASSERT_NEAR(a + b, exact_volume(tree | other) + exact_volume(tree & other), 1e-3);
    ASSERT_NEAR(a, exact_volume(tree - other) + exact_volume(tree & other), 1e-3);
  }
  EXPECT_GT(inside, 50);
}

// Law L9 through the mesh, for results whose vertices are lattice points.
TEST(BoundaryLaws, VoxelsOfTheMeshAreThoseOfTheTree) {
  for_random_trees(250000, 60, 5, TinyKind::kBoxes, [&](const Tree& part, TinyTrees& trees) {
    const Tree tree = part | tiny_frame();
    VoxelGrid grid;
    grid.origin = glm::dvec3(-5);
    const int dims = trees.pick(17, 60);
    grid.dims = glm::ivec3(dims);
    grid.voxel_size = glm::dvec3(18.0 / dims);
    SolidLists lists(tree, tree.root());
    ASSERT_TRUE(lists.fit(grid, nullptr).has_value());
    VoxelizeOptions options;
    options.filter = &lists.filter();
    const auto voxels = voxelize(lists.soup(), grid, options);
    const SolidMesh mesh = mesh_of(tree);
    TriangleSoup soup;
    soup.positions = mesh.positions;
    soup.triangles = mesh.triangles;
    const auto of_mesh = voxelize(soup, grid);
    ASSERT_TRUE(voxels.has_value() && of_mesh.has_value());
    ASSERT_TRUE(testkit::same_intervals(*voxels, *of_mesh));
  });
}

// Law L10, for results whose vertices are lattice points: along every ray the mesh has the tree's
// crossings, in the same planes.
using RayCrossings = std::vector<std::tuple<std::uint32_t, bool, int, double>>;

RayCrossings crossings_of(const Tree& tree, const VoxelGrid& grid, Axis axis) {
  const SolidLists lists(tree, tree.root());
  const auto mesh = snap_to_lattice(lists.soup(), grid);
  EXPECT_TRUE(mesh.has_value());
  const auto image = build_ldi(*mesh, raster_target(grid, axis), {}, {}, &lists.filter());
  EXPECT_TRUE(image.has_value());
  RayCrossings result;
  for (int v = 0; v < image->height; ++v) {
    for (int u = 0; u < image->width; ++u) {
      for (const DepthItem item : image->list(u, v)) {
        const glm::uvec3& t = lists.soup().triangles[item.triangle()];
        const glm::dvec3& p = lists.soup().positions[t.x];
        const glm::dvec3 normal =
            glm::abs(glm::cross(lists.soup().positions[t.y] - p, lists.soup().positions[t.z] - p));
        const int facing = normal.x > 0 ? 0 : normal.y > 0 ? 1 : 2;
        result.emplace_back(item.depth(), item.exit(), facing, p[facing]);
      }
      result.emplace_back(0, false, -1, 0.0);  // the next ray
    }
  }
  return result;
}

TEST(BoundaryLaws, AlongEveryRayTheMeshHasTheCrossingsOfTheTree) {
  std::size_t crossings = 0;
  for_random_trees(260000, 60, 5, TinyKind::kBoxes, [&](const Tree& part, TinyTrees&) {
    const Tree tree = part | tiny_frame();
    const VoxelGrid grid{glm::ivec3(36), glm::dvec3(-5), glm::dvec3(0.5)};
    const SolidMesh mesh = mesh_of(tree);
    TriangleSoup soup;
    soup.positions = mesh.positions;
    soup.triangles = mesh.triangles;
    const Tree of_mesh{soup};
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      const RayCrossings expected = crossings_of(tree, grid, axis);
      ASSERT_EQ(crossings_of(of_mesh, grid, axis), expected);
      crossings += expected.size() - 36 * 36;
    }
  });
  EXPECT_GT(crossings, 20000u);
}

// Law L13: from sheet to sheet around every edge the winding numbers of all solids add up to what
// the cells have on every other way, and cells of equal winding numbers have equal values.
TEST(BoundaryLaws, WindingNumbersAgreeAroundEveryEdge) {
  std::size_t groups = 0;
  for_random_trees(270000, 60, 4, TinyKind::kAny, [&](const Tree& tree, TinyTrees&) {
    auto solids = snap_solids(tree, tree.root(), Geometry(tree), 12);
    ASSERT_TRUE(solids.has_value());
    std::vector<InsideRule> rules;
    for (const Solid& solid : tree.solids()) rules.push_back(solid.rule);
    auto welded = weld_solids(*std::move(solids), {});
    ASSERT_TRUE(welded.has_value());
    merge_equal_triangles(*welded);
    if (welded->triangles.empty()) return;
    const MeshEdges edges = find_mesh_edges(welded->triangles, welded->vertices.size());
    const LiveZone all;
    const auto pairs = find_candidate_pairs(*welded, edges, tree.solids().size(), all);
    ASSERT_TRUE(pairs.has_value());
    PointTable table(BoundaryPoints(std::move(welded->vertices), std::move(welded->triangles)));
    const BoundaryPoints& points = table.points();
    const ArrangementInput input{points.vertices(), points.triangles(), *welded, edges, all};
    CutLines lines;
    ASSERT_TRUE(meet_pairs(input, *pairs, table, lines, {}).has_value());
    ASSERT_TRUE(cross_lines(input, table, lines, {}).has_value());
    const auto pieces = find_pieces(input, points, lines, sort_lines(input, points, lines), {});
    ASSERT_TRUE(pieces.has_value());
    const auto lists = find_radial_lists(input, lines, *pieces, {});
    ASSERT_TRUE(lists.has_value());
    const auto values = find_cell_values(input, points, lines, *pieces, *lists,
                                         compile(tree, tree.root()), rules, false, {});
    ASSERT_TRUE(values.has_value()) << values.error().message;
    // From cell to cell until nothing changes; the first cell of a component counts as outside.
    using Windings = std::vector<int>;
    std::vector<Windings> windings(lists->cell_count);
    std::vector<std::uint32_t> start(lists->cell_count);
    const auto behind = [&](const RadialLists::Group& group) {
      Windings result = windings[lists->cell_before(group)];
      for (const RadialLists::Sheet& sheet : lists->sheets_of(group)) {
        for (const auto& [solid, count] : welded->content(pieces->triangle_of[sheet.piece])) {
          result[solid] += sheet.left ? -count : count;
        }
      }
      return result;
    };
    std::map<std::pair<std::uint32_t, Windings>, bool> value_of;
    for (std::uint32_t first = 0; first < lists->cell_count; ++first) {
      if (!windings[first].empty()) continue;
      windings[first].assign(rules.size(), 0);
      start[first] = first;
      for (bool changed = true; std::exchange(changed, false);) {
        for (const RadialLists::Edge& edge : lists->edges) {  // once around, from any known cell
          for (std::uint32_t i = 0; i < 2 * edge.group_count; ++i) {
            const auto& group = lists->groups[edge.first_group + i % edge.group_count];
            const std::uint32_t to = lists->cell_behind(group);
            if (windings[lists->cell_before(group)].empty() || !windings[to].empty()) continue;
            windings[to] = behind(group);
            start[to] = first;
            changed = true;
          }
        }
      }
    }
    for (const RadialLists::Group& group : lists->groups) {
      ASSERT_EQ(behind(group), windings[lists->cell_behind(group)]);
      ++groups;
    }
    for (std::uint32_t cell = 0; cell < lists->cell_count; ++cell) {
      const auto [at, added] =
          value_of.try_emplace({start[cell], windings[cell]}, values->inside[cell]);
      ASSERT_EQ(at->second, values->inside[cell]);
    }
  });
  EXPECT_GT(groups, 20000u);
}

// Law L1 holds for parts and for the faces of the input too.
TEST(BoundaryLaws, PartsDivideTheSameSurface) {
  int parts = 0;
  for_random_trees(170000, 120, 4, TinyKind::kAny, [&](const Tree& part, TinyTrees& trees) {
    const Tree tree = part | tiny_frame();
    BoundaryOptions options = kTiny;
    options.parts = BoundaryParts::kSolids;
    options.faces = trees.pick(0, 1) == 0 ? BoundaryFaceKind::kCanonical : BoundaryFaceKind::kInput;
    const SolidMesh mesh = mesh_of(tree, options), whole = mesh_of(tree);
    ASSERT_EQ(broken(mesh), "") << size_of(mesh);
    ASSERT_EQ(mesh.part_of.size(), mesh.triangles.size());
    parts += static_cast<int>(mesh.parts.size()) - 2;
    const auto six_volumes = [](const SolidMesh& of) {
      double sum = 0;
      for (const glm::uvec3& t : of.triangles) {
        sum += glm::dot(of.positions[t.x], glm::cross(of.positions[t.y], of.positions[t.z]));
      }
      return sum;
    };
    ASSERT_NEAR(six_volumes(mesh), six_volumes(whole), 1e-5);
  });
  EXPECT_GT(parts, 100);
}

// Laws L3, L8.

TEST(BoundaryLaws, BytesDoNotDependOnAnyOrderOrThreads) {
  for_random_trees(300000, 100, 5, TinyKind::kAny, [&](const Tree& tree, TinyTrees& trees) {
    const SolidMesh mesh = framed(tree);
    const Tree other = Shuffler(tree | tiny_frame(), trees.random()).result;
    const SolidMesh shuffled = mesh_of(other, kTiny, {.threads = trees.pick(1, 8)});
    ASSERT_TRUE(same_bytes(mesh, shuffled)) << size_of(mesh) << "; " << size_of(shuffled);
  });
}

TEST(BoundaryLaws, BytesOfLargerMeshesDoNotDependOnThreads) {
  const Tree tree =
      Tree(make_icosphere(1, 5)) -
      transform(glm::translate(glm::dmat4(1), {0.5, 0.25, 0}), Tree(make_torus(1, 0.4, 90, 40)));
  const SolidMesh mesh = mesh_of(tree, {}, {.threads = 1});
  EXPECT_EQ(broken(mesh), "");
  EXPECT_GT(mesh.triangles.size(), 15000u);
  for (const int threads : {2, 3, 8}) {
    EXPECT_TRUE(same_bytes(mesh, mesh_of(tree, {}, {.threads = threads}))) << threads;
  }
}

TEST(BoundaryLaws, SolidsWithoutEffectChangeNothing) {
  for_random_trees(400000, 60, 4, TinyKind::kAny, [&](const Tree& tree, TinyTrees& trees) {
    const Tree beside(make_box({-2, -2, -2}, {-1, 9, 9}));
    const Tree other = trees.tree(2, TinyKind::kAny);
    const SolidMesh mesh = framed(tree);
    ASSERT_TRUE(same_bytes(mesh, framed(tree - beside)));
    ASSERT_TRUE(same_bytes(mesh, framed(tree | (beside & other))));
    ASSERT_TRUE(same_bytes(mesh, framed((tree & tree) | ((other & beside) - tree))));
  });
}

// Laws L4.

TEST(BoundaryLaws, EqualSetsHaveEqualBytes) {
  const SolidMesh nothing = mesh_of(tiny_frame());
  const Tree all(make_box(glm::dvec3(0), glm::dvec3(kTinySide)));
  ASSERT_EQ(nothing.triangles.size(), 24u);
  for (int i = 0; i < rounds(40); ++i) {
    TinyTrees trees(static_cast<std::uint64_t>(500000 + i));
    SCOPED_TRACE("seed " + std::to_string(500000 + i));
    const int depth = i % 3;
    const Tree a = trees.tree(depth, TinyKind::kAny), b = trees.tree(depth, TinyKind::kAny),
               c = trees.tree(depth, TinyKind::kAny), half(trees.box());
    const auto equal = [&](const Tree& one, const Tree& other, const char* law) {
      const SolidMesh mesh = framed(one), same = framed(other);
      EXPECT_TRUE(same_bytes(mesh, same)) << law << ": " << size_of(mesh) << "; " << size_of(same);
    };
    EXPECT_TRUE(same_bytes(framed(a - a), nothing));
    equal(a & a, a, "a & a = a");
    equal(a | a, a, "a | a = a");
    equal(a | b, b | a, "a | b = b | a");
    equal(a & b, b & a, "a & b = b & a");
    equal((a | b) | c, a | (b | c), "(a | b) | c = a | (b | c)");
    equal((a - b) - c, a - (b | c), "(a - b) - c = a - (b | c)");
    equal(all - (a | b), (all - a) & (all - b), "De Morgan");
    equal(all - (a & b), (all - a) | (all - b), "De Morgan");
    equal(a | (a & b), a, "absorption");
    equal(a & (a | b), a, "absorption");
    equal(a & (b | c), (a & b) | (a & c), "distribution");
    equal(a | (b & c), (a | b) & (a | c), "distribution");
    equal((a - b) | (a & b), a, "a cut in two");
    equal((a & half) | (a - half), a, "a cut by a box");
    equal((a | b) - (a & b), (a - b) | (b - a), "symmetric difference");
    equal(all - (all - a), a, "complement of the complement");
    if (HasFailure()) return;
  }
}

// A tip touches a triangle that nothing cuts.
TEST(BoundaryLaws, APointOfContactIsAVertexOfBothFaces) {
  TriangleSoup tip;
  tip.positions = {{3, 2, 8}, {2, 3, 4}, {1, 1, 8}, {4, 5, 8}};
  tip.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  TriangleSoup corner = tip;
  corner.positions = {{0, 0, 4}, {8, 0, 4}, {0, 8, 4}, {0, 0, 0}};
  for (TriangleSoup* const mesh : {&tip, &corner}) {
    if (signed_volume(*mesh) < 0) reverse_orientation(*mesh);
  }
  const Tree body(corner), with_tip = body | Tree(tip);
  const auto made = boundary_mesh(with_tip, with_tip.root(), kTiny);
  ASSERT_TRUE(made.has_value());
  EXPECT_EQ(broken(made->mesh), "");
  EXPECT_EQ(made->report.vertices_split, 1u);
  EXPECT_EQ(made->report.repaired, 0u);
  EXPECT_EQ(std::ranges::count(made->mesh.positions, glm::dvec3(2, 3, 4)), 2);
  EXPECT_TRUE(same_bytes(made->mesh, mesh_of((body & body) | Tree(tip))));
}

TEST(BoundaryLaws, ABoxIsItsEighthsHoweverTriangulated) {
  TinyTrees trees(1);
  for (int i = 0; i < rounds(40); ++i) {
    const TriangleSoup box = trees.box();
    const SolidMesh mesh = framed(Tree(box));
    ASSERT_EQ(mesh.triangles.size(), 36u);
    const Bounds bounds_of_box = bounds(box);
    Tree eighths;
    const glm::dvec3 at[] = {bounds_of_box.low, (bounds_of_box.low + bounds_of_box.high) / 2.0,
                             bounds_of_box.high};
    for (int k = 0; k < 8; ++k) {
      const int x = k % 2, y = k / 2 % 2, z = k / 4;
      eighths |=
          Tree(make_box({at[x].x, at[y].y, at[z].z}, {at[x + 1].x, at[y + 1].y, at[z + 1].z}));
    }
    ASSERT_TRUE(same_bytes(mesh, framed(eighths)));
    ASSERT_TRUE(same_bytes(mesh, framed(Tree(subdivide(box)))));
  }
  // A cube turned onto itself.
  const Tree cube(make_box(glm::dvec3(2), glm::dvec3(6)));
  glm::dmat4 turn(0);
  turn[0][1] = turn[1][2] = turn[2][0] = turn[3][3] = 1;
  EXPECT_TRUE(same_bytes(framed(cube), framed(cube | transform(turn, cube))));
}

// Laws L7.

std::vector<std::tuple<double, double, double>> sorted_positions(const SolidMesh& mesh,
                                                                 const glm::dmat4& place) {
  std::vector<std::tuple<double, double, double>> result;
  for (const glm::dvec3& p : mesh.positions) {
    const glm::dvec3 q(place * glm::dvec4(p, 1));
    result.emplace_back(q.x + 0.0, q.y + 0.0, q.z + 0.0);
  }
  std::sort(result.begin(), result.end());
  return result;
}

TEST(BoundaryLaws, MovedScaledTurnedAndMirroredTreesMoveAlong) {
  for_random_trees(700000, 50, 3, TinyKind::kAny, [&](const Tree& part, TinyTrees& trees) {
    const Tree tree = part | tiny_frame();
    const SolidMesh mesh = mesh_of(tree);
    const double volume = measures_of(tree).volume;
    // The frame's middle is 4.
    const glm::dmat4 middle = glm::translate(glm::dmat4(1), glm::dvec3(4));
    glm::dmat4 turn(0);
    std::array<int, 3> axes{0, 1, 2};
    std::shuffle(axes.begin(), axes.end(), trees.random());
    for (int k = 0; k < 3; ++k)
      turn[k][axes[static_cast<std::size_t>(k)]] = trees.pick(0, 1) == 0 ? 1 : -1;
    turn[3][3] = 1;
    turn = middle * turn * glm::inverse(middle);
    const glm::dmat4 move =
        glm::translate(glm::dmat4(1), glm::dvec3(trees.pick(-9, 9), 0.5, -1.25));
    const glm::dmat4 twice = glm::scale(glm::dmat4(1), glm::dvec3(2));
    for (const auto& place : {turn, move, twice}) {
      const Tree moved = transform(place, tree);
      const SolidMesh other = mesh_of(moved);
      ASSERT_EQ(sorted_positions(mesh, place), sorted_positions(other, glm::dmat4(1)));
      ASSERT_EQ(mesh.triangles.size(), other.triangles.size());
      ASSERT_EQ(measures_of(moved).volume, place == twice ? 8 * volume : volume);
      if (place != turn) {  // order and diagonals stay too
        ASSERT_EQ(mesh.triangles, other.triangles);
      }
    }
  });
}

// Laws L12, L15, L16.

Tree tree_of(const SolidMesh& mesh) {
  TriangleSoup soup;
  soup.positions = mesh.positions;
  soup.triangles = mesh.triangles;
  return Tree(std::move(soup));
}

TEST(BoundaryLaws, TheMeshOfAMeshIsItself) {
  for_random_trees(800000, 100, 5, TinyKind::kBoxes, [&](const Tree& tree, TinyTrees&) {
    const SolidMesh mesh = framed(tree);
    ASSERT_TRUE(same_bytes(mesh, mesh_of(tree_of(mesh))));
  });
  // A single mesh without cuts.
  const Tree ball(make_icosphere(1, 3));
  const SolidMesh mesh = mesh_of(ball, {});
  EXPECT_EQ(mesh.triangles.size(), 1280u);
  EXPECT_TRUE(same_bytes(mesh, mesh_of(tree_of(mesh), {})));
}

TEST(BoundaryLaws, CapsThatAreThereAlreadyChangeNothing) {
  int with_holes = 0;
  for_random_trees(900000, 100, 3, TinyKind::kAny, [&](const Tree& closed, TinyTrees& trees) {
    Tree open = closed | tiny_frame(), capped = open;
    const std::size_t frame = open.solids().size() - 2;
    for (std::size_t s = 0; s < frame; ++s) {
      TriangleSoup mesh = *open.solids()[s].mesh;
      for (int i = trees.pick(0, 3); i > 0 && !mesh.triangles.empty(); --i) {
        mesh.triangles.erase(mesh.triangles.begin() +
                             trees.pick(0, static_cast<int>(mesh.triangles.size()) - 1));
      }
      open.solids()[s].mesh = std::make_shared<const TriangleSoup>(std::move(mesh));
    }
    auto solids = snap_solids(open, open.root(), Geometry(open), kTiny.bits);
    ASSERT_TRUE(solids.has_value());
    const auto caps = close_solids(*solids, OpenSolids::kCap, open);
    ASSERT_TRUE(caps.has_value());
    with_holes += !caps->empty();
    for (std::size_t s = 0; s < frame; ++s) {
      TriangleSoup mesh;
      for (const auto& p : solids->vertices) {
        mesh.positions.push_back(solids->lattice.origin + solids->lattice.step * glm::dvec3(p));
      }
      mesh.triangles.assign(solids->triangles.begin() + solids->first_triangle[s],
                            solids->triangles.begin() + solids->first_triangle[s + 1]);
      capped.solids()[s].mesh = std::make_shared<const TriangleSoup>(std::move(mesh));
    }
    const SolidMesh mesh = mesh_of(open), other = mesh_of(capped);
    ASSERT_TRUE(same_bytes(mesh, other)) << size_of(mesh) << "; " << size_of(other);
    ASSERT_EQ(broken(mesh), "");
  });
  EXPECT_GT(with_holes, 30);
}

// Slivers thinner than floats are: a body that rounding turns inside out is no body.
TEST(BoundaryLaws, RoundingTurnsNoBodyInsideOut) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> real(-1, 1);
  Tree tree;
  for (int i = 0; i < 400; ++i) {
    TriangleSoup mesh;
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    const glm::dvec3 middle(700 + 3 * (i % 20), 500 + 3 * (i / 20), 300);
    for (int k = 0; k < 3; ++k) {
      mesh.positions.push_back(middle + glm::dvec3(real(random), real(random), real(random)));
    }
    const auto& p = mesh.positions;
    const glm::dvec3 normal = glm::normalize(glm::cross(p[1] - p[0], p[2] - p[0]));
    const double far = i % 2 == 0 ? 1.7 : 0.3;  // beyond an edge or over the triangle
    mesh.positions.push_back(p[0] + 0.4 * (p[1] - p[0]) + far * (p[2] - p[0]) + 1.5e-5 * normal);
    if (signed_volume(mesh) < 0) reverse_orientation(mesh);
    tree |= Tree(std::move(mesh));
  }
  const auto made = boundary_mesh(tree, tree.root(), {.float_positions = true});
  ASSERT_TRUE(made.has_value()) << made.error().message;
  const SolidMesh& mesh = made->mesh;
  ASSERT_EQ(broken(mesh), "");
  EXPECT_GT(made->report.repaired, 50u);
  EXPECT_GT(made->report.shells, 50u);
  // Positions are floats from 256 to 1024: multiples of 2^-15.
  std::map<std::uint32_t, exact::Int128> six_volumes;
  std::vector<std::uint32_t> shell(mesh.positions.size());
  std::iota(shell.begin(), shell.end(), 0u);
  const auto find = [&](std::uint32_t v) {
    while (shell[v] != v) v = shell[v];
    return v;
  };
  for (const glm::uvec3& t : mesh.triangles) {
    shell[find(t.x)] = find(t.y);
    shell[find(t.y)] = find(t.z);
  }
  for (const glm::uvec3& t : mesh.triangles) {
    exact::Int128 p[3][3];
    for (int k = 0; k < 3; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        const double whole = std::ldexp(mesh.positions[t[k]][axis], 15);
        ASSERT_EQ(whole, std::floor(whole));
        p[k][axis] = static_cast<std::int64_t>(whole);
      }
    }
    six_volumes[find(t.x)] += p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) +
                              p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
                              p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
  }
  EXPECT_EQ(six_volumes.size(), made->report.shells);
  for (const auto& [root, volume] : six_volumes) EXPECT_GT(volume, 0) << root;
}

TEST(BoundaryLaws, NothingGivesNothing) {
  const Tree a(make_box({0, 0, 0}, {1, 1, 1})), b(make_box({1, 0, 0}, {2, 1, 1}));
  for (const Tree& tree : {Tree(), a - a, a & b, (a | b) - (b | a)}) {
    EXPECT_TRUE(mesh_of(tree).triangles.empty());
    EXPECT_TRUE(measures_of(tree).empty);
    EXPECT_EQ(measures_of(tree).volume, 0);
  }
}

TEST(BoundaryLaws, StopsLimitsAndOptionsAreKept) {
  const Tree tree = Tree(make_icosphere(1, 4)) | Tree(make_torus(1, 0.3, 40, 20));
  std::stop_source stop;
  stop.request_stop();
  const auto stopped = boundary_mesh(tree, tree.root(), {}, {.stop = stop.get_token()});
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  const auto limited = boundary_mesh(tree, tree.root(), {}, {.memory_limit = 1000});
  ASSERT_FALSE(limited.has_value());
  EXPECT_EQ(limited.error().code, ErrorCode::kLimit);
  for (const int bits : {-1, 9, 29}) {
    const auto refused = boundary_mesh(tree, tree.root(), {.bits = bits});
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
  }
  TriangleSoup open = make_icosphere(1, 2);
  open.triangles.pop_back();
  const Tree with_hole = tree - Tree(open);
  const auto failed = exact_measures(with_hole, with_hole.root(), {.open = OpenSolids::kFail});
  ASSERT_FALSE(failed.has_value());
  EXPECT_EQ(failed.error().code, ErrorCode::kGeometry);
  EXPECT_TRUE(exact_measures(with_hole, with_hole.root()).has_value());
}

}  // namespace
}  // namespace strata::csg
