// Light on pictures: normals of curved surfaces, corners that see little, caps, lights.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include "csg/picture/corner_normals.h"
#include "strata/csg/input/scene_input.h"
#include "strata/csg/picture/picture.h"
#include "strata/mesh/shapes.h"
#include "tests/csg/random_tree.h"

namespace strata::csg {
namespace {

using NodeId = Tree::NodeId;

Solid solid_of(TriangleSoup mesh, std::optional<glm::vec4> colour = {}) {
  Solid solid;
  solid.mesh = std::make_shared<const TriangleSoup>(std::move(mesh));
  solid.colour = colour;
  return solid;
}

CornerNormals normals_of(const TriangleSoup& mesh, double crease, int threads = 0) {
  Execution execution;
  execution.threads = threads;
  return {mesh.positions, mesh.triangles, crease, execution};
}

/// The largest angle, as its sine, between corners' normals and those of a sphere at the origin.
double worst_of_sphere(const TriangleSoup& mesh) {
  const CornerNormals normals = normals_of(mesh, 60);
  double worst = 0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    EXPECT_FALSE(normals.flat(t));
    for (int c = 0; c < 3; ++c) {
      const glm::dvec3 radial = glm::normalize(mesh.positions[mesh.triangles[t][c]]);
      worst = std::max(worst, glm::length(glm::cross(radial, normals.at(t, c))));
      EXPECT_GT(glm::dot(radial, normals.at(t, c)), 0.9);
    }
  }
  return worst;
}

TEST(CornerNormals, OfASphereConvergeToItsRadii) {
  double before = 1;
  for (int level = 2; level <= 5; ++level) {
    const double worst = worst_of_sphere(make_icosphere(10.0, level));
    EXPECT_LT(worst, 0.6 * before) << level;
    before = worst;
  }
  EXPECT_LT(before, 2e-3);
}

TEST(CornerNormals, OfABoxAreThoseOfItsFaces) {
  const TriangleSoup box = make_box({0, 0, 0}, {1, 2, 3});
  const CornerNormals sharp = normals_of(box, 89);
  for (std::uint32_t t = 0; t < box.triangles.size(); ++t) EXPECT_TRUE(sharp.flat(t));
  const CornerNormals round = normals_of(box, 91);
  for (std::uint32_t t = 0; t < box.triangles.size(); ++t) EXPECT_FALSE(round.flat(t));
}

TEST(CornerNormals, OfACylinderAreSharpAtTheRimAndRoundAlongTheSide) {
  const TriangleSoup cylinder = make_cylinder(2.0, 5.0, 24);  // 15 degrees a side
  for (const double crease : {14.0, 30.0}) {
    const CornerNormals normals = normals_of(cylinder, crease);
    std::size_t sides = 0;
    for (std::uint32_t t = 0; t < cylinder.triangles.size(); ++t) {
      const glm::uvec3& corners = cylinder.triangles[t];
      const glm::dvec3& a = cylinder.positions[corners.x];
      const glm::dvec3 face = glm::normalize(
          glm::cross(cylinder.positions[corners.y] - a, cylinder.positions[corners.z] - a));
      if (std::abs(face.z) > 0.5 || crease < 15) {
        EXPECT_TRUE(normals.flat(t));
        continue;
      }
      ++sides;
      ASSERT_FALSE(normals.flat(t));
      for (int c = 0; c < 3; ++c) {
        const glm::dvec3& p = cylinder.positions[corners[c]];
        EXPECT_GT(glm::dot(glm::normalize(glm::dvec3(p.x, p.y, 0)), normals.at(t, c)), 1 - 1e-6);
      }
    }
    EXPECT_EQ(sides, crease < 15 ? 0u : 48u);
  }
}

TEST(CornerNormals, AnEdgeOfExactlyTheCreaseIsSharpAllAround) {
  const TriangleSoup cylinder = make_cylinder(3.7, 1.3, 12);
  const CornerNormals normals = normals_of(cylinder, 30);
  for (std::uint32_t t = 0; t < cylinder.triangles.size(); ++t) EXPECT_TRUE(normals.flat(t)) << t;
}

TEST(CornerNormals, DoNotDependOnSharedVerticesOrderOrThreads) {
  const TriangleSoup shared = make_icosphere(1.0, 3);
  TriangleSoup loose;  // each triangle has its own vertices, in a random order
  std::vector<std::uint32_t> order(shared.triangles.size());
  std::iota(order.begin(), order.end(), 0u);
  std::shuffle(order.begin(), order.end(), std::mt19937(7));
  for (const std::uint32_t t : order) {
    const auto first = static_cast<std::uint32_t>(loose.positions.size());
    for (int c = 0; c < 3; ++c) loose.positions.push_back(shared.positions[shared.triangles[t][c]]);
    loose.triangles.emplace_back(first, first + 1, first + 2);
  }
  const CornerNormals one = normals_of(shared, 40, 1), many = normals_of(loose, 40, 3);
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_LT(glm::distance(one.at(order[i], c), many.at(i, c)), 2e-4);
    }
  }
  const CornerNormals again = normals_of(loose, 40, 1);
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    for (int c = 0; c < 3; ++c) EXPECT_EQ(again.at(i, c), many.at(i, c));
  }
}

