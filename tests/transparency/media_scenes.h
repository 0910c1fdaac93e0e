#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "strata/mesh/shapes.h"
#include "strata/transparency/media/media.h"

// Scenes with media, and what a ray through them must show, computed without the library.

namespace strata::transparency {

/// Adds an object to a scene.
inline void add_object(Scene& scene, const std::string& name, const TriangleSoup& mesh,
                       const glm::vec4& colour = {0.7f, 0.7f, 0.7f, 0.5f}) {
  append(scene.mesh, mesh);
  scene.object_of.resize(scene.mesh.triangles.size(),
                         static_cast<std::uint32_t>(scene.objects.size()));
  scene.objects.push_back({name, colour});
}

inline TriangleSoup moved(const TriangleSoup& mesh, const glm::dvec3& by) {
  glm::dmat4 m(1.0);
  m[3] = glm::dvec4(by, 1.0);
  return transform(mesh, m);
}

/// From above, along -z; a world unit is `scale` pixels.
inline View view_from_above(const Scene& scene, const glm::ivec2& size, double scale = 4.0) {
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = glm::dvec3(0.0);
  camera.field_of_view = 90.0;
  camera.distance = size.y / 2.0 / scale;
  auto view = make_view(camera, size, bounds(scene.mesh));
  EXPECT_TRUE(view);
  return *view;
}

/// A perspective view from `eye` to `target`, 60 degrees high.
inline View view_from(const Scene& scene, const glm::dvec3& eye, const glm::dvec3& target,
                      const glm::ivec2& size) {
  Camera camera = look_at(eye, target);
  camera.field_of_view = 60.0;
  auto view = make_view(camera, size, bounds(scene.mesh));
  EXPECT_TRUE(view);
  return *view;
}

inline MediaRendering render(const Scene& scene, const View& view, const MediaSettings& settings,
                             const FrameOptions& options = {}, int threads = 2) {
  Execution execution;
  execution.threads = threads;
  auto rendering = render_media(scene, view, settings, options, execution);
  if (!rendering) {
    ADD_FAILURE() << rendering.error().message;
    return {};
  }
  return std::move(*rendering);
}

/// The equation of radiative transfer along a ray, from the front to the back, in doubles.
struct RayOracle {
  glm::dvec3 colour{0.0}, through{1.0};

  /// A segment with the sums of extinction, and of extinction times albedo, and a light.
  RayOracle& segment(double length, const glm::dvec3& s, const glm::dvec3& q,
                     const glm::dvec3& light) {
    for (int c = 0; c < 3; ++c) {
      const double t = std::exp(-s[c] * length);
      if (s[c] > 0.0) colour[c] += through[c] * q[c] / s[c] * light[c] * (1.0 - t);
      through[c] *= t;
    }
    return *this;
  }
  RayOracle& surface(const glm::dvec3& premultiplied, double opacity) {
    colour += through * premultiplied;
    through *= 1.0 - opacity;
    return *this;
  }
  [[nodiscard]] glm::dvec3 before(const glm::dvec3& background) const {
    return colour + through * background;
  }
};

inline void expect_colour(const glm::vec4& pixel, const glm::dvec3& colour, double tolerance,
                          const std::string& what = {}) {
  for (int c = 0; c < 3; ++c)
    ASSERT_NEAR(pixel[c], colour[c], tolerance) << what << " channel " << c;
}

inline float largest_step(const Image& a, const Image& b) {
  float largest = a.pixels.size() == b.pixels.size() ? 0.0f : 1e9f;
  for (std::size_t i = 0; i < std::min(a.pixels.size(), b.pixels.size()); ++i) {
    for (int c = 0; c < 4; ++c) {
      largest = std::max(largest, std::abs(a.pixels[i][c] - b.pixels[i][c]));
    }
  }
  return largest;
}

}  // namespace strata::transparency
