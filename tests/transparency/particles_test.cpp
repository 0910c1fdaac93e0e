// Spherical particles: chords, overlaps, the same walk as that of solids.

#include <algorithm>
#include <glm/exponential.hpp>
#include <glm/trigonometric.hpp>
#include <random>

#include "tests/transparency/media_scenes.h"

namespace strata::transparency {
namespace {

const glm::vec4 kWhite{1.0f};

FrameOptions before_white() {
  FrameOptions options;
  options.background = kWhite;
  return options;
}

/// Particles that only absorb, before white: a picture of the transmittance.
Image transmittance(const Scene& scene, const View& view, std::vector<Particle> particles) {
  MediaSettings settings;
  settings.particles = std::move(particles);
  for (Particle& p : settings.particles) p.albedo = glm::vec3(0.0f);
  return render(scene, view, settings, before_white()).rendering.image;
}

/// The length of the ray o + t d, |d| = 1, t in [0, end], within a ball.
double chord(const glm::dvec3& o, const glm::dvec3& d, const Particle& ball, double end) {
  const glm::dvec3 from = o - ball.centre;
  const double b = glm::dot(from, d), c = glm::dot(from, from) - ball.radius * ball.radius;
  const double root = b * b - c;
  if (root <= 0) return 0.0;
  const double low = std::max(0.0, -b - std::sqrt(root)),
               high = std::min(end, -b + std::sqrt(root));
  return std::max(0.0, high - low);
}

/// Looks from `eye` along -x, z up, 60 degrees high.
struct Eye {
  glm::dvec3 at{10, 0, 0};
  glm::ivec2 size{90, 70};

