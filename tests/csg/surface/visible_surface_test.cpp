#include <gtest/gtest.h>

#include "strata/csg/picture/picture.h"
#include "tests/csg/random_tree.h"
#include "tests/csg/surface/full_lists.h"
#include "tests/csg/surface/surface_checks.h"

namespace strata::csg {
namespace {

// The law: a picture culls, a measurement does not, and both see the same.
TEST(VisibleSurface, IsTheOneOfTheFullListsForAnyTree) {
  for (int seed = 0; seed < 250; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed));
    Tree tree;
    tree.set_root(random.grow(tree, random.pick(1, seed % 8 == 0 ? 60 : 12), seed % 3 == 0));
    Preview preview(tree, {}, 0.0);
    const Camera camera = random_camera(random, preview.box());
    expect_same(tree, camera, {random.pick(1, 150), random.pick(1, 150)},
                "seed " + std::to_string(seed));
    if (HasFailure()) return;
  }
}

// Where the tree is an intersection of solids, or of unions of them, minus others, what lies before
// or behind the surface is left out area by area (csg/surface/narrow_program.cpp), and solids that
// a ray meets once are searched by their intervals (csg/surface/tile_surface_simd.cpp).
TEST(VisibleSurface, OfAnIntersectionMinusOthersIsTheOneOfTheFullLists) {
  std::size_t seen = 0;
  for (int seed = 0; seed < 240; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 1300);
    Tree tree;
    const bool on_grid = seed % 3 == 0;
    std::vector<Tree::NodeId> common, operands;
    for (int i = random.pick(1, 4); i > 0; --i) {
      const glm::dvec3 low(random.pick(-6, -3), random.pick(-6, -3), random.pick(-6, -3));
      const glm::dvec3 high(random.pick(3, 6), random.pick(3, 6), random.pick(3, 6));
      Solid solid{std::make_shared<TriangleSoup>(i % 2 == 1 ? make_box(low, high)
                                                            : make_icosphere(high.x + 1, 3))};
      if (!on_grid) {
        solid.world_from_mesh = glm::rotate(glm::dmat4(1), random.real(0, 1), glm::dvec3(1, 2, 3));
      }
      common.push_back(tree.add_solid(std::move(solid)));
      if (seed < 120) continue;
      std::vector<Tree::NodeId> united{common.back()};
      for (int k = random.pick(1, 9); k > 0; --k) {
        united.push_back(tree.add_solid(random.solid(on_grid)));
      }
      common.back() = tree.add(Operation::kUnion, united);
    }
    operands.push_back(tree.add(Operation::kIntersection, common));
    for (int i = random.pick(0, 20); i > 0; --i) {
      operands.push_back(tree.add_solid(random.solid(on_grid)));
    }
    tree.set_root(tree.add(Operation::kDifference, operands));
    Preview preview(tree, {}, 0.0);
    const Camera camera = random_camera(random, preview.box());
    seen += expect_same(tree, camera, {120, 100}, "seed " + std::to_string(seed));
    if (HasFailure()) return;
  }
  EXPECT_GT(seen, 240000u);
}

// Faces of several solids that coincide come in another order from pixel to pixel. Rows of pixels
// that meet the same ones are decided together (csg/surface/clusters.h).
TEST(VisibleSurface, OfSolidsThatShareFacesIsTheOneOfTheFullLists) {
  std::size_t covered = 0, resolved = 0;
  for (int seed = 0; seed <= 300; ++seed) {
    // In the last a solid comes close to the surface that only cuts another, which is elsewhere.
    RandomTree random(seed < 300 ? static_cast<std::uint64_t>(seed) + 7700 : 101262);
    Tree tree;
    // Boxes and prisms that begin and end at few places, turned together.
    const glm::dmat4 turned =
        glm::rotate(glm::dmat4(1), random.real(0, 6), glm::dvec3(1, random.real(-1, 1), 2));
    const auto add = [&](int least) {
      const auto place = [&] { return random.pick(0, 1) * 2.0 - 3.0; };
      const auto length = [&] { return random.pick(least, least + 1) * 2.0; };
      const glm::dvec3 low(place(), place(), place());
      const glm::dvec3 size(length(), length(), length());
      const bool box = random.pick(0, 3) > 0;
      Solid solid{std::make_shared<TriangleSoup>(
          box ? make_box(low, low + size) : make_cylinder(1.5, size.z, random.pick(3, 12)))};
      solid.world_from_mesh =
          box ? turned : glm::translate(turned, low + glm::dvec3(1, 1, size.z / 2));
      return tree.add_solid(std::move(solid));
    };
    std::vector<Tree::NodeId> united;
    for (int k = random.pick(1, 2); k > 0; --k) {
      std::vector<Tree::NodeId> common, operands;
      for (int i = random.pick(1, 3); i > 0; --i) common.push_back(add(2));
      operands.push_back(tree.add(Operation::kIntersection, common));
      for (int i = random.pick(0, 3); i > 0; --i) {
        operands.push_back(add(1));
        if (random.pick(0, 2) == 0) {
          operands.back() = tree.add(Operation::kDifference, std::vector{operands.back(), add(1)});
        }
      }
      united.push_back(tree.add(Operation::kDifference, operands));
    }
    tree.set_root(tree.add(Operation::kUnion, united));
    Preview preview(tree, {}, 0.0);
    if (preview.box().empty()) continue;
    const Camera camera = random_camera(random, preview.box());
    expect_same(tree, camera, {130, 110}, "seed " + std::to_string(seed));
    if (HasFailure()) return;
    const auto image = preview.draw(make_view(camera, {130, 110}, preview.box()).value());
    ASSERT_TRUE(image.has_value());
    covered += preview.report().covered;
    resolved += preview.report().resolved;
  }
  EXPECT_GT(covered, 250000u);
  EXPECT_LT(resolved, covered / 10);
}

