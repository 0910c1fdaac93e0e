// Coloured shadows: ordinary ones for opaque casters, products and closed forms for others, and
// none that a surface casts on itself.

#include <algorithm>
#include <glm/exponential.hpp>
#include <limits>
#include <numbers>
#include <random>

#include "strata/transparency/media/shadow_map.h"
#include "tests/transparency/media_scenes.h"

namespace strata::transparency {
namespace {

MediaSettings light_from(const glm::dvec3& direction, int size = 256) {
  MediaSettings settings;
  settings.light.at = direction;
  settings.light.radiance = glm::vec3(1.0f);
  settings.light.shadows = true;
  settings.light.shadow_size = size;
  return settings;
}

ShadowMap shadows_of(const Scene& scene, const MediaSettings& settings) {
  auto map = ShadowMap::make(scene, settings);
  EXPECT_TRUE(map) << (map ? "" : map.error().message);
  return *map;
}

TriangleSoup pane(double z, double half = 10.0) {
  TriangleSoup soup;
  soup.positions = {{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}};
  soup.triangles = {{0, 1, 2}, {0, 2, 3}};
  return soup;
}

/// Where a ray meets a triangle; infinity: nowhere. T. Moeller, B. Trumbore (1997).
double hit(const glm::dvec3& from, const glm::dvec3& along, const glm::dvec3& a,
           const glm::dvec3& b, const glm::dvec3& c) {
  const glm::dvec3 e = b - a, f = c - a, p = glm::cross(along, f);
  const double det = glm::dot(e, p);
  constexpr double kNone = std::numeric_limits<double>::infinity();
  if (std::abs(det) < 1e-14) return kNone;
  const glm::dvec3 s = (from - a) / det, q = glm::cross(s, e);
  const double u = glm::dot(s, p), v = glm::dot(along, q);
  return u < 0 || v < 0 || u + v > 1 ? kNone : glm::dot(f, q);
}

TEST(ShadowMap, OfOpaqueCastersIsAnOrdinaryOne) {
  Scene scene;
  add_object(scene, "ball", moved(make_icosphere(1.0, 2), {0.3, 0.2, 1.0}), {1, 1, 1, 1});
  add_object(scene, "box", make_box({-2, -2, -1}, {1, 1.5, -0.5}), {0.2f, 0.9f, 0.1f, 1});
  add_object(scene, "ring", moved(make_torus(1.5, 0.3, 24, 12), {0, 0, 0.4}), {1, 0, 0, 1});
  const glm::dvec3 direction = glm::normalize(glm::dvec3(1, 2, 3));
  constexpr int kSize = 96;
  const ShadowMap map = shadows_of(scene, light_from(direction, kSize));
  // The same picture of the least depths: the ball about the scene's box fills it.
  const Bounds box = bounds(scene.mesh);
  const glm::dvec3 centre = 0.5 * (box.low + box.high);
  const double radius = 0.5 * glm::length(box.high - box.low);
  const glm::dmat4 eye = eye_from_world(look_at(centre + direction, centre));
  const glm::dvec3 right(eye[0].x, eye[1].x, eye[2].x), up(eye[0].y, eye[1].y, eye[2].y);
  const auto pixel_of = [&](const glm::dvec3& p) {
    const double half = kSize / 2.0;
    return glm::dvec2(half + glm::dot(p - centre, right) / radius * half,
                      half - glm::dot(p - centre, up) / radius * half);
  };
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-2.0, 2.0);
  int dark = 0, lit = 0, wrong = 0;
  for (int i = 0; i < 20000; ++i) {
    const glm::dvec3 p(place(random), place(random), place(random));
    const glm::dvec2 at = glm::floor(pixel_of(p)) + 0.5;
    const glm::dvec3 from = centre + 10.0 * direction +
                            (at.x / (kSize / 2.0) - 1.0) * radius * right -
                            (at.y / (kSize / 2.0) - 1.0) * radius * up;
    double least = std::numeric_limits<double>::infinity();
    for (const glm::uvec3& t : scene.mesh.triangles) {
      const auto& at_of = scene.mesh.positions;
      least = std::min(least, hit(from, -direction, at_of[t.x], at_of[t.y], at_of[t.z]));
    }
    const double depth = glm::dot(from - p, direction);
    if (std::abs(depth - least) < 1e-3) continue;
    const bool in_shadow = least < depth;
    (in_shadow ? dark : lit)++;
    const glm::vec3 seen = map.transmittance(p);
    ASSERT_TRUE(seen == glm::vec3(0.0f) || seen == glm::vec3(1.0f));
    wrong += (seen == glm::vec3(0.0f)) != in_shadow ? 1 : 0;
  }
  EXPECT_GT(dark, 3000);
  EXPECT_GT(lit, 3000);
  // Rays that pass a silhouette within 1/256 of a pixel may fall to either side.
  EXPECT_LE(wrong, 20);
}

TEST(ShadowMap, CastersOfOpacityZeroChangeNothing) {
  Scene scene;
  add_object(scene, "high", pane(3.0), {1, 0.5f, 0.25f, 0.5f});
  add_object(scene, "low", pane(0.0), {1, 1, 1, 1});
  Scene more = scene;
  add_object(more, "nothing", moved(make_icosphere(1.4, 3), {0, 0, 1.5}), {0.1f, 0.2f, 0.3f, 0.0f});
  const MediaSettings settings = light_from({0.2, 0.1, 1});
  const ShadowMap map = shadows_of(scene, settings), with = shadows_of(more, settings);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(-4.0, 4.0);
  int tinted = 0;
  for (int i = 0; i < 3000; ++i) {
    const glm::dvec3 p(place(random), place(random), place(random));
    ASSERT_EQ(map.transmittance(p), with.transmittance(p));
    tinted += map.transmittance(p) != glm::vec3(1.0f) ? 1 : 0;
  }
  EXPECT_GT(tinted, 1000);
}

TEST(ShadowMap, IsTheProductOfAllThatLiesBefore) {
  Scene scene;
  const glm::dvec4 colours[] = {{1, 0.5, 0.25, 0.5}, {0.2, 0.8, 0.6, 0.25}, {0, 0, 0, 0.75}};
  for (int i = 0; i < 3; ++i) {
    add_object(scene, "pane", pane(3.0 - i), glm::vec4(colours[i]));
  }
  const ShadowMap map = shadows_of(scene, light_from({0.3, -0.2, 1}));
  glm::dvec3 right(1.0);
  for (int i = 0; i < 4; ++i) {
    const glm::vec3 above = map.transmittance({0.1, 0.2, 3.01 - i});
    // On a pane: what the panes above it let through.
    const glm::vec3 on = map.transmittance({0.3, 0.4, 3.0 - i}, {0, 0, 1});
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(above[c], right[c], 1e-6);
      EXPECT_NEAR(on[c], right[c], 1e-6);
    }
    if (i == 3) break;
    const double a = colours[i].a;
    right *= (1.0 - a) * (1.0 - a + a * glm::dvec3(colours[i]));
  }
}