TEST(CornerNormals, OfDegenerateTrianglesAndHugeFansAreMade) {
  TriangleSoup fan;
  fan.positions = {{0, 0, 1}};
  const std::uint32_t count = 20000;
  for (std::uint32_t i = 0; i < count; ++i) {
    const double angle = 2 * 3.141592653589793 * i / count;
    fan.positions.emplace_back(std::cos(angle), std::sin(angle), 0);
    fan.triangles.emplace_back(0, 1 + i, 1 + (i + 1) % count);
  }
  fan.triangles.insert(fan.triangles.end(), 20000, glm::uvec3(0, 1, 1));
  fan.triangles.insert(fan.triangles.end(), 20000, glm::uvec3(0, 1, 2));
  const CornerNormals normals = normals_of(fan, 30);
  EXPECT_FALSE(normals.flat(5000));
  EXPECT_TRUE(normals.flat(count + 1));
}

TEST(CornerNormals, ArePackedWithinATenthOfADegree) {
  std::mt19937 random(3);
  std::normal_distribution<double> any;
  for (int i = 0; i < 10000; ++i) {
    const glm::dvec3 unit = glm::normalize(glm::dvec3(any(random), any(random), any(random)));
    EXPECT_LT(glm::distance(unit, CornerNormals::unpack(CornerNormals::pack(unit))), 1e-4);
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      glm::dvec3 unit(0.0);
      unit[axis] = sign;
      EXPECT_EQ(CornerNormals::unpack(CornerNormals::pack(unit)), unit);
    }
  }
}

// --- pictures -----------------------------------------------------------------------------------

Picture draw(Preview& preview, const Camera& camera, const glm::ivec2& size,
             const PictureOptions& options, int threads = 0) {
  Execution execution;
  execution.threads = threads;
  auto picture = preview.picture(camera, size, options, execution);
  EXPECT_TRUE(picture.has_value()) << picture.error().message;
  return picture ? *std::move(picture) : Picture{};
}

Camera fitted(const Preview& preview) {
  Camera camera;
  centre_camera(camera, preview.box());
  fit_camera(camera, preview.box());
  return camera;
}