// A wall seen along its plane is as deep in a pixel as the wall is long, so it may coincide with
// what lies far before or behind its crossing.
TEST(VisibleSurface, WithWallsAlongTheViewIsTheOneOfTheFullLists) {
  for (int seed = 0; seed < 200; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 9000);
    Tree tree;
    const auto box = [&](const glm::dvec3& low, const glm::dvec3& high) {
      return tree.add_solid({std::make_shared<TriangleSoup>(make_box(low, high))});
    };
    const double gap = random.real(0.03, 1.0);
    std::vector<Tree::NodeId> operands{box({-20, -20, -25}, {20, 20, 10})};
    if (seed % 2 == 0) {
      const Tree::NodeId other = box({-21, -21, -20}, {21, 21, 10 - gap});
      operands = {tree.add(Operation::kIntersection, {operands.front(), other})};
    } else {
      operands.push_back(box({-22, -22, 0}, {22, 22, 12}));
    }
    for (int i = 0; i < 4; ++i) {
      const glm::dvec3 at(random.real(-15, 10), random.real(-15, 10), -30);
      operands.push_back(box(at, at + glm::dvec3(random.real(3, 8), random.real(3, 8), 60)));
    }
    if (seed % 2 != 0) operands.push_back(box({-23, -23, -gap}, {23, 23, 13}));
    tree.set_root(tree.add(Operation::kDifference, operands));
    Camera camera;
    camera.projection = seed % 3 == 0 ? Projection::kPerspective : Projection::kOrthographic;
    const Preview preview(tree, {}, 0.0);
    centre_camera(camera, preview.box());
    fit_camera(camera, preview.box());
    const double tilt = random.pick(0, 1) == 0 ? 0.0 : random.real(0, 0.05);
    const double turn = random.pick(0, 1) == 0 ? 0.0 : random.real(0, 90);
    camera.rotation = {tilt, random.pick(0, 1) == 0 ? 0.0 : tilt, turn};
    camera.target += glm::dvec3(random.real(-1, 1), random.real(-1, 1), 0);
    expect_same(tree, camera, {200, 200}, "seed " + std::to_string(seed));
    if (HasFailure()) return;
  }
}

// Solids that are wider than a tile: what cannot matter in all of it is left out of its areas, such
// as cutters that end where others begin.
TEST(VisibleSurface, OfSolidsBoredByWideCuttersIsTheOneOfTheFullLists) {
  std::size_t seen = 0;
  for (int seed = 0; seed < 40; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 40000);
    Tree tree;
    std::vector<Tree::NodeId> operands;
    const auto add = [&](TriangleSoup mesh, const glm::dmat4& place) {
      return tree.add_solid({std::make_shared<TriangleSoup>(std::move(mesh)), place});
    };
    const auto somewhere = [&](double off) {
      const glm::dvec3 axis(random.real(-1, 1), random.real(-1, 1), random.real(0.1, 1));
      const glm::dvec3 to(random.real(-off, off), random.real(-off, off), random.real(-off, off));
      return glm::rotate(glm::translate(glm::dmat4(1), to), random.real(0, 3), axis);
    };
    std::vector<Tree::NodeId> united{add(make_icosphere(10, 2), somewhere(1))};
    for (int i = seed % 2 * random.pick(1, 9); i > 0; --i) {
      united.push_back(add(make_icosphere(random.real(2, 6), 2), somewhere(9)));
    }
    operands.push_back(tree.add(Operation::kUnion, united));
    for (int i = random.pick(8, 14); i > 0; --i) {
      const double wide = random.real(1, 5);
      operands.push_back(add(random.pick(0, 1) == 0
                                 ? make_icosphere(wide, 2)
                                 : make_box({-wide, -wide, -15}, {wide, wide, 15}),
                             somewhere(3)));
    }
    tree.set_root(tree.add(Operation::kDifference, operands));
    const Camera camera = random_camera(random, {glm::dvec3(-3), glm::dvec3(3)});
    seen += expect_same(tree, camera, {400, 320}, "seed " + std::to_string(seed));
    if (HasFailure()) return;
  }
  EXPECT_GT(seen, 2000000u);
}

