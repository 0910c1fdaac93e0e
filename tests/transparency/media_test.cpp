// The laws of media: closed forms along a ray, what may change nothing, and what is reported.

#include "strata/transparency/media/media.h"

#include <algorithm>
#include <cstring>
#include <numbers>
#include <random>

#include "strata/transparency/techniques.h"
#include "tests/transparency/media_scenes.h"
#include "transparency/media/media_table.h"

namespace strata::transparency {
namespace {

const glm::vec3 kExtinction{0.3f, 0.7f, 1.5f}, kAlbedo{0.9f, 0.5f, 0.25f};
const glm::vec3 kAmbient{0.8f, 1.0f, 0.6f};
const glm::vec4 kBackground{0.2f, 0.4f, 0.9f, 1.0f};
const glm::dvec3 kBehind(kBackground);

NamedMedium medium(const std::string& object, const glm::vec3& extinction,
                   const glm::vec3& albedo = kAlbedo) {
  NamedMedium named;
  named.object = object;
  named.medium.extinction = extinction;
  named.medium.albedo = albedo;
  return named;
}

MediaSettings settings(std::vector<NamedMedium> media) {
  MediaSettings all;
  all.media = std::move(media);
  all.ambient = kAmbient;
  return all;
}

FrameOptions before_background() {
  FrameOptions options;
  options.background = kBackground;
  return options;
}

TriangleSoup slab(double low, double high) { return make_box({-20, -20, low}, {20, 20, high}); }

Scene slabs(const std::vector<std::pair<double, double>>& of) {
  Scene scene;
  for (const auto& [low, high] : of) {
    add_object(scene, "slab" + std::to_string(scene.objects.size()), slab(low, high));
  }
  return scene;
}

Image from_above(const Scene& scene, const MediaSettings& media) {
  return render(scene, view_from_above(scene, {70, 66}), media, before_background())
      .rendering.image;
}

TEST(Media, SlabHasItsClosedForm) {
  const Scene scene = slabs({{0.0, 2.0}});
  const Image image = from_above(scene, settings({medium("slab0", kExtinction)}));
  const glm::dvec3 sigma(kExtinction);
  const glm::dvec3 right =
      RayOracle().segment(2.0, sigma, sigma * glm::dvec3(kAlbedo), kAmbient).before(kBehind);
  ASSERT_EQ(image.pixels.size(), 70u * 66u);
  for (const glm::vec4& pixel : image.pixels) {
    expect_colour(pixel, right, 2e-6);
    ASSERT_FLOAT_EQ(pixel.a, 1.0f);
  }
}

TEST(Media, DistancesAreMeasuredAlongTheRay) {
  const Scene scene = slabs({{0.0, 2.0}});
  const glm::ivec2 size(80, 60);
  const View view = view_from(scene, {0, 0, 10}, {0, 0, 0}, size);
  const Image image = render(scene, view, settings({medium("*", kExtinction)}), before_background())
                          .rendering.image;
  const double half = std::tan(std::numbers::pi / 6.0);
  const glm::dvec3 sigma(kExtinction);
  for (int v = 0; v < size.y; ++v) {
    for (int u = 0; u < size.x; ++u) {
      const double x = (u + 0.5 - size.x / 2.0) / (size.y / 2.0) * half;
      const double y = (v + 0.5 - size.y / 2.0) / (size.y / 2.0) * half;
      const glm::dvec3 right = RayOracle()
                                   .segment(2.0 * std::sqrt(1.0 + x * x + y * y), sigma,
                                            sigma * glm::dvec3(kAlbedo), kAmbient)
                                   .before(kBehind);
      expect_colour(image.pixels[static_cast<std::size_t>(v * size.x + u)], right, 5e-6);
    }
  }
}

TEST(Media, SplittingASegmentChangesNothing) {
  const NamedMedium all = medium("*", kExtinction);
  const Image one = from_above(slabs({{0.0, 2.0}}), settings({all}));
  const Image many =
      from_above(slabs({{0.0, 0.3}, {0.3, 0.35}, {0.35, 1.7}, {1.7, 2.0}}), settings({all}));
  EXPECT_LT(largest_step(one, many), 1e-6f);
  EXPECT_LT(one.pixels[0].r, 0.9f);
}

TEST(Media, TwiceTheExtinctionIsTwiceTheThickness) {
  const Image twice = from_above(slabs({{0.0, 2.0}}), settings({medium("*", 2.0f * kExtinction)}));
  const Image thick = from_above(slabs({{0.0, 4.0}}), settings({medium("*", kExtinction)}));
  EXPECT_LT(largest_step(twice, thick), 1e-6f);
}

TEST(Media, OverlapsAddUp) {
  const Scene scene = slabs({{0.0, 2.0}, {1.0, 3.5}, {1.5, 1.75}});
  const glm::vec3 other{0.9f, 0.1f, 0.0f}, third{0.0f, 2.0f, 0.5f};
  const glm::vec3 white{1.0f, 1.0f, 0.3f}, black{0.0f};
  const Image image =
      from_above(scene, settings({medium("slab0", kExtinction), medium("slab1", other, white),
                                  medium("slab2", third, black)}));
  const glm::dvec3 s0(kExtinction), s1(other), s2(third);
  const glm::dvec3 q0 = s0 * glm::dvec3(kAlbedo), q1 = s1 * glm::dvec3(white);
  const glm::dvec3 light(kAmbient);
  const glm::dvec3 right = RayOracle()
                               .segment(1.5, s1, q1, light)
                               .segment(0.25, s0 + s1, q0 + q1, light)
                               .segment(0.25, s0 + s1 + s2, q0 + q1, light)
                               .segment(0.5, s0 + s1, q0 + q1, light)
                               .segment(1.0, s0, q0, light)
                               .before(kBehind);
  for (const glm::vec4& pixel : image.pixels) expect_colour(pixel, right, 3e-6);
}

TEST(Media, SurfacesLieBetweenMedia) {
  Scene scene = slabs({{0.0, 2.0}});
  scene.objects[0].colour = {0.25f, 0.5f, 1.0f, 0.25f};
  add_object(scene, "pane", slab(0.5, 1.0), {1.0f, 0.5f, 0.0f, 0.5f});
  NamedMedium filled = medium("slab0", kExtinction);
  filled.medium.surface = true;
  const Image image = from_above(scene, settings({filled}));
  const double lit = eye_light({0, 0, 1});
  const glm::dvec3 s(kExtinction), q = s * glm::dvec3(kAlbedo), light(kAmbient);
  const glm::dvec3 shell = 0.25 * lit * glm::dvec3(0.25, 0.5, 1.0);
  const glm::dvec3 pane = 0.5 * lit * glm::dvec3(1.0, 0.5, 0.0);
  const glm::dvec3 right = RayOracle()
                               .surface(shell, 0.25)
                               .segment(1.0, s, q, light)
                               .surface(pane, 0.5)
                               .segment(0.5, s, q, light)
                               .surface(pane, 0.5)
                               .segment(0.5, s, q, light)
                               .surface(shell, 0.25)
                               .before(kBehind);
  for (const glm::vec4& pixel : image.pixels) expect_colour(pixel, right, 3e-6);
  filled.medium.surface_colour = glm::vec4(1.0f, 0.0f, 0.0f, 1.0f);
  const Image red = from_above(scene, settings({filled}));
  for (const glm::vec4& pixel : red.pixels) ASSERT_EQ(pixel, glm::vec4(lit, 0, 0, 1));
}

TEST(Media, OpaqueObjectsEndTheWalk) {
  Scene scene = slabs({{0.0, 2.0}, {-4.0, 1.0}});
  add_object(scene, "opaque", slab(-1.0, 0.5), {0.5f, 0.25f, 1.0f, 1.0f});
  const glm::vec3 other{0.2f, 0.0f, 0.4f};
  const Image image =
      from_above(scene, settings({medium("slab0", kExtinction), medium("slab1", other)}));
  const glm::dvec3 s0(kExtinction), s1(other), a(kAlbedo), light(kAmbient);
  const glm::dvec3 right =
      RayOracle()
          .segment(1.0, s0, s0 * a, light)
          .segment(0.5, s0 + s1, (s0 + s1) * a, light)
          .before(static_cast<double>(eye_light({0, 0, 1})) * glm::dvec3(0.5, 0.25, 1.0));
  for (const glm::vec4& pixel : image.pixels) {
    expect_colour(pixel, right, 3e-6);
    ASSERT_EQ(pixel.a, 1.0f);
  }
}

Scene random_spheres(int count, unsigned seed, bool with_opaque) {
  Scene scene;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-3.0, 3.0), radius(0.5, 3.0);
  for (int i = 0; i < count; ++i) {
    const double r = radius(random), x = place(random), y = place(random), z = place(random);
    add_object(scene, "ball" + std::to_string(i), moved(make_icosphere(r, 2), {x, y, z}),
               {0.8f, 0.3f, 0.5f, 0.4f});
  }
  if (with_opaque) {
    add_object(scene, "opaque", make_box({-1, -1, -1}, {2, 1, 0.5}), {0.9f, 0.6f, 0.3f, 1.0f});
  }
  return scene;
}

TEST(Media, AreNoBrighterThanTheirLights) {
  const Scene scene = random_spheres(12, 3, true);
  std::vector<NamedMedium> media;
  std::mt19937 random(4);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  for (int i = 0; i < 12; ++i) {
    media.push_back(medium("ball" + std::to_string(i),
                           2.0f * glm::vec3(unit(random), unit(random), unit(random)),
                           {unit(random), unit(random), 1.0f}));
  }
  const Image image = render(scene, view_from(scene, {9, 7, 8}, {0, 0, 0}, {90, 80}),
                             settings(media), before_background())
                          .rendering.image;
  int changed = 0;
  for (const glm::vec4& pixel : image.pixels) {
    // Behind: the background, or the opaque box, whose light is at most its colour.
    const glm::vec3 most(0.9f, 1.0f, 0.9f);
    for (int c = 0; c < 3; ++c) {
      ASSERT_LE(pixel[c], most[c] + 1e-5f);
      ASSERT_GE(pixel[c], 0.0f);
    }
    changed += pixel != kBackground ? 1 : 0;
  }
  EXPECT_GT(changed, 1000);
}

TEST(Media, WithoutExtinctionLeaveThePictureAsItIs) {
  Scene scene = random_spheres(10, 5, true);
  scene.objects[3].colour.a = 0.0f;
  MediaSettings none = settings({medium("*", glm::vec3(0.0f))});
  none.media[0].medium.surface = true;
  // The opaque one stays so: it holds no medium.
  none.media.clear();
  for (int i = 0; i < 10; ++i) {
    none.media.push_back(medium("ball" + std::to_string(i), glm::vec3(0.0f)));
    none.media.back().medium.surface = true;
  }
  none.particles.push_back({{0, 0, 0}, 2.0, glm::vec3(0.0f), glm::vec3(1.0f)});
  for (const int samples : {1, 4}) {
    FrameOptions options = before_background();
    options.background.a = 0.5f;
    options.samples = samples;
    for (const bool inside : {false, true}) {
      const glm::dvec3 eye = inside ? glm::dvec3(1, 1, 1.5) : glm::dvec3(9, 7, 8);
      const View view = view_from(scene, eye, {0, 0, 0}, {90, 80});
      const Image media = render(scene, view, none, options).rendering.image;
      auto frame = Frame::make(scene, view, options);
      ASSERT_TRUE(frame);
      const auto technique = find_technique("count-scan");
      ASSERT_TRUE(technique);
      const auto plain = frame->render(**technique);
      ASSERT_TRUE(plain);
      ASSERT_EQ(media.pixels.size(), plain->image.pixels.size());
      EXPECT_EQ(std::memcmp(media.pixels.data(), plain->image.pixels.data(),
                            media.pixels.size() * sizeof(glm::vec4)),
                0)
          << samples << " samples, inside " << inside;
    }
  }
}

TEST(Media, GiveTheSameBitsForAnyNumberOfThreads) {
  const Scene scene = random_spheres(20, 6, true);
  MediaSettings all = settings({medium("*", kExtinction)});
  for (int i = 0; i < 50; ++i) {
    all.particles.push_back({glm::dvec3(i % 5, i % 7, i % 3), 0.7, glm::vec3(0.5f, 0.1f, 0.2f)});
  }
  const View view = view_from(scene, {1, 1, 1}, {0, 0, 0}, {200, 130});
  const Image one = render(scene, view, all, {}, 1).rendering.image;
  for (const int threads : {2, 4}) {
    EXPECT_EQ(render(scene, view, all, {}, threads).rendering.image.pixels, one.pixels);
  }
}

TEST(Media, SumsReturnToExactlyNothing) {
  // Extinctions of very different sizes: in plain floats or doubles something would be left.
  Scene scene;
  MediaSettings all;
  std::mt19937 random(7);
  std::uniform_real_distribution<float> exponent(-6.0f, 6.0f), unit(0.0f, 1.0f);
  constexpr std::size_t kMedia = 200;
  for (std::size_t i = 0; i < kMedia; ++i) {
    scene.objects.push_back({"solid" + std::to_string(i), {}});
    all.media.push_back(medium(scene.objects.back().name,
                               glm::vec3(std::pow(10.0f, exponent(random)), unit(random), 0.1f),
                               {unit(random), 1.0f, 0.3f}));
  }
  const auto table = make_media_table(scene, all, {});
  ASSERT_TRUE(table);
  ASSERT_EQ(table->solids.size(), kMedia);
  std::vector<std::size_t> order(kMedia);
  for (std::size_t i = 0; i < kMedia; ++i) order[i] = i;
  double plain = 0.0;
  for (int round = 0; round < 20; ++round) {
    MediaSums sums;
    std::shuffle(order.begin(), order.end(), random);
    for (const std::size_t i : order) {
      sums.add(table->solids[i]);
      plain += static_cast<double>(all.media[i].medium.extinction.x);
    }
    EXPECT_FALSE(sums.vacuum());
    std::shuffle(order.begin(), order.end(), random);
    for (const std::size_t i : order) {
      sums.remove(table->solids[i]);
      plain -= static_cast<double>(all.media[i].medium.extinction.x);
    }
    EXPECT_TRUE(sums.vacuum());
  }
  EXPECT_NE(plain, 0.0);
}

TEST(Media, RayleighsPhaseFunctionIntegratesToOne) {
  const Scene scene = slabs({{0.0, 2.0}});
  MediaSettings lit = settings({medium("*", glm::vec3(30.0f), glm::vec3(1.0f))});
  lit.ambient = glm::vec3(0.0f);
  lit.light.radiance = {1.0f, 2.0f, 0.5f};
  const View view = view_from_above(scene, {1, 1});
  glm::dvec3 sum(0.0);
  constexpr int kSteps = 24;
  for (int i = 0; i < kSteps; ++i) {
    // In the cosine the integral is a quadratic one: the midpoints of steps have an error of 1/n^2.
    const double cosine = -1.0 + (i + 0.5) * 2.0 / kSteps;
    const double sine = std::sqrt(1.0 - cosine * cosine), turn = 0.7 * i;
    lit.light.at = glm::dvec3(sine * std::cos(turn), sine * std::sin(turn), cosine) * 3.0;
    const Image image = render(scene, view, lit).rendering.image;
    sum += glm::dvec3(image.pixels[0]) * (2.0 / kSteps * 2.0 * std::numbers::pi);
  }
  EXPECT_NEAR(sum.x, 1.0, 1e-3);
  EXPECT_NEAR(sum.y, 2.0, 2e-3);
  EXPECT_NEAR(sum.z, 0.5, 5e-4);
}

TEST(Media, AnEyeInsideSeesTheRestOfTheSolid) {
  // In two media at once; a third lies before the eye, and a fourth behind it.
  Scene scene;
  add_object(scene, "outer", make_box({-5, -5, -5}, {5, 5, 5}));
  add_object(scene, "inner", make_box({-2, -2, -3}, {2, 2, 2}));
  add_object(scene, "before", make_box({-1.9, -1.9, -3.5}, {1.9, 1.9, -3.25}));
  add_object(scene, "behind", make_box({-1, -1, 3}, {1, 1, 4}));
  const glm::vec3 s_outer{0.1f, 0.2f, 0.05f}, s_inner{0.3f, 0.0f, 0.2f}, s_before{1.0f, 2.0f, 0.5f};
  const MediaSettings all =
      settings({medium("outer", s_outer), medium("inner", s_inner), medium("before", s_before),
                medium("behind", glm::vec3(5.0f))});
  const glm::ivec2 size(64, 64);
  const View view = view_from(scene, {0, 0, 1}, {0, 0, -1}, size);
  ASSERT_TRUE(view.cut_short);
  const MediaRendering seen = render(scene, view, all, before_background());
  const glm::vec4& pixel = seen.rendering.image.pixels[32 * 64 + 32];
  const glm::dvec3 o(s_outer), i(s_inner), b(s_before), a(kAlbedo), light(kAmbient);
  const double along =
      std::sqrt(1.0 + 2.0 * std::pow(0.5 / 32.0 * std::tan(std::numbers::pi / 6.0), 2));
  const glm::dvec3 right = RayOracle()
                               .segment(4.0 * along, o + i, (o + i) * a, light)
                               .segment(0.25 * along, o, o * a, light)
                               .segment(0.25 * along, o + b, (o + b) * a, light)
                               .segment(1.5 * along, o, o * a, light)
                               .before(kBehind);
  // A depth step at the far end is 6 * 1024 / 2^24 units; the near plane is 0.006 away.
  expect_colour(pixel, right, 5e-5);
  for (const SolidReport& report : seen.solids) EXPECT_EQ(report.unbalanced_pixels, 0u);
  EXPECT_EQ(seen.solids[0].object, "outer");
  EXPECT_EQ(seen.solids[0].pixels, 64u * 64u);
  EXPECT_EQ(seen.solids[3].pixels, 0u);
}

TEST(Media, AnEyeThatMovesThroughAWallSeesNoJump) {
  Scene scene;
  add_object(scene, "ball", make_icosphere(2.0, 4));
  add_object(scene, "pool", make_box({-3, -3, -4}, {3, 3, -1}));
  const MediaSettings all =
      settings({medium("ball", kExtinction), medium("pool", glm::vec3(0.4f))});
  Image last;
  float largest = 0.0f, total = 0.0f;
  constexpr double kStep = 0.01;
  for (double z = 2.3; z > 1.6; z -= kStep) {
    const View view = view_from(scene, {0.3, 0.2, z}, {0.2, 0.1, -3}, {48, 40});
    Image image = render(scene, view, all, before_background()).rendering.image;
    if (!last.pixels.empty()) {
      largest = std::max(largest, largest_step(last, image));
      total += largest_step(last, image);
    }
    last = std::move(image);
  }
  // A step changes the optical depth by at most 1.5 a unit along the ray, as long as the ray meets
  // the ball steeply; at its rim that is more.
  EXPECT_LT(largest, 0.06f);
  EXPECT_GT(total, 0.1f);
}

/// Where a ray meets a triangle; below 0: nowhere. T. Moeller, B. Trumbore (1997).
double hit(const glm::dvec3& from, const glm::dvec3& along, const glm::dvec3& a,
           const glm::dvec3& b, const glm::dvec3& c) {
  const glm::dvec3 e = b - a, f = c - a, p = glm::cross(along, f);
  const double det = glm::dot(e, p);
  if (std::abs(det) < 1e-14) return -1.0;
  const glm::dvec3 s = (from - a) / det, q = glm::cross(s, e);
  const double u = glm::dot(s, p), v = glm::dot(along, q);
  return u < 0 || v < 0 || u + v > 1 ? -1.0 : glm::dot(f, q);
}

/// Where a ray meets the triangle or the ball of a medium.
struct Crossing {
  double at;
  std::size_t medium;  // solids, then particles
};

/// The crossings of a ray with balls. @param inside  of each ball: whether the ray begins there
std::vector<Crossing> ball_crossings(const MediaSettings& media, std::size_t solids,
                                     const glm::dvec3& from, const glm::dvec3& along,
                                     std::vector<bool>& inside) {
  std::vector<Crossing> found;
  for (std::size_t i = 0; i < media.particles.size(); ++i) {
    const Particle& ball = media.particles[i];
    const glm::dvec3 to = from - ball.centre;
    const double b = glm::dot(to, along);
    const double root = b * b - glm::dot(to, to) + ball.radius * ball.radius;
    if (root <= 0.0) continue;
    for (const double distance : {-b - std::sqrt(root), -b + std::sqrt(root)}) {
      if (distance > 0.0) found.push_back({distance, solids + i});
    }
    inside[solids + i] = -b - std::sqrt(root) <= 0.0 && -b + std::sqrt(root) > 0.0;
  }
  return found;
}

/// A picture's colour by brute force: every ray with every triangle and every ball, in doubles.
glm::dvec3 traced(const Scene& scene, const MediaSettings& media, const glm::dvec3& from,
                  const glm::dvec3& along) {
  const std::size_t solids = scene.objects.size();
  std::vector<bool> inside(solids + media.particles.size(), false);
  std::vector<Crossing> events = ball_crossings(media, solids, from, along, inside);
  double opaque = 1e9;
  glm::dvec3 behind = kBehind;
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    const glm::uvec3& of = scene.mesh.triangles[t];
    const auto& at = scene.mesh.positions;
    const double distance = hit(from, along, at[of.x], at[of.y], at[of.z]);
    if (distance <= 0.0) continue;
    const std::size_t object = scene.object_of[t];
    if (scene.objects[object].colour.a < 1.0f) {
      events.push_back({distance, object});
      if (scene.objects[object].name != "pane") inside[object] = !inside[object];
    } else if (distance < opaque) {
      opaque = distance;
      behind = glm::dvec3(scene.objects[object].colour);
    }
  }
  std::sort(events.begin(), events.end(),
            [](const Crossing& a, const Crossing& b) { return a.at < b.at; });
  RayOracle ray;
  double at = 0.0;
  const auto move_to = [&](double distance) {
    glm::dvec3 s(0.0), q(0.0);
    for (std::size_t i = 0; i < inside.size(); ++i) {
      if (!inside[i]) continue;
      const glm::dvec3 of(i < solids ? media.media[i].medium.extinction
                                     : media.particles[i - solids].extinction);
      s += of;
      q += of * glm::dvec3(i < solids ? media.media[i].medium.albedo
                                      : media.particles[i - solids].albedo);
    }
    ray.segment(distance - at, s, q, media.ambient);
    at = distance;
  };
  for (const Crossing& event : events) {
    if (event.at > opaque) break;
    move_to(event.at);
    if (event.medium < solids && scene.objects[event.medium].name == "pane") {
      const glm::dvec4 colour(scene.objects[event.medium].colour);
      ray.surface(glm::dvec3(colour) * colour.a, colour.a);
    } else {
      inside[event.medium] = !inside[event.medium];
    }
  }
  if (opaque < 1e9) move_to(opaque);
  return ray.before(behind);
}