/// A plate with holes, a sphere on it and a coloured cylinder.
Tree some_part() {
  Tree tree;
  const NodeId plate = tree.add_solid(solid_of(make_box({-20, -20, 0}, {20, 20, 6})));
  TriangleSoup hole = make_cylinder(4.0, 20.0, 40);
  for (glm::dvec3& p : hole.positions) p += glm::dvec3(8, 8, -5);
  const NodeId drilled =
      tree.add(Operation::kDifference, {plate, tree.add_solid(solid_of(std::move(hole)))});
  TriangleSoup ball = make_icosphere(7.0, 3);
  for (glm::dvec3& p : ball.positions) p += glm::dvec3(-8, -4, 9);
  const NodeId sphere = tree.add_solid(solid_of(std::move(ball), glm::vec4(0.8, 0.1, 0.1, 1)));
  tree.set_root(tree.add(Operation::kUnion, {drilled, sphere}));
  return tree;
}

TEST(Shading, IsTheSameForAnyNumberOfThreads) {
  Picture first;
  for (const int threads : {1, 2, 3}) {
    Preview preview(some_part());
    PictureOptions options;
    options.samples = 4;
    const Picture picture = draw(preview, fitted(preview), {301, 283}, options, threads);
    if (threads == 1) first = picture;
    EXPECT_EQ(picture.pixels, first.pixels) << threads;
  }
  EXPECT_GT(first.pixels.size(), 0u);
}

TEST(Shading, IsTheSameWhateverWasDrawnBefore) {
  PictureOptions options;
  options.samples = 2;
  Preview used(some_part());
  const Camera camera = fitted(used);
  Camera near = camera;
  near.distance *= 0.3;
  PictureOptions facets = options;
  facets.crease = 0;
  draw(used, near, {100, 80}, options);
  const Picture flat = draw(used, camera, {200, 200}, facets);
  const Picture again = draw(used, camera, {200, 200}, options);
  Preview fresh(some_part());
  EXPECT_EQ(again.pixels, draw(fresh, camera, {200, 200}, options).pixels);
  EXPECT_NE(again.pixels, flat.pixels);
}

TEST(Shading, AfterAMoveIsThatOfAFreshPicture) {
  const glm::dmat4 place =
      glm::rotate(glm::translate(glm::dmat4(1), glm::dvec3(3, 2, 1)), 0.7, glm::dvec3(0.6, 0, 0.8));
  PictureOptions options;
  Preview moved(some_part());
  const Camera camera = fitted(moved);
  const Picture before = draw(moved, camera, {200, 200}, options);
  ASSERT_TRUE(moved.move_solid(2, place));
  const Picture after = draw(moved, camera, {200, 200}, options);
  EXPECT_NE(before.pixels, after.pixels);
  Tree tree = some_part();
  tree.solids()[2].world_from_mesh = place;
  Preview fresh(std::move(tree));
  EXPECT_EQ(after.pixels, draw(fresh, camera, {200, 200}, options).pixels);
}

// A picture is shaded while its tiles are found, and areas of one face are not even found pixel by
// pixel. With a ghost, all samples are found first; this one is empty.
TEST(Shading, TileByTileIsThatOfAllSamplesAtOnce) {
  constexpr int kSamples[] = {1, 2, 4, 8, 16, 64};
  std::size_t seen = 0;
  for (int seed = 0; seed < 90; ++seed) {
    RandomTree random(static_cast<std::uint64_t>(seed) + 700);
    Tree tree = seed == 0 ? some_part() : Tree{};
    if (seed != 0) tree.set_root(random.grow(tree, random.pick(1, 12), seed % 3 == 0));
    const NodeId low = tree.add_solid(solid_of(make_box({-1, -1, -1}, {0, 0, 0})));
    const NodeId high = tree.add_solid(solid_of(make_box({1, 1, 1}, {2, 2, 2})));
    const NodeId nothing = tree.add(Operation::kIntersection, {low, high});
    Preview tiles(tree), samples(tree, {{nothing, kBackgroundGhost}});
    Camera camera = fitted(tiles);
    camera.distance *= random.real(0.2, 1.0);  // large faces
    PictureOptions options;
    options.samples = kSamples[seed % std::size(kSamples)];
    if (seed % 2 == 0) options.scheme = find_colour_scheme("Cornfield");
    options.crease = seed % 4 < 2 ? 30 : 0;
    const int side = options.samples == 64 ? 40 : 160;
    const glm::ivec2 size(random.pick(side / 2, side), random.pick(side / 2, side));
    const Picture found = draw(tiles, camera, size, options);
    EXPECT_EQ(found.pixels, draw(samples, camera, size, options).pixels)
        << "seed " << seed << ", " << options.samples << " samples";
    seen += tiles.report().covered;
  }
  EXPECT_GT(seen, 200000u);
}