// Solids that are united or cut are left out where others are known to be in front. Seen along
// their walls, little is known of them.
TEST(VisibleSurface, OfUnitedSolidsSeenAlongTheirWallsIsTheOneOfTheFullLists) {
  std::size_t seen = 0;
  for (int seed = 0; seed < 200; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 9500);
    Tree tree;
    std::vector<Tree::NodeId> operands;
    const double layer = random.real(0.01, 1.0);
    for (int i = random.pick(3, 24); i > 0; --i) {
      // Tops and floors of a few heights: many lie in a plane, others a hair apart.
      const glm::dvec3 low(random.real(-20, 15), random.real(-20, 15), -layer * random.pick(0, 6));
      const glm::dvec3 size(random.real(0.5, 25), random.real(0.5, 25), layer * random.pick(1, 9));
      TriangleSoup mesh = make_box(low, low + size);
      if (random.pick(0, 2) == 0) {
        mesh = make_cylinder(size.x / 2, size.z, random.pick(3, 30));
        for (glm::dvec3& p : mesh.positions) p += low;
      }
      const Tree::NodeId solid = tree.add_solid({std::make_shared<TriangleSoup>(std::move(mesh))});
      operands.push_back(solid);
    }
    const Operation operation = seed % 4 == 3 ? Operation::kDifference : Operation::kUnion;
    Tree::NodeId root = tree.add(operation, operands);
    if (seed % 5 == 4) {
      const auto cutter = std::make_shared<TriangleSoup>(
          make_box({-30, -30, -layer * random.pick(0, 2)}, {random.real(-5, 30), 30, 30}));
      root = tree.add(Operation::kDifference, {root, tree.add_solid({cutter})});
    }
    tree.set_root(root);
    Camera camera;
    camera.projection = seed % 3 == 0 ? Projection::kPerspective : Projection::kOrthographic;
    Preview preview(tree, {}, 0.0);
    centre_camera(camera, preview.box());
    fit_camera(camera, preview.box());
    const double tilt = random.pick(0, 1) == 0 ? 0.0 : random.real(0, 0.05);
    const double turn = random.pick(0, 1) == 0 ? 0.0 : random.real(0, 90);
    camera.rotation = {seed % 2 == 0 ? tilt : 90 - tilt, 0, turn};
    seen += expect_same(tree, camera, {200, 200}, "seed " + std::to_string(seed));
    if (HasFailure()) return;
  }
  EXPECT_GT(seen, 1000000u);
}

TriangleSoup copies(const TriangleSoup& mesh, int count) {
  TriangleSoup all = mesh;
  for (int i = 1; i < count; ++i) {
    all.triangles.insert(all.triangles.end(), mesh.triangles.begin(), mesh.triangles.end());
  }
  return all;
}

// Each face of a convex solid lies there many times.
TEST(VisibleSurface, OfRepeatedFacesIsTheOneOfTheFullLists) {
  const TriangleSoup box = make_box({-20, -20, -20}, {20, 20, 10});
  for (const int count : {2, 3, 190, 200, 300}) {
    for (const InsideRule rule :
         {InsideRule::kWinding, InsideRule::kNonzero, InsideRule::kParity}) {
      for (const Operation operation : {Operation::kDifference, Operation::kIntersection}) {
        Tree tree;
        Solid solid{std::make_shared<TriangleSoup>(copies(box, count))};
        solid.rule = rule;
        const auto low = glm::dvec3(operation == Operation::kDifference ? 0 : -5);
        const Tree::NodeId other =
            tree.add_solid({std::make_shared<TriangleSoup>(make_box(low, {5, 5, 15}))});
        tree.set_root(tree.add(operation, {tree.add_solid(solid), other}));
        RandomTree random(static_cast<std::uint64_t>(count));
        Preview preview(tree, {}, 0.0);
        expect_same(
            tree, random_camera(random, preview.box()), {90, 70},
            std::to_string(count) + " copies, rule " + std::to_string(static_cast<int>(rule)));
      }
    }
  }
}

TEST(VisibleSurface, IsTheOneOfTheFullListsWithTheEyeInTheScene) {
  for (int seed = 0; seed < 200; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 500);
    Tree tree;
    if (seed < 60) {
      tree.set_root(random.grow(tree, random.pick(1, 12), seed % 3 == 0));
    } else {  // cutters around the eye, and across the near limit
      const glm::dvec3 half(random.real(2, 9), random.real(2, 9), random.real(2, 9));
      const auto whole = std::make_shared<TriangleSoup>(make_box(-half, half));
      std::vector<Tree::NodeId> operands{tree.add_solid({whole})};
      for (int i = random.pick(1, 20); i > 0; --i) {
        operands.push_back(tree.add_solid(random.solid(seed % 3 == 0)));
      }
      tree.set_root(tree.add(Operation::kDifference, operands));
    }
    expect_same(tree, random_camera_inside(random), {90, 70}, "seed " + std::to_string(seed));
    if (HasFailure()) return;
  }
}