TEST(Media, EqualWhatIsTracedByBruteForce) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(-2.0, 2.0), size(0.3, 1.8);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  const auto colour = [&] { return glm::vec3(unit(random), unit(random), unit(random)); };
  for (int round = 0; round < 12; ++round) {
    Scene scene;
    MediaSettings media;
    media.ambient = kAmbient;
    const auto position = [&] {
      const double x = place(random), y = place(random);
      return glm::dvec3(x, y, place(random));
    };
    for (int i = 0; i < 5; ++i) {
      const double r = size(random);
      const TriangleSoup solid = i % 2 == 0 ? make_icosphere(r, 1) : make_torus(r, 0.3 * r, 12, 7);
      add_object(scene, "solid" + std::to_string(i), moved(solid, position()));
      media.media.push_back(medium(scene.objects.back().name, colour(), colour()));
    }
    // Surfaces with one brightness from all sides are not to be had: these are black.
    TriangleSoup pane = make_icosphere(1.0, 0);
    pane.triangles.resize(7);
    add_object(scene, "pane", moved(pane, position()), {0, 0, 0, 0.4f});
    add_object(scene, "opaque", moved(make_icosphere(size(random) * 0.6, 1), position()),
               {0, 0, 0, 1});
    for (int i = 0; i < 6; ++i) {
      media.particles.push_back({position(), size(random) * 0.6, colour(), colour()});
    }
    // Outside, and in the midst of it.
    const glm::dvec3 eye = round % 2 == 0 ? glm::dvec3(6, 4, 3) : 0.5 * position();
    const glm::dvec3 target = round % 2 == 0 ? glm::dvec3(0.1) : position();
    constexpr int kSide = 40;
    const View view = view_from(scene, eye, target, {kSide, kSide});
    const MediaRendering seen = render(scene, view, media, before_background());
    for (const SolidReport& report : seen.solids) EXPECT_EQ(report.unbalanced_pixels, 0u);
    const glm::dmat3 world_from_eye =
        glm::transpose(glm::dmat3(eye_from_world(look_at(eye, target))));
    int wrong = 0, filled = 0;
    for (int i = 0; i < kSide * kSide; ++i) {
      const double half = std::tan(std::numbers::pi / 6.0) / (kSide / 2.0);
      const glm::dvec3 along(((i % kSide) + 0.5 - kSide / 2.0) * half,
                             -((i / kSide) + 0.5 - kSide / 2.0) * half, -1.0);
      const glm::dvec3 right = traced(scene, media, eye, world_from_eye * glm::normalize(along));
      const glm::vec4& pixel = seen.rendering.image.pixels[static_cast<std::size_t>(i)];
      double difference = 0.0;
      for (int c = 0; c < 3; ++c) difference = std::max(difference, std::abs(pixel[c] - right[c]));
      wrong += difference > 2e-3 ? 1 : 0;
      filled += glm::length(right - kBehind) > 0.05 ? 1 : 0;
    }
    // Edges are snapped to 1/256 of a pixel, so a ray beside one may fall to its other side.
    EXPECT_LE(wrong, 8) << "round " << round;
    EXPECT_GT(filled, 50) << "round " << round;
  }
}