TEST(Shading, WithEdgesDiffersOnEdgesOnly) {
  // Edges are drawn on all samples at once, other pictures tile by tile.
  Preview preview(some_part());
  const Camera camera = fitted(preview);
  PictureOptions options;
  options.samples = 4;
  const Picture plain = draw(preview, camera, {200, 200}, options);
  options.edges = true;
  const Picture edges = draw(preview, camera, {200, 200}, options);
  std::size_t same = 0, darker = 0;
  for (std::size_t i = 0; i < plain.pixels.size(); ++i) {
    same += plain.pixels[i] == edges.pixels[i] ? 1 : 0;
    darker += edges.pixels[i].g < plain.pixels[i].g ? 1 : 0;
  }
  EXPECT_GT(darker, 500u);
  EXPECT_EQ(same + darker, plain.pixels.size());
}

TEST(Shading, ACurvedSurfaceHasNoStepsAndFacetsHave) {
  const auto largest_step = [](double crease) {
    Tree tree;
    tree.set_root(tree.add_solid(solid_of(make_icosphere(10.0, 3))));
    Preview preview(std::move(tree));
    PictureOptions options;
    options.crease = crease;
    options.occlusion = false;
    Camera camera = fitted(preview);
    camera.projection = Projection::kOrthographic;
    const Picture picture = draw(preview, camera, {300, 300}, options);
    int largest = 0;
    for (int v = 100; v < 200; ++v) {
      for (int u = 100; u < 200; ++u) {
        const auto at = static_cast<std::size_t>(v * 300 + u);
        largest = std::max(largest, std::abs(picture.pixels[at].g - picture.pixels[at + 1].g));
      }
    }
    return largest;
  };
  EXPECT_LE(largest_step(30), 2);
  EXPECT_GE(largest_step(0), 5);
}

TEST(Shading, NoFaceIsNearlyBlackUnderStudioLights) {
  Tree tree;
  tree.set_root(tree.add_solid(solid_of(make_icosphere(10.0, 4))));
  Preview preview(std::move(tree));
  const ColourScheme& scheme = default_scheme();
  for (const glm::dvec3& turn : {glm::dvec3(55, 0, 25), {0, 0, 0}, {180, 0, 0}, {90, 0, 0}}) {
    Camera camera = fitted(preview);
    camera.rotation = turn;
    PictureOptions options;
    const Picture picture = draw(preview, camera, {120, 120}, options);
    std::size_t seen = 0;
    for (const Rgba& pixel : picture.pixels) {
      if (pixel == Rgba(scheme.background, 255)) continue;
      ++seen;
      EXPECT_GE(pixel.g, scheme.face.g * 2 / 5);
    }
    EXPECT_GT(seen, 3000u);
  }
}

/// Hue in degrees, of a colour that is not grey.
double hue(const Rgba& c) {
  const double high = std::max({c.r, c.g, c.b}), low = std::min({c.r, c.g, c.b});
  if (!(high > low)) return 0;
  double sixth = (c.r - c.g) / (high - low) + 4;
  if (high == c.r)
    sixth = std::fmod((c.g - c.b) / (high - low) + 6, 6);
  else if (high == c.g)
    sixth = (c.b - c.r) / (high - low) + 2;
  return 60 * sixth;
}