TEST(VisibleSurface, OfSolidsAroundTheEyeIsTheirFarSides) {
  for (int seed = 0; seed < 40; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 700);
    Tree tree;
    const glm::dvec3 half(random.real(3, 6), random.real(3, 6), random.real(3, 6));
    Tree::NodeId root = tree.add_solid({std::make_shared<TriangleSoup>(make_box(-half, half))});
    if (seed % 2 == 1) {  // a room
      const glm::dvec3 inner = half * random.real(0.5, 0.9);
      root = tree.add(
          Operation::kDifference,
          {root, tree.add_solid({std::make_shared<TriangleSoup>(make_box(-inner, inner))})});
    }
    tree.set_root(root);
    Camera camera = look_at({random.real(-1, 1), random.real(-1, 1), random.real(-1, 1)},
                            {random.real(-6, 6), random.real(-6, 6), random.real(-6, 6)});
    camera.field_of_view = 60;
    const std::string what = "seed " + std::to_string(seed);
    expect_same(tree, camera, {90, 70}, what);
    Preview preview(tree, {}, 0.0);
    const auto image = preview.draw(make_view(camera, {90, 70}, preview.box()).value());
    ASSERT_TRUE(image.has_value());
    const auto& depths = (*image)->depth;
    EXPECT_EQ(std::count(depths.begin(), depths.end(), SurfaceImage::kNone), 0) << what;
  }
}

TEST(VisibleSurface, ACutterIsAsLargeAsItLikes) {
  // Half of a cube, seen from where only it would be in the way.
  for (const double size : {1e2, 1e4, 1e6, 1e9}) {
    for (const Projection projection : {Projection::kPerspective, Projection::kOrthographic}) {
      Tree tree;
      const auto box = [&](const glm::dvec3& low, const glm::dvec3& high) {
        return tree.add_solid({std::make_shared<TriangleSoup>(make_box(low, high))});
      };
      tree.set_root(tree.add(
          Operation::kDifference,
          {box(glm::dvec3(-1), glm::dvec3(1)), box({-size, -size, 0}, {size, size, 2 * size})}));
      Camera camera;
      camera.projection = projection;
      camera.rotation = {55, 0, 25};
      fit_camera(camera, Bounds{glm::dvec3(-1), glm::dvec3(1)});
      Preview preview(tree, {}, 5e-6);
      const auto view = make_view(camera, {101, 101}, preview.box());
      ASSERT_TRUE(view.has_value());
      const auto image = preview.draw(*view);
      ASSERT_TRUE(image.has_value()) << size << ": " << image.error().message;
      // The middle is the cut face, below it is a side of the cube.
      EXPECT_EQ((*image)->solid[50 * 101 + 50], 1u) << size;
      EXPECT_NEAR(view->distance((*image)->depth[50 * 101 + 50] + 0.5), camera.distance, 1e-2);
      EXPECT_EQ((*image)->solid[82 * 101 + 50], 0u) << size;
    }
  }
}

TEST(VisibleSurface, AMovedSolidGivesTheSameAsAFreshPicture) {
  std::size_t covered = 0;
  for (int seed = 0; seed < 40; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 900);
    Tree tree;
    tree.set_root(random.grow(tree, random.pick(2, 20), false));
    Preview preview(tree, {}, 0.0);
    const auto view = make_view(random_camera(random, preview.box()), {200, 180}, preview.box());
    ASSERT_TRUE(view.has_value());
    ASSERT_TRUE(preview.draw(*view).has_value());
    const auto solid =
        static_cast<std::uint32_t>(random.pick(0, static_cast<int>(tree.solids().size()) - 1));
    const glm::dmat4 moved =
        glm::translate(glm::dmat4(1), glm::dvec3(random.real(-1, 1), random.real(-1, 1), 0)) *
        tree.solids()[solid].world_from_mesh;
    const auto after = preview.move_solid(solid, moved);
    ASSERT_TRUE(after.has_value());
    Tree other = tree;
    other.solids()[solid].world_from_mesh = moved;
    Preview fresh(other, {}, 0.0);
    const auto expected = fresh.draw(*view);
    ASSERT_TRUE(expected.has_value());
    covered += expect_same_surface(**after, **expected, "seed " + std::to_string(seed));
  }
  EXPECT_GT(covered, 50'000u);
}

TEST(VisibleSurface, OpenSolidsShowTheirSheets) {
  // Half of a box: the far wall is seen through the missing front.
  TriangleSoup mesh = make_box(glm::dvec3(-1), glm::dvec3(1));
  mesh.triangles.resize(6);
  Tree tree;
  tree.set_root(tree.add_solid({std::make_shared<TriangleSoup>(mesh)}));
  for (int i = 0; i < 20; ++i) {
    RandomTree random(static_cast<std::uint64_t>(i));
    Camera camera = random_camera(random, bounds(tree, tree.root()));
    expect_same(tree, camera, {64, 64}, "view " + std::to_string(i));
  }
}

// Law 5: faces that coincide leave nothing that is not there, at any camera angle.

Tree::NodeId box_node(Tree& tree, const glm::dvec3& low, const glm::dvec3& high) {
  return tree.add_solid({std::make_shared<TriangleSoup>(make_box(low, high))});
}