TEST(Media, SolidsThatAreNotClosedAreNamed) {
  Scene scene;
  add_object(scene, "whole", slab(3.0, 4.0));
  TriangleSoup open = make_box({-4, -4, 0}, {4, 4, 2});
  // Without the upper right half of its top.
  std::size_t removed = 0;
  for (std::size_t t = 0; t < open.triangles.size(); ++t) {
    const auto& triangle = open.triangles[t];
    bool top = true;
    for (int c = 0; c < 3; ++c) top = top && open.positions[triangle[c]].z == 2.0;
    if (!top) continue;
    open.triangles.erase(open.triangles.begin() + static_cast<std::ptrdiff_t>(t));
    ++removed;
    break;
  }
  ASSERT_EQ(removed, 1u);
  add_object(scene, "leaky", open);
  const View view = view_from_above(scene, {64, 64});
  const MediaRendering seen = render(
      scene, view, settings({medium("whole", kExtinction), medium("leaky", glm::vec3(0.5f))}),
      before_background());
  ASSERT_EQ(seen.solids.size(), 2u);
  EXPECT_EQ(seen.solids[0].object, "whole");
  EXPECT_EQ(seen.solids[0].unbalanced_pixels, 0u);
  EXPECT_EQ(seen.solids[1].object, "leaky");
  EXPECT_EQ(seen.solids[1].pixels, 32u * 32u);
  // Half of the square's pixels, and the diagonal goes to one side.
  EXPECT_NEAR(static_cast<double>(seen.solids[1].unbalanced_pixels), 512.0, 16.0);
  // There its medium is left out.
  const glm::dvec3 s(kExtinction), l(0.5), a(kAlbedo), light(kAmbient);
  const glm::dvec3 without = RayOracle().segment(1.0, s, s * a, light).before(kBehind);
  const glm::dvec3 with =
      RayOracle().segment(1.0, s, s * a, light).segment(2.0, l, l * a, light).before(kBehind);
  std::uint64_t left_out = 0, filled = 0;
  for (const glm::vec4& pixel : seen.rendering.image.pixels) {
    const double to_without = std::abs(pixel.r - without.r), to_with = std::abs(pixel.r - with.r);
    ASSERT_LT(std::min(to_without, to_with), 1e-5);
    left_out += to_without < to_with ? 1 : 0;
    filled += to_with < to_without ? 1 : 0;
  }
  EXPECT_EQ(filled, 32u * 32u - seen.solids[1].unbalanced_pixels);
  EXPECT_EQ(left_out, 64u * 64u - filled);
}