TEST(ShadowMap, HasNoShadowOfASurfaceOnItself) {
  Scene scene;
  add_object(scene, "ball", make_icosphere(1.0, 3), {1, 1, 1, 1});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const bool point : {false, true}) {
    for (const int size : {16, 128, 1024}) {
      MediaSettings settings = light_from(glm::dvec3(1, 2, 3), size);
      settings.light.point = point;
      const ShadowMap map = shadows_of(scene, settings);
      int lit = 0, dark = 0;
      for (const glm::uvec3& t : scene.mesh.triangles) {
        const glm::dvec3 &a = scene.mesh.positions[t.x], &b = scene.mesh.positions[t.y],
                         &c = scene.mesh.positions[t.z];
        const glm::dvec3 normal = glm::normalize(glm::cross(b - a, c - a));
        const double s = std::sqrt(unit(random)), r = unit(random);
        const glm::dvec3 p = (1.0 - s) * a + s * (1.0 - r) * b + s * r * c;
        const glm::dvec3 to_light =
            glm::normalize(settings.light.at - (point ? p : glm::dvec3(0.0)));
        const double cosine = glm::dot(normal, to_light);
        if (cosine > 0.02) {
          ASSERT_EQ(map.transmittance(p, normal), glm::vec3(1.0f)) << size << " " << cosine;
          ++lit;
        }
        if (cosine < (size == 16 ? -0.8 : -0.3)) {
          ASSERT_EQ(map.transmittance(p, normal), glm::vec3(0.0f)) << size << " " << cosine;
          ++dark;
        }
      }
      EXPECT_GT(lit, 300);
      EXPECT_GT(dark, 50);
    }
  }
}

TEST(ShadowMap, ShowsCastersThatAreVeryNear) {
  Scene scene;
  add_object(scene, "floor", pane(0.0), {1, 1, 1, 1});
  add_object(scene, "pane", pane(1e-4, 2.0), {0, 0, 0, 1});
  const ShadowMap map = shadows_of(scene, light_from({0.5, 0.3, 1}, 512));
  EXPECT_EQ(map.transmittance({0.5, 0.5, 0.0}, {0, 0, 1}), glm::vec3(0.0f));
  EXPECT_EQ(map.transmittance({3.5, 0.5, 0.0}, {0, 0, 1}), glm::vec3(1.0f));
}