/// Counts pixels whose surface lies where `is_wrong` says nothing is, from 100 cameras, and those
/// of some that do not show what rays meet, so that nothing is missing.
std::size_t wrong_pixels(const Tree& tree, const std::function<bool(const glm::dvec3&)>& is_wrong,
                         std::size_t& covered) {
  Preview preview(tree, {}, 0.0);
  std::size_t wrong = 0;
  for (int i = 0; i < 100; ++i) {
    RandomTree random(static_cast<std::uint64_t>(i) + 77);
    const Camera camera = random_camera(random, preview.box());
    const auto view = make_view(camera, {160, 160}, preview.box());
    const auto image = preview.draw(*view);
    EXPECT_TRUE(image.has_value());
    const RayOracle oracle(tree, *view);
    for (int v = 0; v < 160; ++v) {
      for (int u = 0; u < 160; ++u) {
        const std::uint32_t depth = (*image)->depth[static_cast<std::size_t>(v * 160 + u)];
        if (i % 5 == 0 && u % 16 == 7 && v % 16 == 7 && !oracle.agrees(u, v, depth)) ++wrong;
        if (depth == SurfaceImage::kNone) continue;
        ++covered;
        wrong += is_wrong(position(*view, u + 0.5, v + 0.5, depth)) ? 1 : 0;
      }
    }
  }
  return wrong;
}

/// Whether p is farther than a margin from the surface of [low, high].
bool off_box(const glm::dvec3& p, const glm::dvec3& low, const glm::dvec3& high) {
  constexpr double kMargin = 0.05;
  const glm::dvec3 out = glm::max(low - p, p - high);
  return std::abs(std::max({out.x, out.y, out.z})) > kMargin;
}

TEST(CoincidentFaces, ACubeMinusACubeThatSharesFacesShowsOnlyWhatIsLeft) {
  // The second cube takes the first's half x > 5, and shares 3, then 4, then 5 of its faces.
  struct Case {
    glm::dvec3 low, high;
  };
  const Case cases[] = {{{5, 0, 0}, {10, 10, 10}},
                        {{5, 0, 0}, {12, 10, 10}},
                        {{5, -1, 0}, {10, 10, 10}},
                        {{5, -1, -2}, {10, 11, 10}}};
  for (const Case& c : cases) {
    Tree tree;
    const auto a = box_node(tree, {0, 0, 0}, {10, 10, 10});
    const auto b = box_node(tree, c.low, c.high);
    tree.set_root(tree.add(Operation::kDifference, {a, b}));
    std::size_t covered = 0;
    const std::size_t wrong = wrong_pixels(
        tree,
        [](const glm::dvec3& p) {
          return off_box(p, {0, 0, 0}, {5, 10, 10});
        },
        covered);
    EXPECT_EQ(wrong, 0u) << "of " << covered;
    EXPECT_GT(covered, 100'000u);
  }
}

TEST(CoincidentFaces, ACubeMinusItselfIsEmpty) {
  Tree tree;
  const auto a = box_node(tree, {0, 0, 0}, {10, 10, 10});
  const auto b = box_node(tree, {0, 0, 0}, {10, 10, 10});
  tree.set_root(tree.add(Operation::kDifference, {a, b}));
  std::size_t covered = 0;
  wrong_pixels(
      tree, [](const glm::dvec3&) { return true; }, covered);
  EXPECT_EQ(covered, 0u);
}

TEST(CoincidentFaces, APlateMinusACylinderOfEqualHeightHasAHole) {
  Tree tree;
  const auto plate = box_node(tree, {-10, -10, 0}, {10, 10, 4});
  const auto drill = tree.add_solid({std::make_shared<TriangleSoup>(make_cylinder(6, 4, 48))});
  tree.set_root(tree.add(Operation::kDifference, {plate, drill}));
  std::size_t covered = 0;
  const std::size_t wrong = wrong_pixels(
      tree, [](const glm::dvec3& p) { return std::hypot(p.x, p.y) < 5.9; }, covered);
  EXPECT_EQ(wrong, 0u) << "of " << covered;
  EXPECT_GT(covered, 100000u);
}

TEST(CoincidentFaces, StackedCubesShowNoSeamAndNothingBetween) {
  Tree tree;
  std::vector<Tree::NodeId> cubes;
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 low((i & 1) * 5, (i >> 1 & 1) * 5, (i >> 2) * 5);
    cubes.push_back(box_node(tree, low, low + glm::dvec3(5)));
  }
  tree.set_root(tree.add(Operation::kUnion, cubes));
  std::size_t covered = 0;
  const std::size_t wrong = wrong_pixels(
      tree, [](const glm::dvec3& p) { return off_box(p, glm::dvec3(0), glm::dvec3(10)); }, covered);
  EXPECT_EQ(wrong, 0u) << "of " << covered;
  EXPECT_GT(covered, 100000u);
}

TEST(CoincidentFaces, TouchingIntersectionIsEmpty) {
  Tree tree;
  const auto a = box_node(tree, {0, 0, 0}, {5, 10, 10});
  const auto b = box_node(tree, {5, 0, 0}, {10, 10, 10});
  tree.set_root(tree.add(Operation::kIntersection, {a, b}));
  std::size_t covered = 0;
  wrong_pixels(
      tree, [](const glm::dvec3&) { return true; }, covered);
  EXPECT_EQ(covered, 0u);
}