TEST(Media, InsideOutSolidsHoldTheirMediumToo) {
  Scene scene = slabs({{0.0, 2.0}});
  const Image image = from_above(scene, settings({medium("*", kExtinction)}));
  reverse_orientation(scene.mesh);
  const Image inside_out = from_above(scene, settings({medium("*", kExtinction)}));
  EXPECT_EQ(image.pixels, inside_out.pixels);
}

TEST(Media, AreFoundByNamesAndPatterns) {
  Scene scene;
  for (const char* name : {"cube at a.csg:1:5", "cube at a.csg:22:5", "ball.obj", "a*b", ""}) {
    scene.objects.push_back({name, {}});
  }
  const auto chosen = [&](std::vector<std::string> patterns) {
    MediaSettings all;
    for (std::size_t i = 0; i < patterns.size(); ++i) {
      all.media.push_back(medium(patterns[i], glm::vec3(static_cast<float>(i + 1))));
    }
    const auto table = make_media_table(scene, all, {});
    std::string found;
    if (!table) return table.error().message;
    for (const std::uint32_t solid : table->medium_of) {
      found += solid == MediaTable::kNone
                   ? "-"
                   : std::to_string(static_cast<int>(table->solids[solid].extinction[0][0]));
    }
    return found;
  };
  EXPECT_EQ(chosen({"*"}), "11111");
  EXPECT_EQ(chosen({"cube*"}), "11---");
  EXPECT_EQ(chosen({"*", "cube*", "*:22:*"}), "23111");
  EXPECT_EQ(chosen({"cube*", "cube at*:22:*"}), "12---");
  EXPECT_EQ(chosen({"*ball.obj*", "ball.obj"}), "--2--");
  EXPECT_EQ(chosen({"a*b", "a***b"}), "---1-");
  EXPECT_EQ(chosen({""}), "----1");
  EXPECT_EQ(chosen({"*.ob", "*"}).substr(0, 60),
            "a medium is for '*.ob', but no object has this name; the obj");
  EXPECT_NE(chosen({"cube"}).find("'cube at a.csg:1:5', 'cube at a.csg:22:5'"), std::string::npos);
}

