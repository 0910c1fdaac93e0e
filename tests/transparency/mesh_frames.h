#pragma once

#include <gtest/gtest.h>

#include <initializer_list>
#include <utility>
#include <vector>

#include "strata/mesh/soup_tools.h"
#include "strata/transparency/techniques.h"

// Frames of triangles for tests.

namespace strata::transparency {

/// Adds a mesh as an object of its own.
inline void add_object(Scene& scene, const TriangleSoup& mesh, const glm::vec4& colour) {
  const auto object = static_cast<std::uint32_t>(scene.objects.size());
  scene.object_of.insert(scene.object_of.end(), mesh.triangles.size(), object);
  append(scene.mesh, mesh);
  scene.objects.push_back({"object " + std::to_string(object), colour});
}

/// The corners of a flat convex face, as triangles.
inline TriangleSoup face(const std::vector<glm::dvec3>& corners) {
  TriangleSoup mesh;
  mesh.positions = corners;
  for (std::uint32_t i = 2; i < corners.size(); ++i) mesh.triangles.emplace_back(0, i - 1, i);
  return mesh;
}

/// A square of 18 about the z axis.
inline TriangleSoup square_at(double z) {
  return face({{-9, -9, z}, {9, -9, z}, {9, 9, z}, {-9, 9, z}});
}

inline Frame frame_of(const Scene& scene, const Camera& camera, glm::ivec2 size, int samples = 1) {
  FrameOptions options;
  options.samples = samples;
  auto view = make_view(camera, size, bounds(scene.mesh));
  EXPECT_TRUE(view) << (view ? "" : view.error().message);
  auto frame = Frame::make(scene, *view, options);
  EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
  return std::move(*frame);
}

/// Seen without perspective.
inline Camera flat_camera(const glm::dvec3& rotation = glm::dvec3(0.0)) {
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = rotation;
  camera.distance = 10.0;
  return camera;
}

inline Rendering rendered(const Frame& frame, std::string_view name, const Settings& settings = {},
                          int threads = 2) {
  const auto technique = find_technique(name);
  Execution execution;
  execution.threads = threads;
  auto rendering = frame.render(**technique, settings, execution);
  if (!rendering) {
    ADD_FAILURE() << name << ": " << rendering.error().message;
    return {};
  }
  return std::move(*rendering);
}

}  // namespace strata::transparency