  [[nodiscard]] View view(const Scene& scene) const {
    return view_from(scene, at, at - glm::dvec3(1, 0, 0), size);
  }
  [[nodiscard]] glm::dvec3 direction(int u, int v) const {
    const double half = std::tan(glm::radians(30.0)) / (size.y / 2.0);
    return glm::normalize(
        glm::dvec3(-1.0, (u + 0.5 - size.x / 2.0) * half, -(v + 0.5 - size.y / 2.0) * half));
  }
};

TEST(Particles, HaveTheirChords) {
  std::vector<Particle> balls;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-4.0, 4.0), radius(0.05, 2.0);
  std::uniform_real_distribution<float> extinction(0.0f, 0.5f);
  for (int i = 0; i < 60; ++i) {
    balls.push_back({glm::dvec3(place(random), place(random), place(random)), radius(random),
                     glm::vec3(extinction(random), extinction(random), extinction(random))});
  }
  // One around the eye, one beside it, one behind it.
  const Eye eye;
  balls.push_back({eye.at + glm::dvec3(0.2, 0.1, 0), 1.0, glm::vec3(0.3f, 0.1f, 0.2f)});
  balls.push_back({eye.at + glm::dvec3(0.1, 2.0, 0), 1.9, glm::vec3(0.2f, 0.2f, 0.1f)});
  balls.push_back({eye.at + glm::dvec3(9, 0, 0), 2.0, glm::vec3(9.0f)});
  const Scene scene;
  const Image image = transmittance(scene, eye.view(scene), balls);
  int dark = 0;
  for (int v = 0; v < eye.size.y; ++v) {
    for (int u = 0; u < eye.size.x; ++u) {
      glm::dvec3 depth(0.0);
      for (const Particle& ball : balls) {
        depth += glm::dvec3(ball.extinction) * chord(eye.at, eye.direction(u, v), ball, 1e9);
      }
      const glm::vec4& pixel = image.pixels[static_cast<std::size_t>(v * eye.size.x + u)];
      expect_colour(pixel, glm::exp(-depth), 3e-6);
      dark += pixel.r < 0.8f ? 1 : 0;
    }
  }
  EXPECT_GT(dark, 1000);
}

TEST(Particles, OfOrthographicViewsHaveTheirChordsToo) {
  const Scene scene;
  const std::vector<Particle> balls{{{1, 2, 0}, 3.0, glm::vec3(0.2f)},
                                    {{0, 1, 50}, 2.0, glm::vec3(0.3f)},
                                    {{-2, 0, -70}, 4.0, glm::vec3(0.1f)}};
  const View view = view_from_above(scene, {60, 50});
  const Image image = transmittance(scene, view, balls);
  for (int v = 0; v < 50; ++v) {
    for (int u = 0; u < 60; ++u) {
      const glm::dvec3 from((u + 0.5 - 30) / 4.0, -(v + 0.5 - 25) / 4.0, 1000.0);
      double depth = 0.0;
      for (const Particle& ball : balls) {
        depth += static_cast<double>(ball.extinction.x) * chord(from, {0, 0, -1}, ball, 1e9);
      }
      expect_colour(image.pixels[static_cast<std::size_t>(v * 60 + u)],
                    glm::dvec3(std::exp(-depth)), 1e-5);
    }
  }
}

TEST(Particles, ThatSwapTheirOrderDoNotPop) {
  // Along the rays of an orthographic view, so that their images stay where they are.
  const Scene scene;
  const View view = view_from_above(scene, {20, 20});
  MediaSettings settings;
  settings.ambient = glm::vec3(1.0f);
  settings.particles = {{{0, 0, 0}, 1.0, glm::vec3(2.0f), {1.0f, 0.1f, 0.0f}},
                        {{0, 0.3, 0}, 1.0, glm::vec3(1.0f), {0.0f, 0.9f, 1.0f}}};
  Image last, first;
  constexpr double kStep = 0.02;
  float largest = 0.0f;
  for (double z = -2.0; z < 2.0; z += kStep) {
    settings.particles[1].centre.z = z;
    Image image = render(scene, view, settings).rendering.image;
    if (!last.pixels.empty()) largest = std::max(largest, largest_step(last, image));
    if (first.pixels.empty()) first = image;
    last = std::move(image);
  }
  // The colour of a point of a ray changes by at most its extinction times the step.
  EXPECT_LT(largest, 2.0f * static_cast<float>(kStep));
  EXPECT_GT(largest, 0.001f);
  EXPECT_GT(largest_step(first, last), 0.2f);
}

TEST(Particles, FadeBehindAnOpaquePlane) {
  Scene scene;
  add_object(scene, "wall", make_box({-5, -40, -40}, {0, 40, 40}), {1, 1, 1, 1});
  const Eye eye;
  const double wall = eye_light({0, 0, 1});
  float last = 2.0f;
  for (double x = -1.5; x < 1.5; x += 0.05) {
    const Particle ball{{x, 0, 0}, 1.0, glm::vec3(0.8f)};
    const Image image = transmittance(scene, eye.view(scene), {ball});
    const int u = 45, v = 35;
    const glm::dvec3 d = eye.direction(u, v);
    const double end = 10.0 / -d.x;
    const glm::vec4& pixel = image.pixels[static_cast<std::size_t>(v * eye.size.x + u)];
    const double right =
        std::exp(-static_cast<double>(ball.extinction.x) * chord(eye.at, d, ball, end));
    ASSERT_NEAR(pixel.r, wall * right, 1e-5) << x;
    ASSERT_LE(pixel.r, last + 1e-6f);
    last = pixel.r;
  }
  EXPECT_LT(last, 0.5f);
}

TEST(Particles, AddUpWithTheSolidsTheyAreIn) {
  Scene scene;
  add_object(scene, "cloud", make_box({-2, -40, -40}, {2, 40, 40}));
  const Eye eye;
  MediaSettings settings;
  settings.media = {{"cloud", {glm::vec3(0.5f), glm::vec3(1.0f)}}};
  settings.particles = {{{2, 0, 0}, 1.0, glm::vec3(0.75f), glm::vec3(0.0f)}};
  const Image image = render(scene, eye.view(scene), settings, before_white()).rendering.image;
  const int u = 44, v = 36;
  const glm::dvec3 d = eye.direction(u, v);
  const double along = 1.0 / -d.x;
  const double ball = chord(eye.at, d, settings.particles[0], 1e9);
  const double in_front = chord(eye.at, d, settings.particles[0], 8.0 * along);
  const glm::dvec3 cloud(0.5), drop(0.75), none(0.0), light(1.0);
  const glm::dvec3 right = RayOracle()
                               .segment(in_front, drop, none, light)
                               .segment(ball - in_front, cloud + drop, cloud, light)
                               .segment(4.0 * along - (ball - in_front), cloud, cloud, light)
                               .before(glm::dvec3(1.0));
  expect_colour(image.pixels[static_cast<std::size_t>(v * eye.size.x + u)], right, 1e-5);
}

}  // namespace
}  // namespace strata::transparency