TEST(ShadowMap, OfMediaAndParticlesHasTheirClosedForms) {
  Scene scene;
  add_object(scene, "cloud", make_box({-5, -5, -1}, {5, 5, 1}));
  MediaSettings settings = light_from({0, 0, 1});
  settings.media = {{"cloud", {{0.5f, 0.25f, 1.0f}, glm::vec3(1.0f)}}};
  settings.particles = {{{2, 0, 4}, 0.5, glm::vec3(0.75f)}};
  const ShadowMap map = shadows_of(scene, settings);
  for (const double z : {2.0, 1.0, 0.5, 0.0, -0.75, -1.0, -3.0}) {
    const double depth = std::clamp(1.0 - z, 0.0, 2.0);
    const glm::vec3 seen = map.transmittance({-1, 1, z});
    EXPECT_NEAR(seen.x, std::exp(-0.5 * depth), 1e-5) << z;
    EXPECT_NEAR(seen.y, std::exp(-0.25 * depth), 1e-5) << z;
    EXPECT_NEAR(seen.z, std::exp(-1.0 * depth), 1e-5) << z;
  }
  // A pixel is 0.04 wide, and the ball is flat in its middle.
  EXPECT_NEAR(map.transmittance({2, 0, 2}).x, std::exp(-0.75), 2e-3);
  EXPECT_NEAR(map.transmittance({2, 0, 4}).x, std::exp(-0.375), 2e-3);
  EXPECT_EQ(map.transmittance({2, 0, 4.6}), glm::vec3(1.0f));
}

TEST(ShadowMap, OfAPointLooksToAllSides) {
  Scene scene;
  add_object(scene, "shell", make_icosphere(2.0, 4), {1, 1, 1, 0.5f});
  add_object(scene, "outer", make_icosphere(3.0, 4), {0.5f, 0.5f, 0.5f, 0.5f});
  MediaSettings settings = light_from({0.1, 0.2, -0.1});
  settings.light.point = true;
  const ShadowMap map = shadows_of(scene, settings);
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 2000; ++i) {
    const glm::dvec3 way =
        glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
    EXPECT_EQ(map.transmittance(1.7 * way), glm::vec3(1.0f));
    EXPECT_EQ(map.transmittance(2.5 * way), glm::vec3(0.5f));
    EXPECT_EQ(map.transmittance(4.0 * way), glm::vec3(0.5f * 0.5f * 0.75f));
  }
}

TEST(ShadowMap, OfFixedSizeComesNearTheLists) {
  // Grey panes of one opacity, which occupancy maps can tell, over a floor.
  Scene scene;
  for (const double z : {3.1, 2.3, 1.2}) add_object(scene, "pane", pane(z), {1, 1, 1, 0.5f});
  add_object(scene, "floor", pane(-3.0), {1, 1, 1, 0.5f});
  Scene fog;
  add_object(fog, "cloud", make_box({-5, -5, -3}, {5, 5, 3}));
  struct Kind {
    ShadowVisibility visibility;
    int size;
    double of_panes, of_fog;  // differences from the exact function
  };
  const Kind kinds[] = {{ShadowVisibility::kSlices, 64, 1e-3, 0.1},
                        {ShadowVisibility::kOccupancy, 64, 1e-3, 0.15},
                        {ShadowVisibility::kFourier, 32, 0.1, 0.05},
                        {ShadowVisibility::kNodes, 4, 1e-3, 0.35},
                        {ShadowVisibility::kNodes, 32, 1e-3, 0.1}};
  for (const Kind& kind : kinds) {
    MediaSettings settings = light_from({0, 0, 1}, 64);
    settings.light.visibility = kind.visibility;
    settings.light.visibility_size = kind.size;
    const ShadowMap panes = shadows_of(scene, settings);
    for (int i = 0; i < 5; ++i) {
      const double z[] = {4.5, 2.7, 1.75, 0.0, -5.0};
      const glm::vec3 seen = panes.transmittance({0.3, 0.2, z[i]});
      EXPECT_NEAR(seen.x, std::pow(0.5, i), kind.of_panes) << int(kind.visibility) << " " << z[i];
      EXPECT_EQ(seen.x, seen.y);
    }
    settings.media = {{"cloud", {glm::vec3(0.5f), glm::vec3(1.0f)}}};
    const ShadowMap media = shadows_of(fog, settings);
    double largest = 0.0;
    for (double z = 3.5; z > -3.5; z -= 0.1) {
      const double right = std::exp(-0.5 * std::clamp(3.0 - z, 0.0, 6.0));
      largest = std::max(largest, std::abs(media.transmittance({0.3, 0.2, z}).x - right));
    }
    EXPECT_LT(largest, kind.of_fog) << int(kind.visibility);
  }
}