TEST(Media, RefuseWhatIsOutOfRange) {
  const Scene scene = slabs({{0.0, 2.0}});
  const View view = view_from_above(scene, {8, 8});
  const auto message = [&](const MediaSettings& of) {
    const auto rendering = render_media(scene, view, of);
    return rendering ? std::string() : rendering.error().message;
  };
  EXPECT_EQ(message(settings({medium("slab0", kExtinction)})), "");
  EXPECT_NE(message(settings({medium("fog", kExtinction)})).find("'fog'"), std::string::npos);
  EXPECT_NE(message(settings({medium("slab0", {0.0f, -1.5f, 0.0f})}))
                .find("green part of the extinction"),
            std::string::npos);
  EXPECT_NE(message(settings({medium("slab0", {0.0f, NAN, 0.0f})})).find("nan"), std::string::npos);
  EXPECT_NE(message(settings({medium("slab0", kExtinction, {0, 0, 1.25f})})).find("got 1.25"),
            std::string::npos);
  MediaSettings particles = settings({});
  particles.particles.resize(3);
  particles.particles[2].radius = 0.0;
  EXPECT_NE(message(particles).find("particle 2"), std::string::npos);
  MediaSettings light = settings({});
  light.light.at = glm::dvec3(0.0);
  EXPECT_NE(message(light).find("direction"), std::string::npos);
}

}  // namespace
}  // namespace strata::transparency
