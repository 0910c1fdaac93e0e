// Techniques that draw in an order of objects or triangles: where they are exact, and by how much
// they are wrong where no order of whole objects or triangles is right.

#include <gtest/gtest.h>

#include <bit>
#include <glm/geometric.hpp>
#include <numeric>

#include "strata/mesh/shapes.h"
#include "tests/transparency/listed_frames.h"
#include "tests/transparency/mesh_frames.h"
#include "transparency/objects/query_order.h"

namespace strata::transparency {
namespace {

constexpr const char* kExactBackToFront = "reverse-peeling";

Settings variant(std::string name, unsigned k = 0) {
  Settings settings;
  settings.variant = std::move(name);
  settings.k = k;
  return settings;
}

glm::vec4 some_colour(std::mt19937& random) {
  std::uniform_real_distribution<float> unit(0.1f, 0.9f);
  return {unit(random), unit(random), unit(random), unit(random)};
}

/// Squares one behind the other, submitted in a random order.
Scene stacked_squares(int count, unsigned seed) {
  Scene scene;
  std::mt19937 random(seed);
  std::vector<int> heights(static_cast<std::size_t>(count));
  std::iota(heights.begin(), heights.end(), 0);
  std::shuffle(heights.begin(), heights.end(), random);
  for (const int z : heights) add_object(scene, square_at(z), some_colour(random));
  return scene;
}

/// Balls in boxes of their own, so that none crosses another.
Scene separate_balls(int side, unsigned seed) {
  Scene scene;
  std::mt19937 random(seed);
  for (int i = 0; i < side * side * side; ++i) {
    TriangleSoup ball = make_icosphere(0.47, 2);
    for (glm::dvec3& p : ball.positions) {
      p += glm::dvec3(i % side, i / side % side, i / side / side);
    }
    add_object(scene, ball, some_colour(random));
  }
  return scene;
}

Scene random_triangles(int count, unsigned seed) {
  Scene scene;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-2.0, 2.0), offset(-1.5, 1.5);
  const auto point = [&](auto& from) {
    return glm::dvec3(from(random), from(random), from(random));
  };
  for (int i = 0; i < count; ++i) {
    const glm::dvec3 middle = point(place);
    add_object(scene,
               face({middle + point(offset), middle + point(offset), middle + point(offset)}),
               some_colour(random));
  }
  return scene;
}

Camera seen_from(const glm::dvec3& rotation, double distance) {
  Camera camera;
  camera.rotation = rotation;
  camera.distance = distance;
  camera.field_of_view = 40;
  return camera;
}

void expect_exact(const Frame& frame, std::string_view name, const Settings& settings,
                  const std::string& what) {
  const Rendering exact = rendered(frame, kExactBackToFront);
  const Rendering rendering = rendered(frame, name, settings);
  EXPECT_GT(exact.costs.fragments, 100u) << what;
  EXPECT_TRUE(same_bits(rendering.image, exact.image.pixels))
      << what << ": " << difference(rendering.image, exact.image).pixels << " pixels differ";
  EXPECT_EQ(rendering.costs.geometry_passes, 1u);
  EXPECT_EQ(rendering.costs.most_layers, exact.costs.most_layers);
}

TEST(ObjectOrder, IsExactForObjectsAtDifferentDepths) {
  const Scene scene = stacked_squares(9, 1);
  for (const Camera& camera : {flat_camera(), seen_from({0, 0, 0}, 60)}) {
    const Frame frame = frame_of(scene, camera, {70, 66});
    expect_exact(frame, "object-sort", {}, "objects");
    expect_exact(frame, "visibility-queries", {}, "queries");
    for (const char* of : {"centroid", "max", "split"}) {
      expect_exact(frame, "primitive-sort", variant(of), of);
    }
    const Rendering rendering = rendered(frame, "object-sort");
    EXPECT_EQ(rendering.costs.formula_bytes, 16u * 70 * 66 + 4 * 9);
    EXPECT_EQ(rendering.costs.allocated_bytes, rendering.costs.formula_bytes);
  }
}

/// Two squares that cross in the line x = 0.
Scene crossing_squares(bool cut_there) {
  Scene scene;
  for (const double dz : {0.5, -0.5}) {
    TriangleSoup square = square_at(0);
    for (glm::dvec3& p : square.positions) p.z = dz * p.x;
    if (cut_there) square = subdivide(square);
    add_object(scene, square, dz > 0 ? glm::vec4(1, 0.2f, 0, 0.6f) : glm::vec4(0, 0.3f, 1, 0.25f));
  }
  return scene;
}

/// Where the nearer of two layers of opacities a and b is drawn first, the picture is off by
/// a b (its colour - the other's).
TEST(ObjectOrder, CrossingPlanesAreWrongByTheFormula) {
  const Scene scene = crossing_squares(false);
  const Frame frame = frame_of(scene, flat_camera(), {64, 20});
  const Image exact = rendered(frame, kExactBackToFront).image;
  const glm::vec3 red = glm::vec3(1, 0.2f, 0) * eye_light(glm::dvec3(-0.5, 0, 1));
  const glm::vec3 blue = glm::vec3(0, 0.3f, 1) * eye_light(glm::dvec3(0.5, 0, 1));
  for (const char* name : {"object-sort", "primitive-sort", "visibility-queries"}) {
    const Image image = rendered(frame, name).image;
    int wrong = 0;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      if (image.pixels[i] == exact.pixels[i]) continue;
      ++wrong;
      // Red rises to the right, and is nearer there.
      const glm::vec3 by = 0.6f * 0.25f * (i % 64 < 32 ? red - blue : blue - red);
      for (int c = 0; c < 3; ++c) {
        ASSERT_NEAR(image.pixels[i][c] - exact.pixels[i][c], by[c], 1e-6) << name;
      }
    }
    // Whole objects are right on one side; triangles, which have corners on both, here and there.
    if (std::string(name) == "object-sort") {
      EXPECT_EQ(wrong, 64 * 20 / 2);
    } else {
      EXPECT_GT(wrong, 64 * 20 / 16) << name;
      EXPECT_LT(wrong, 64 * 20 * 7 / 8) << name;
    }
  }
  expect_exact(frame, "primitive-sort", variant("split"), "split");
}