TEST(ShadowMap, KeepsToItsMemoryLimit) {
  Scene scene;
  for (int i = 0; i < 20; ++i) add_object(scene, "pane", pane(i), {1, 1, 1, 0.5f});
  Execution execution;
  execution.memory_limit = 16 << 20;
  EXPECT_TRUE(ShadowMap::make(scene, light_from({0, 0, 1}, 64), execution));
  const auto large = ShadowMap::make(scene, light_from({0, 0, 1}, 1024), execution);
  ASSERT_FALSE(large);
  EXPECT_EQ(large.error().code, ErrorCode::kLimit);
  EXPECT_NE(large.error().message.find("16777216"), std::string::npos);
}

TEST(Shadows, FallOnSurfacesOfThePicture) {
  Scene scene;
  add_object(scene, "floor", pane(0.0), {0.8f, 0.6f, 0.4f, 1.0f});
  add_object(scene, "glass", pane(3.0, 2.0), {1.0f, 0.0f, 0.5f, 0.5f});
  MediaSettings settings = light_from({1, 0, 1}, 1024);
  settings.ambient = {0.25f, 0.25f, 0.5f};
  settings.light.radiance = {2.0f, 1.0f, 1.0f};
  const View view = view_from_above(scene, {60, 60}, 6.0);
  const Image image = render(scene, view, settings).rendering.image;
  const auto pixel = [&](double x, double y) {
    return image.pixels[static_cast<std::size_t>((30 - y * 6) * 60 + 30 + x * 6)];
  };
  const glm::dvec3 base(0.8, 0.6, 0.4), ambient(settings.ambient),
      radiance(settings.light.radiance);
  const double cosine = std::sqrt(0.5) / std::numbers::pi;
  expect_colour(pixel(3.5, 0.5), base * (ambient + cosine * radiance), 1e-5, "lit");
  // The shadow of the glass lies three units to the left.
  const glm::dvec3 through = 0.5 * (0.5 + 0.5 * glm::dvec3(1.0, 0.0, 0.5));
  const glm::dvec3 shaded = base * (ambient + cosine * radiance * through);
  expect_colour(pixel(-3.5, 0.5), shaded, 1e-5, "in the shadow");
  const glm::dvec3 glass = glm::dvec3(1.0, 0.0, 0.5) * (ambient + cosine * radiance);
  expect_colour(pixel(-1.8, 0.5), 0.5 * glass + 0.5 * shaded, 1e-5, "through the glass");
  expect_colour(pixel(1.5, 0.5), 0.5 * glass + 0.5 * base * (ambient + cosine * radiance), 1e-5,
                "glass before light");
}

TEST(Shadows, DarkenLightInMedia) {
  Scene scene;
  add_object(scene, "cloud", make_box({-8, -8, -2}, {8, 8, 0}));
  add_object(scene, "plate", pane(1.0, 2.0), {0, 0, 0, 1});
  MediaSettings settings = light_from({0, 0, 1}, 256);
  settings.media = {{"cloud", {{0.5f, 1.0f, 0.0f}, {0.5f, 1.0f, 1.0f}}}};
  settings.ambient = glm::vec3(0.25f);
  settings.light.radiance = glm::vec3(8.0f);
  settings.light.shadow_steps = 200;
  // From below: light that comes from above, through the cloud.
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = {180.0, 0.0, 0.0};
  camera.field_of_view = 90.0;
  camera.distance = 5.0;
  const auto view = make_view(camera, {40, 40}, bounds(scene.mesh));
  ASSERT_TRUE(view);
  const Image image = render(scene, *view, settings).rendering.image;
  const double phase = 8.0 * 3.0 / (8.0 * std::numbers::pi);
  glm::dvec3 lit(0.0), dark(0.0);
  const glm::dvec3 sigma(0.5, 1.0, 0.0), albedo(0.5, 1.0, 1.0);
  for (int c = 0; c < 2; ++c) {
    // Light is e^-(2 - s) at distance s from the eye's side, of which e^-s comes to the eye.
    lit[c] = albedo[c] * phase * sigma[c] * 2.0 * std::exp(-2.0 * sigma[c]);
    dark[c] = albedo[c] * 0.25 * (1.0 - std::exp(-2.0 * sigma[c]));
  }
  expect_colour(image.pixels[20 * 40 + 35], lit + dark, 1e-3, "lit");
  expect_colour(image.pixels[20 * 40 + 20], dark, 1e-5, "below the plate");
}

}  // namespace
}  // namespace strata::transparency