TEST(CoincidentFaces, TheSameFaceTwiceIsShownInOneColour) {
  // Two solids with a common face: everywhere the first of the tree is shown.
  Tree tree;
  const auto a = box_node(tree, {0, 0, 0}, {10, 10, 10});
  const auto b = box_node(tree, {0, 0, 0}, {10, 10, 5});
  tree.set_root(tree.add(Operation::kUnion, {a, b}));
  Preview preview(tree, {}, 0.0);
  std::size_t all = 0;
  for (int i = 0; i < 50; ++i) {
    RandomTree random(static_cast<std::uint64_t>(i) + 7);
    const auto view = make_view(random_camera(random, preview.box()), {120, 120}, preview.box());
    const auto image = preview.draw(*view);
    const auto shows = [&](int u, int v) {
      const bool within = u >= 0 && v >= 0 && u < 120 && v < 120;
      const auto at = static_cast<std::size_t>(v * 120 + u);
      return !within || (*image)->depth[at] == SurfaceImage::kNone
                 ? -1
                 : static_cast<int>((*image)->solid[at]);
    };
    for (int v = 0; v < 120; ++v) {
      for (int u = 0; u < 120; ++u) {
        all += shows(u, v) >= 0 ? 1 : 0;
        if (shows(u, v) != 1) continue;
        // The side walls of the second have upper corners of their own, which are snapped: at the
        // outline of the picture they may cover a pixel that the first does not.
        bool at_outline = false;
        for (int i9 = 0; i9 < 9; ++i9) at_outline |= shows(u + i9 % 3 - 1, v + i9 / 3 - 1) < 0;
        EXPECT_TRUE(at_outline) << "camera " << i << ", pixel " << u << ", " << v;
      }
    }
  }
  EXPECT_GT(all, 100'000u);
}

// The first solid only cuts another, or is only there within another, which is elsewhere in the
// same area of pixels. So it shows nowhere, though its faces are those of what shows.
TEST(CoincidentFaces, ASolidWithoutEffectDoesNotShow) {
  for (const bool eye_inside : {false, true}) {
    Tree tree;
    const auto idle = box_node(tree, glm::dvec3(-10), glm::dvec3(10));
    const auto a = box_node(tree, glm::dvec3(-10), glm::dvec3(10));
    const auto b = box_node(tree, glm::dvec3(-10), glm::dvec3(10));
    const auto other = box_node(tree, {4, 4, 4}, {8, 8, 8});
    const auto part =
        tree.add(eye_inside ? Operation::kIntersection : Operation::kDifference, {other, idle});
    tree.set_root(
        eye_inside ? tree.add(Operation::kUnion, {part, a, b})
                   : tree.add(Operation::kUnion, {tree.add(Operation::kDifference, {a, part}), b}));
    Preview preview(tree, {}, 0.0);
    std::size_t seen = 0, wrong = 0;
    for (int i = 0; i < 20; ++i) {
      RandomTree random(static_cast<std::uint64_t>(i) + 277);
      const Camera camera = eye_inside
                                ? random_camera_inside(random)
                                : random_camera(random, Bounds{glm::dvec3(-10), glm::dvec3(10)});
      const auto view = preview.view(camera, {100, 100});
      ASSERT_TRUE(view.has_value());
      const auto image = preview.draw(*view);
      ASSERT_TRUE(image.has_value());
      for (std::size_t at = 0; at < (*image)->depth.size(); ++at) {
        if ((*image)->depth[at] == SurfaceImage::kNone) continue;
        ++seen;
        wrong += (*image)->solid[at] == 0 ? 1 : 0;
      }
    }
    EXPECT_EQ(wrong, 0u) << "of " << seen;
    EXPECT_GT(seen, 30'000u);
  }
}

// All solids lie in the first one, along whose walls some end. Others begin a little behind these
// walls: too far to be one face with them, but close enough to be settled with them.
TEST(CoincidentFaces, WhatBeginsBehindASurfaceDoesNotChangeWhichSolidShows) {
  Tree tree;
  std::vector<Tree::NodeId> united{box_node(tree, {0, 0, 0}, {10, 10, 10}),
                                   box_node(tree, {1, 1, 1}, {10, 9, 9})};
  for (int i = 1; i < 8; ++i) united.push_back(box_node(tree, {1, 1, 1}, {10, 9, 1 + 0.97 * i}));
  tree.set_root(tree.add(Operation::kUnion, united));
  Preview preview(tree, {}, 0.0);
  std::size_t seen = 0, wrong = 0;
  for (int i = 0; i < 100; ++i) {
    RandomTree random(static_cast<std::uint64_t>(i) + 6464);
    const auto view = make_view(random_camera(random, preview.box()), {400, 400}, preview.box());
    const auto image = preview.draw(*view);
    ASSERT_TRUE(image.has_value());
    for (std::size_t at = 0; at < (*image)->depth.size(); ++at) {
      if ((*image)->depth[at] == SurfaceImage::kNone) continue;
      ++seen;
      wrong += (*image)->solid[at] != 0 ? 1 : 0;
    }
  }
  EXPECT_EQ(wrong, 0u) << "of " << seen;
  EXPECT_GT(seen, 1'000'000u);
}

TEST(CoincidentFaces, ACutFaceShowsNothingOfTheFacesThatEndInIt) {
  // Solids that overlap, all cut at y = 0: inside the cut face every pixel is the cutter's, also
  // where hidden faces meet it.
  Tree tree;
  const auto plate = box_node(tree, {-10, -8, 0}, {10, 8, 3});
  const auto rib = box_node(tree, {-8, -2, 1}, {8, 1, 9});
  const auto ball = tree.add_solid({std::make_shared<TriangleSoup>(make_icosphere(4, 3)),
                                    glm::translate(glm::dmat4(1), glm::dvec3(0.5, 0.3, 4))});
  const auto cutter = box_node(tree, {-30, -30, -30}, {30, 0, 30});
  const auto all = tree.add(Operation::kUnion, {plate, rib, ball});
  tree.set_root(tree.add(Operation::kDifference, {all, cutter}));
  Preview preview(tree, {}, 0.0);
  std::size_t inside = 0, wrong = 0;
  for (int i = 0; i < 100; ++i) {
    RandomTree random(static_cast<std::uint64_t>(i) + 177);
    const Camera camera = random_camera(random, Bounds{{-10, -8, 0}, {10, 8, 9}});
    const auto view = make_view(camera, {200, 200}, preview.box());
    const auto image = preview.draw(*view);
    ASSERT_TRUE(image.has_value());
    for (int v = 0; v < 200; ++v) {
      for (int u = 0; u < 200; ++u) {
        const auto at = static_cast<std::size_t>(v * 200 + u);
        const std::uint32_t depth = (*image)->depth[at];
        if (depth == SurfaceImage::kNone) continue;
        const glm::dvec3 p = position(*view, u + 0.5, v + 0.5, depth);
        // Faces that end in the cut face may be seen right at its outline.
        const auto within = [&](double x0, double x1, double z0, double z1) {
          return p.x > x0 + 0.2 && p.x < x1 - 0.2 && p.z > z0 + 0.2 && p.z < z1 - 0.2;
        };
        if (std::abs(p.y) > 0.02 || !(within(-10, 10, 0, 3) || within(-8, 8, 1, 9))) continue;
        ++inside;
        wrong += (*image)->solid[at] != 3 ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(wrong, 0u) << "of " << inside;
  EXPECT_GT(inside, 100'000u);
}

TEST(NestedDifferences, TwentyAndTwoHundredDeepAreRight) {
  for (const int deep : {20, 200}) {
    // Boxes one in another, each taken from the next larger one: shells.
    Tree tree;
    Tree::NodeId node = Tree::kNone;
    for (int i = 0; i < deep; ++i) {
      const double half = i + 1;
      const auto box =
          box_node(tree, {-half, -half, -half}, {half, half, i == deep - 1 ? 0.3 : half});
      node = node == Tree::kNone ? box : tree.add(Operation::kDifference, {box, node});
    }
    tree.set_root(node);
    RandomTree random(3);
    Camera camera;
    centre_camera(camera, bounds(tree, tree.root()));
    camera.rotation = {10, 0, 20};
    fit_camera(camera, bounds(tree, tree.root()));
    expect_same(tree, camera, {128, 128}, std::to_string(deep) + " deep");
  }
}

// What is shown lies on the result's surface, by formulas that know no triangles: negative inside.

double torus_formula(const glm::dvec3& p, double major, double minor) {
  return std::hypot(std::hypot(p.x, p.y) - major, p.z) - minor;
}

TEST(ConcaveSolids, ShowNothingThatIsNotThere) {
  // A pipe bent to a ring, cut open, with a bar through it that the ring takes its share of.
  Tree tree;
  const auto ring = [&](double minor) {
    return tree.add_solid({std::make_shared<TriangleSoup>(make_torus(10, minor, 160, 80))});
  };
  const auto outer = ring(4), inner = ring(3), cutter = box_node(tree, {-20, 2, -20}, {20, 20, 20});
  const auto bar = box_node(tree, {-16, -1, -1}, {16, 1, 1}), taken = ring(3.5);
  const auto pipe = tree.add(Operation::kDifference, {outer, inner, cutter});
  tree.set_root(
      tree.add(Operation::kUnion, {pipe, tree.add(Operation::kDifference, {bar, taken})}));
  std::size_t covered = 0;
  const std::size_t wrong = wrong_pixels(
      tree,
      [](const glm::dvec3& p) {
        const double pipe_at =
            std::max({torus_formula(p, 10, 4), -torus_formula(p, 10, 3), p.y - 2});
        const double bar_at = std::max(
            {std::abs(p.x) - 16, std::abs(p.y) - 1, std::abs(p.z) - 1, -torus_formula(p, 10, 3.5)});
        return std::abs(std::min(pipe_at, bar_at)) > 0.05;
      },
      covered);
  EXPECT_EQ(wrong, 0u) << "of " << covered;
  EXPECT_GT(covered, 100'000u);
}

/// A pyramid without its tip: from z = 0 to its top at z = 1.
TriangleSoup make_frustum(double bottom, double top) {
  TriangleSoup mesh = make_box({-1, -1, 0}, {1, 1, 1});
  for (glm::dvec3& p : mesh.positions) {
    const double half = p.z > 0.5 ? top : bottom;
    p.x *= half, p.y *= half;
  }
  return mesh;
}

/// Small frusta whose tops lie in the top of a large one: their slopes begin there and are hidden.
void expect_only_tops(bool taken_away) {
  std::size_t tops = 0, slopes = 0;
  for (int seed = 0; seed < 60; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed));
    Tree tree;
    std::vector<Tree::NodeId> frusta;
    for (int i = 0; i < 9; ++i) {
      Solid solid;
      const double size = random.real(0.5, 2);
      const bool is_large = i == 8;
      solid.mesh = std::make_shared<TriangleSoup>(
          is_large ? make_frustum(9, 8) : make_frustum(size * random.real(1.1, 2), size));
      // Cutters are upside down, and what were tops are the floor of a pit.
      if (taken_away) solid.world_from_mesh[2].z = -1;
      if (!is_large) {
        solid.world_from_mesh[3] = {random.real(-4, 4), random.real(-4, 4), 0, 1};
        solid.world_from_mesh =
            glm::rotate(solid.world_from_mesh, random.real(0, 6.3), glm::dvec3(0, 0, 1));
      }
      frusta.push_back(tree.add_solid(std::move(solid)));
    }
    Tree::NodeId root = tree.add(Operation::kUnion, frusta);
    if (taken_away) {
      root =
          tree.add(Operation::kDifference, {box_node(tree, {-12, -12, -3}, {12, 12, -0.5}), root});
    }
    tree.set_root(root);
    Preview preview(tree, {}, seed % 2 ? 5e-6 : 0.0);
    Camera camera = random_camera(random, preview.box());
    camera.rotation.x = random.real(0, taken_away ? 40 : 85);
    camera.rotation.y = 0;
    const auto view = make_view(camera, {300, 300}, preview.box());
    const auto image = preview.draw(*view);
    ASSERT_TRUE(image.has_value());
    for (std::size_t i = 0; i < (*image)->depth.size(); ++i) {
      if ((*image)->depth[i] == SurfaceImage::kNone || (*image)->solid[i] >= 8) continue;
      const Solid& solid = tree.solids()[(*image)->solid[i]];
      const glm::uvec3& t = solid.mesh->triangles[(*image)->triangle[i] & ~SurfaceImage::kExit];
      const bool is_top = solid.mesh->positions[t.x].z == 1 && solid.mesh->positions[t.y].z == 1 &&
                          solid.mesh->positions[t.z].z == 1;
      (is_top ? tops : slopes) += 1;
    }
  }
  EXPECT_EQ(slopes, 0u) << "beside " << tops;
  EXPECT_GT(tops, 10'000u);
}

TEST(CoincidentFaces, SlopesThatEndInATopDoNotShowThere) { expect_only_tops(false); }

TEST(CoincidentFaces, SlopesThatEndInAFloorDoNotShowThere) { expect_only_tops(true); }

TEST(NestedDifferences, ShowNothingThatIsNotThere) {
  // Balls one in another, each taken from the next larger one, all cut open.
  constexpr int kDeep = 20;
  Tree tree;
  Tree::NodeId node = Tree::kNone;
  for (int i = 1; i <= kDeep; ++i) {
    const auto ball = tree.add_solid({std::make_shared<TriangleSoup>(make_icosphere(i, 4))});
    node = i == 1 ? ball : tree.add(Operation::kDifference, {ball, node});
  }
  const auto cutter = box_node(tree, {-30, -30, 0}, {30, 30, 30});
  tree.set_root(tree.add(Operation::kDifference, {node, cutter}));
  std::size_t covered = 0;
  const std::size_t wrong = wrong_pixels(
      tree,
      [](const glm::dvec3& p) {
        double at = 1e9;
        for (int i = 1; i <= kDeep; ++i) at = std::max(glm::length(p) - i, -at);
        return std::abs(std::max(at, p.z)) > 0.05;
      },
      covered);
  EXPECT_EQ(wrong, 0u) << "of " << covered;
  EXPECT_GT(covered, 100'000u);
}

TEST(VisibleSurface, AThousandLayersInOnePixelAreRight) {
  Tree tree;
  std::vector<Tree::NodeId> plates{box_node(tree, {-10, -10, 0}, {10, 10, 1001})};
  for (int i = 0; i < 500; ++i) {
    plates.push_back(box_node(tree, {-9, -9, 2.0 * i - 0.5}, {9, 9, 2.0 * i + 0.5}));
  }
  tree.set_root(tree.add(Operation::kDifference, plates));
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = {0, 0, 0};
  centre_camera(camera, bounds(tree, tree.root()));
  fit_camera(camera, bounds(tree, tree.root()));
  camera.distance /= 40;
  camera.rotation = {1.5, 0, 30};
  expect_same(tree, camera, {64, 64}, "from above");
}

}  // namespace
}  // namespace strata::csg