TEST(VisibilityQueries, AreExactWhereTrianglesMeetButDoNotCross) {
  const Scene scene = crossing_squares(true);
  const Frame frame = frame_of(scene, flat_camera(), {64, 20});
  expect_exact(frame, "visibility-queries", {}, "queries");
  const Image exact = rendered(frame, kExactBackToFront).image;
  EXPECT_EQ(difference(rendered(frame, "object-sort").image, exact).pixels, 64u * 20 / 2);
}

TEST(PrimitiveSort, CentroidsAreWrongForALongTriangleBehindAShortOne) {
  // The long one lies under the short one, but reaches towards the eye far from it.
  Scene scene;
  add_object(scene, face({{-1, -1, 0}, {20, 0, 40}, {-1, 1, 0}}), {1, 0, 0, 0.5f});
  add_object(scene, face({{0, -0.05, 3.0}, {0.3, 0, 3.0}, {0, 0.05, 3.0}}), {0, 0, 1, 0.5f});
  Camera camera = flat_camera();
  camera.distance = 3;
  const Frame frame = frame_of(scene, camera, {120, 90});
  const Rendering exact = rendered(frame, kExactBackToFront);
  const Difference off = difference(rendered(frame, "primitive-sort").image, exact.image);
  // All pixels of the short one: a b (c - d) with a = b = 0.5.
  const float red_light = eye_light(glm::cross(glm::dvec3(21, 1, 40), glm::dvec3(0, 2, 0)));
  const float largest = 0.25f * std::max(red_light, eye_light({0, 0, 1}));
  EXPECT_NEAR(off.largest, largest, 1e-6);
  EXPECT_GT(off.pixels, 20u);
  // Their farthest corners are in the right order.
  expect_exact(frame, "primitive-sort", variant("max"), "max");
  expect_exact(frame, "primitive-sort", variant("split"), "split");
}