TEST(Shading, AColourKeepsItsHueAndMostOfItsBrightness) {
  for (const glm::vec4& colour : {glm::vec4(0.9f, 0.2f, 0.1f, 1.0f),
                                  {0.1f, 0.5f, 0.9f, 1.0f},
                                  {0.2f, 0.7f, 0.3f, 1.0f},
                                  {0.95f, 0.8f, 0.1f, 1.0f}}) {
    Tree tree;
    tree.set_root(tree.add_solid(solid_of(make_icosphere(10.0, 4), colour)));
    Preview preview(std::move(tree));
    const Picture picture = draw(preview, fitted(preview), {120, 120}, PictureOptions{});
    const Rgba wanted(colour * 255.0f);
    std::size_t seen = 0;
    double brightest = 0;
    for (const Rgba& pixel : picture.pixels) {
      if (pixel == Rgba(default_scheme().background, 255)) continue;
      ++seen;
      const double off = std::abs(hue(pixel) - hue(wanted));
      EXPECT_LT(std::min(off, 360 - off), 12);
      brightest =
          std::max(brightest, std::max({pixel.r, pixel.g, pixel.b}) /
                                  static_cast<double>(std::max({wanted.r, wanted.g, wanted.b})));
    }
    EXPECT_GT(seen, 3000u);
    EXPECT_GT(brightest, 0.9);
  }
}

TEST(Shading, AnOpenPlateIsNotDarkenedAtAll) {
  for (const Projection projection : {Projection::kPerspective, Projection::kOrthographic}) {
    Tree tree;
    tree.set_root(tree.add_solid(solid_of(make_box({-30, -30, -1}, {30, 30, 0}))));
    Preview preview(std::move(tree));
    for (const double tilt : {0.0, 40.0, 75.0}) {
      Camera camera = fitted(preview);
      camera.projection = projection;
      camera.rotation.x = tilt;
      PictureOptions options;
      options.occlusion = true;
      const Picture soft = draw(preview, camera, {500, 400}, options);
      options.occlusion = false;
      EXPECT_EQ(soft.pixels, draw(preview, camera, {500, 400}, options).pixels) << tilt;
    }
  }
}

TEST(Shading, TheBottomOfAHoleIsDarkerThanThePlateAroundIt) {
  Tree tree;
  const NodeId plate = tree.add_solid(solid_of(make_box({-20, -20, -8}, {20, 20, 0})));
  const NodeId hole = tree.add_solid(solid_of(make_box({-4, -4, -4}, {4, 4, 1})));
  tree.set_root(tree.add(Operation::kDifference, {plate, hole}));
  for (Solid& solid : tree.solids()) solid.colour = glm::vec4(0.7, 0.7, 0.7, 1);
  Preview preview(std::move(tree));
  Camera camera = fitted(preview);
  camera.rotation = {0, 0, 0};
  PictureOptions options;
  const Picture soft = draw(preview, camera, {400, 400}, options);
  options.occlusion = false;
  const Picture plain = draw(preview, camera, {400, 400}, options);
  const std::size_t bottom = 200 * 400 + 200, top = 200 * 400 + 290;
  EXPECT_EQ(plain.pixels[bottom], plain.pixels[top]);
  EXPECT_EQ(soft.pixels[top], plain.pixels[top]);
  EXPECT_LT(soft.pixels[bottom].g, plain.pixels[bottom].g * 0.97);
  EXPECT_GT(soft.pixels[bottom].g, plain.pixels[bottom].g * 0.3);
}

