// Dead space may be left out: it changes no byte of a boundary mesh.

#include <gtest/gtest.h>

#include <glm/ext/matrix_transform.hpp>

#include "csg/boundary/boundary_arrangement.h"
#include "csg/boundary/open_edges.h"
#include "csg/boundary/triangulate_boundary.h"
#include "csg/lattice/live_zone.h"
#include "tests/csg/boundary/boundary_laws.h"

namespace strata::csg {
namespace {

struct Arranged {
  TriangulatedBoundary mesh;
  BoundaryReport report;
};

// With the finest zone, or with all space.
Arranged arranged(const Tree& tree, const BoundaryOptions& options, bool zone) {
  const Geometry geometry(tree);
  auto solids = snap_solids(tree, tree.root(), geometry, options.bits);
  EXPECT_TRUE(solids.has_value());
  EXPECT_TRUE(close_solids(*solids, OpenSolids::kCap, tree).has_value());
  const Lattice lattice = solids->lattice;
  std::vector<InsideRule> rules;
  for (const auto& part : geometry.parts()) rules.push_back(part.rule);
  Arranged result;
  const auto faces = arrange_solids(std::move(*solids), tree, tree.root(), rules, options,
                                    {.threads = 1}, result.report, zone ? ~std::uint64_t{0} : 0);
  EXPECT_TRUE(faces.has_value()) << faces.error().message;
  if (!faces) return result;
  auto mesh = triangulate_boundary(*faces, lattice, options.float_positions);
  EXPECT_TRUE(mesh.has_value()) << mesh.error().message;
  if (mesh) result.mesh = std::move(*mesh);
  return result;
}

bool same_bytes(const TriangulatedBoundary& a, const TriangulatedBoundary& b) {
  return a.positions == b.positions && a.triangles == b.triangles && a.labels == b.labels;
}

TEST(LiveZoneLaws, TheZoneChangesNothing) {
  std::uint64_t with = 0, without = 0;
  const auto check = [&](const Tree& tree, BoundaryOptions options, int kind) {
    options.parts = kind % 2 == 0 ? BoundaryParts::kOne : BoundaryParts::kSolids;
    options.faces = kind % 3 == 0 ? BoundaryFaceKind::kInput : BoundaryFaceKind::kCanonical;
    const Arranged zone = arranged(tree, options, true), all = arranged(tree, options, false);
    ASSERT_TRUE(same_bytes(zone.mesh, all.mesh))
        << zone.mesh.triangles.size() << " " << all.mesh.triangles.size();
    with += zone.report.pairs;
    without += all.report.pairs;
  };
  for (const TinyKind kind : {TinyKind::kBoxes, TinyKind::kConvex, TinyKind::kAny}) {
    for_random_trees(110000, 60, 5, kind, [&](const Tree& tree, TinyTrees& trees) {
      check(tree | tiny_frame(), kTiny, trees.pick(0, 5));
      check(tree, {.bits = trees.pick(10, 20)}, trees.pick(0, 5));
    });
  }
  EXPECT_LT(static_cast<double>(with), 0.9 * static_cast<double>(without));
  for (int i = 0; i < rounds(60); ++i) {
    SCOPED_TRACE("seed " + std::to_string(i));
    RandomTree trees(static_cast<std::uint64_t>(i));
    Tree tree;
    tree.set_root(trees.grow(tree, trees.pick(1, 30), i % 4 == 3));
    check(tree, {.bits = trees.pick(12, 26)}, i);
    if (HasFailure()) return;
  }
}

// The zone holds all faces of the result.
TEST(LiveZoneLaws, FacesLieInTheZone) {
  int edges = 0, dead = 0;
  for_random_trees(120000, 60, 4, TinyKind::kAny, [&](const Tree& tree, TinyTrees& trees) {
    const Geometry geometry(tree);
    const auto solids = snap_solids(tree, tree.root(), geometry, 12);
    ASSERT_TRUE(solids.has_value());
    std::vector<InsideRule> rules;
    for (const auto& part : geometry.parts()) rules.push_back(part.rule);
    const LiveZone zone =
        LiveZone::find(*solids, tree, tree.root(), rules, ~std::uint64_t{0}, {.threads = 1});
    const SolidMesh mesh = mesh_of(tree, {.bits = 12});
    const auto file_point = [&](const glm::dvec3& p) {
      return exact::FilePoint(
          glm::round((p - solids->lattice.origin) / solids->lattice.step * 0x1p24));
    };
    for (const glm::uvec3& t : mesh.triangles) {
      const exact::FilePoint a = file_point(mesh.positions[t.x]),
                             b = file_point(mesh.positions[t.y]);
      ASSERT_TRUE(zone.contains(a, b));
      ASSERT_TRUE(zone.touches(box_around(a, b)));
      ++edges;
    }
    for (int i = 0; i < 20 && !zone.everywhere(); ++i) {
      const exact::FilePoint p = file_point(trees.point() + 0.375);
      dead += !zone.contains(p, p);
    }
  });
  EXPECT_GT(edges, 2000);
  EXPECT_GT(dead, 100);
}

// Holes that reach out of a plate, many balls that overlap, a small box in a large torus.
TEST(LiveZoneLaws, TheZoneSavesWork) {
  Tree plate(make_box({0, 0, 0}, {8, 8, 1})), balls(make_icosphere(4, 2)),
      corner(make_box({3.8, 0, 0}, {4.5, 0.5, 0.5}));
  for (int i = 0; i < 16; ++i) {
    plate -= transform(
        glm::translate(glm::dmat4(1), {i % 4 * 2 + 1, i / 4 * 2 + 1, -20}),
        Tree(make_cylinder(0.5, 40, 16)) | transform(glm::translate(glm::dmat4(1), {0, 0, 39.5}),
                                                     Tree(make_torus(0.5, 0.2, 30, 20))));
    const glm::dvec3 shift(0.2 * (i % 4), 0.5 * (i % 5), 0.7 * (i % 3));
    balls &= transform(glm::translate(glm::dmat4(1), shift), Tree(make_icosphere(4, 2)));
    if (i % 4 != 0) continue;
    corner -=
        transform(glm::translate(glm::dmat4(1), 0.01 * shift), Tree(make_torus(3, 1, 60, 20)));
  }
  const auto saves = [](const Tree& tree, double most, const char* what) {
    const Arranged zone = arranged(tree, {}, true), all = arranged(tree, {}, false);
    EXPECT_TRUE(same_bytes(zone.mesh, all.mesh)) << what;
    EXPECT_FALSE(zone.mesh.triangles.empty()) << what;
    EXPECT_LT(static_cast<double>(zone.report.pairs), most * static_cast<double>(all.report.pairs))
        << what << ": " << zone.report.pairs << " of " << all.report.pairs;
  };
  saves(plate, 0.6, "plate");
  saves(balls, 0.6, "balls");
  saves(corner, 0.1, "corner");
}

}  // namespace
}  // namespace strata::csg