TEST(PrimitiveSort, SplitIsExactForTrianglesThatCross) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const Scene scene = random_triangles(30, seed);
    const Camera camera =
        seed % 2 == 0 ? flat_camera({10, 20, 30}) : seen_from({40, 0, 70.0 * seed}, 12);
    const Frame frame = frame_of(scene, camera, {90, 75}, seed % 3 == 0 ? 4 : 1);
    expect_exact(frame, "primitive-sort", variant("split"), "seed " + std::to_string(seed));
    const Image exact = rendered(frame, kExactBackToFront).image;
    EXPECT_GT(difference(rendered(frame, "primitive-sort").image, exact).pixels, 30u);
  }
}

TEST(PrimitiveSort, SplitIsExactForClosedMeshesThatCross) {
  std::mt19937 random(8);
  Scene scene;
  add_object(scene, make_icosphere(1.2, 2), some_colour(random));
  add_object(scene, make_torus(1.3, 0.4, 20, 9), some_colour(random));
  add_object(scene, subdivide(make_box({-1, -1, -1}, {1, 1.1, 0.9})), some_colour(random));
  add_object(scene, make_torus_knot(2, 3, 0.2, 60, 6), some_colour(random));
  for (const int samples : {1, 4}) {
    const Frame frame = frame_of(scene, seen_from({55, 0, 25}, 9), {101, 77}, samples);
    expect_exact(frame, "primitive-sort", variant("split"), "meshes");
  }
  // From inside, where the near plane cuts triangles in pieces.
  Camera inside = seen_from({80, 0, 15}, 0.6);
  inside.field_of_view = 80;
  expect_exact(frame_of(scene, inside, {101, 77}), "primitive-sort", variant("split"), "inside");
}

TEST(PrimitiveSort, SplitKeepsTheOrderOfCoplanarTriangles) {
  std::mt19937 random(9);
  Scene scene;
  for (int i = 0; i < 3; ++i) {
    add_object(scene, subdivide(subdivide(square_at(0))), some_colour(random));
    add_object(scene, subdivide(square_at(0)), some_colour(random));
  }
  for (const glm::dvec3 rotation : {glm::dvec3(0, 0, 0), glm::dvec3(31, 17, 5)}) {
    for (const Camera& camera : {flat_camera(rotation), seen_from(rotation, 60)}) {
      const Frame frame = frame_of(scene, camera, {80, 60});
      expect_exact(frame, "primitive-sort", variant("split"), "coplanar");
    }
  }
}

TEST(ObjectOrder, HundredsOfLayersAndTheSmallestPictures) {
  const Scene deep = stacked_squares(590, 6);
  const Scene twice = [] {
    Scene scene = stacked_squares(3, 7);
    const TriangleSoup once = scene.mesh;
    add_object(scene, once, {0.5f, 0.1f, 0.9f, 0.3f});
    add_object(scene, once, {0.5f, 0.7f, 0.2f, 0.6f});
    return scene;
  }();
  for (const Scene* scene : {&deep, &twice}) {
    for (const glm::ivec2 size : {glm::ivec2(1, 1), glm::ivec2(7, 3)}) {
      const Frame frame = frame_of(*scene, flat_camera(), size);
      const Image exact = rendered(frame, kExactBackToFront).image;
      EXPECT_GT(exact.pixels[0].a, 0.3f);
      for (const auto& [name, settings] :
           {std::pair{"object-sort", Settings{}}, std::pair{"primitive-sort", Settings{}},
            std::pair{"primitive-sort", variant("split")},
            std::pair{"visibility-queries", Settings{}}}) {
        // Whole objects have no order where each of their squares is covered by another's.
        if (scene == &twice && settings.variant != "split" && name[0] != 'v') continue;
        EXPECT_TRUE(same_bits(rendered(frame, name, settings).image, exact.pixels)) << name;
      }
    }
  }
}