TEST(Shading, AGroundShadowIsDarkBeneathAndFadesAndHidesNothing) {
  Tree tree;
  const NodeId low = tree.add_solid(solid_of(make_box({-10, -10, 0}, {10, 10, 6})));
  const NodeId far = tree.add_solid(solid_of(make_box({-400, 0, 0}, {-390, 10, 10})));
  tree.set_root(tree.add(Operation::kDifference, {low, far}));  // a cutter far away
  Preview preview(std::move(tree));
  Camera camera;
  camera.distance = 200;
  PictureOptions options;
  options.backdrop = Backdrop{};
  const Picture plain = draw(preview, camera, {240, 240}, options);
  options.ground_shadow = true;
  const Picture shadow = draw(preview, camera, {240, 240}, options, 1);
  EXPECT_EQ(shadow.pixels, draw(preview, camera, {240, 240}, options, 3).pixels);
  int darkest = 0;
  std::size_t soft = 0;
  for (std::size_t i = 0; i < plain.pixels.size(); ++i) {
    if (plain.pixels[i].a == 255) {
      ASSERT_EQ(plain.pixels[i], shadow.pixels[i]);
    } else {
      ASSERT_GE(shadow.pixels[i].a, plain.pixels[i].a);
      if (plain.pixels[i].a == 0) darkest = std::max<int>(darkest, shadow.pixels[i].a);
      soft += plain.pixels[i].a == 0 && shadow.pixels[i].a > 3 ? 1 : 0;
    }
  }
  EXPECT_GT(darkest, 50);
  EXPECT_LT(darkest, 160);
  EXPECT_GT(soft, 500u);
  EXPECT_EQ(shadow.pixels[0].a, 0);
  // On a backdrop it darkens; from below the plane it is not seen.
  options.backdrop = plain_backdrop({200, 100, 50});
  const Picture coloured = draw(preview, camera, {240, 240}, options);
  EXPECT_EQ(coloured.pixels[0], Rgba(200, 100, 50, 255));
  EXPECT_TRUE(std::any_of(coloured.pixels.begin(), coloured.pixels.end(), [](const Rgba& pixel) {
    return pixel.r < 170 && std::abs(pixel.r - 2 * pixel.g) <= 2 && pixel.a == 255;
  }));
  camera.rotation.x = 130;
  const Picture below = draw(preview, camera, {240, 240}, options);
  options.ground_shadow = false;
  std::size_t differ = 0;
  const Picture bare = draw(preview, camera, {240, 240}, options);
  for (std::size_t i = 0; i < bare.pixels.size(); ++i) {
    for (int c = 0; c < 3; ++c) differ += std::abs(bare.pixels[i][c] - below.pixels[i][c]) > 1;
  }
  EXPECT_EQ(differ, 0u);
}

TEST(Shading, CapsAreBrightAndHatchedAndCutsOfOtherSolidsAreNot) {
  Scene scene;
  const NodeId block = scene.tree.add_solid(solid_of(make_box({-10, -10, -10}, {10, 10, 10})));
  const NodeId notch = scene.tree.add_solid(solid_of(make_box({-5, -20, 5}, {5, 20, 20})));
  scene.tree.set_root(scene.tree.add(Operation::kDifference, {block, notch}));
  SectionPlane plane;
  plane.normal = {0, -1, 0};
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = {90, 0, 0};
  cut_scene(scene, std::span(&plane, 1), camera);
  Preview preview(std::move(scene.tree));
  camera.distance = 70;
  PictureOptions options;
  options.hatched_caps = false;
  const Picture plain = draw(preview, camera, {200, 200}, options);
  const Rgba cap(default_scheme().cap, 255);
  const auto caps = std::count(plain.pixels.begin(), plain.pixels.end(), cap);
  EXPECT_GT(caps, 3000);
  options.hatched_caps = true;
  const Picture hatched = draw(preview, camera, {200, 200}, options);
  std::size_t lines = 0;
  for (std::size_t i = 0; i < plain.pixels.size(); ++i) {
    if (plain.pixels[i] != cap) {
      EXPECT_EQ(plain.pixels[i], hatched.pixels[i]);
    } else {
      lines += hatched.pixels[i] != cap ? 1 : 0;
      EXPECT_GT(hatched.pixels[i].r, cap.r / 2);
    }
  }
  EXPECT_GT(lines, static_cast<std::size_t>(caps / 8));
  EXPECT_LT(lines, static_cast<std::size_t>(caps / 2));
}

}  // namespace
}  // namespace strata::csg