TEST(ObjectOrder, GivesTheSameBitsForAnyNumberOfThreads) {
  const Scene scene = random_triangles(60, 14);
  const Frame frame = frame_of(scene, seen_from({50, 0, 20}, 12), {150, 140}, 2);
  int checked = 0;
  for (const Technique* technique : techniques()) {
    if (!technique->needs_triangles) continue;
    const Rendering one = rendered(frame, technique->name, {}, 1);
    for (const int threads : {2, 4}) {
      const Rendering more = rendered(frame, technique->name, {}, threads);
      EXPECT_TRUE(same_bits(more.image, one.image.pixels)) << technique->name << threads;
      EXPECT_EQ(more.costs.comparisons, one.costs.comparisons);
      EXPECT_EQ(more.costs.queries, one.costs.queries);
      EXPECT_EQ(more.costs.allocated_bytes, one.costs.allocated_bytes);
    }
    ++checked;
  }
  EXPECT_GE(checked, 3);
}

TEST(ObjectOrder, NeedsTriangles) {
  const ListedFrame listed = random_frame("Bare", {4, 4}, 2.0, 9, 1);
  auto frame = Frame::make(listed.fragments, listed.colours, listed.options);
  ASSERT_TRUE(frame);
  for (const char* name : {"object-sort", "primitive-sort", "visibility-queries"}) {
    const auto refused = frame->render(**find_technique(name));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kUsage);
    EXPECT_NE(refused.error().message.find(name), std::string::npos);
  }
}

TEST(PrimitiveSort, SplitSaysWhatIsTooMuch) {
  const Scene scene = random_triangles(40, 3);
  const Frame frame = frame_of(scene, flat_camera(), {90, 75});
  const auto refused = frame.render(**find_technique("primitive-sort"), variant("split", 1));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
  EXPECT_NE(refused.error().message.find("40 triangles need more than 40 pieces"),
            std::string::npos)
      << refused.error().message;
  std::stop_source stop;
  stop.request_stop();
  Execution execution;
  execution.stop = stop.get_token();
  for (const char* name : {"primitive-sort", "visibility-queries"}) {
    const auto stopped = frame.render(**find_technique(name),
                                      name[0] == 'p' ? variant("split") : Settings{}, execution);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  }
}

TEST(VisibilityQueries, AreExactForSolidsThatDoNotCross) {
  const Scene scene = separate_balls(3, 4);
  for (const Camera& camera : {flat_camera({20, 0, 0}), seen_from({61, 0, 33}, 9)}) {
    const Frame frame = frame_of(scene, camera, {90, 81});
    expect_exact(frame, "visibility-queries", {}, "balls");
    const Image one = rendered(frame, "visibility-queries", {}, 1).image;
    EXPECT_TRUE(same_bits(rendered(frame, "visibility-queries", {}, 4).image, one.pixels));
  }
}

TEST(VisibilityQueries, TakeObjectsApartThatHideEachOtherInACircle) {
  // Three bars, each over the next on one end, cut so finely that triangles have an order.
  Scene scene;
  std::mt19937 random(12);
  for (int i = 0; i < 3; ++i) {
    TriangleSoup bar;
    constexpr int kParts = 16;
    for (int part = 0; part < kParts; ++part) {
      const auto corner = [&](int at, double side) {
        const double along = -2.0 + 4.0 * at / kParts, turn = 2.0943951 * i;
        const glm::dvec2 p(along, 0.8 + side);
        return glm::dvec3(p.x * std::cos(turn) - p.y * std::sin(turn),
                          p.x * std::sin(turn) + p.y * std::cos(turn), 0.3 * along);
      };
      append(bar, face({corner(part, -0.2), corner(part + 1, -0.2), corner(part + 1, 0.2),
                        corner(part, 0.2)}));
    }
    add_object(scene, bar, some_colour(random));
  }
  const Frame frame = frame_of(scene, flat_camera(), {120, 120});
  expect_exact(frame, "visibility-queries", {}, "bars");
  const Image exact = rendered(frame, kExactBackToFront).image;
  EXPECT_GT(difference(rendered(frame, "object-sort").image, exact).pixels, 20u);
}

TEST(VisibilityQueries, AskOncePerObjectWhereTheOrderIsRight) {
  // One query against all before it, one against itself.
  const Scene scene = stacked_squares(12, 5);
  const Frame frame = frame_of(scene, flat_camera(), {70, 66});
  EXPECT_EQ(rendered(frame, "visibility-queries").costs.queries, 12u + 12u);
  EXPECT_EQ(rendered(frame, "object-sort").costs.queries, 0u);
}

/// Random pairs that agree with an order of numbers.
std::vector<Occlusion> random_occlusions(std::uint32_t objects, int in_ten, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Occlusion> some;
  for (std::uint32_t front = 0; front < objects; ++front) {
    for (std::uint32_t behind = front + 1; behind < objects; ++behind) {
      if (static_cast<int>(random() % 10) < in_ten) some.push_back({front, behind});
    }
  }
  return some;
}

TEST(QueryOrder, NeverDrawsAnOccluderBeforeWhatItHides) {
  std::mt19937 random(6);
  for (unsigned seed = 1; seed <= 60; ++seed) {
    const std::uint32_t objects = 1 + seed % 40;
    const auto occlusions = random_occlusions(objects, 1 + static_cast<int>(seed % 10), seed);
    std::vector<std::uint32_t> start(objects);
    std::iota(start.begin(), start.end(), 0u);
    std::shuffle(start.begin(), start.end(), random);
    const std::vector<PixelRect> boxes(objects, PixelRect{0, 0, 4, 4});
    const QueriedOrder order = order_by_queries(occlusions, start, boxes);
    ASSERT_EQ(order.groups.nodes.size(), objects);
    EXPECT_EQ(order.groups.size(), objects);  // no circles
    std::vector<std::size_t> places(objects);
    for (std::size_t i = 0; i < objects; ++i) places[order.groups.nodes[i]] = i;
    for (const Occlusion& o : occlusions) EXPECT_LT(places[o.behind], places[o.front]);
    // The order found is right: the next frame asks once for each.
    const QueriedOrder again = order_by_queries(occlusions, order.groups.nodes, boxes);
    EXPECT_EQ(again.queries, objects);
    EXPECT_EQ(again.groups.nodes, order.groups.nodes);
    EXPECT_LE(order.queries,
              objects * (std::bit_width(objects) + 2u) + objects * (objects - 1) / 2);
  }
}

TEST(QueryOrder, SortsACompleteOrderInNLogNQueries) {
  for (const std::uint32_t objects : {10u, 100u, 300u}) {
    const auto occlusions = random_occlusions(objects, 10, 1);
    std::vector<std::uint32_t> start(objects);
    std::iota(start.begin(), start.end(), 0u);
    std::shuffle(start.begin(), start.end(), std::mt19937(objects));
    const std::vector<PixelRect> boxes(objects, PixelRect{0, 0, 4, 4});
    const QueriedOrder order = order_by_queries(occlusions, start, boxes);
    EXPECT_LE(order.queries, objects * (std::bit_width(objects) + 2u));
    for (std::uint32_t i = 0; i < objects; ++i) EXPECT_EQ(order.groups.nodes[i], objects - 1 - i);
  }
}

TEST(QueryOrder, KeepsWhatHidesEachOtherInAGroup) {
  // 0 before 1 before 2 before 0; 3 before all.
  const std::vector<Occlusion> occlusions{{0, 1}, {1, 2}, {2, 0}, {3, 0}, {3, 1}, {3, 2}};
  const std::vector<std::uint32_t> start{3, 0, 1, 2};
  const std::vector<PixelRect> boxes(4, PixelRect{0, 0, 4, 4});
  const QueriedOrder order = order_by_queries(occlusions, start, boxes);
  ASSERT_EQ(order.groups.size(), 2u);
  EXPECT_EQ(order.groups.group(0).size(), 3u);
  EXPECT_EQ(order.groups.group(1)[0], 3u);
}

}  // namespace
}  // namespace strata::transparency
