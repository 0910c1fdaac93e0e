#include "apps/view/scene/camera_control.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>

namespace strata::view {
namespace {

constexpr double kDegreesPerPixel = 0.7;
constexpr double kZoomStep = 0.9;
constexpr double kNearest = 1e-9, kFarthest = 1e12;

struct NamedRotation {
  std::string_view name;
  NamedView view;
  glm::dvec3 rotation;
};
constexpr NamedRotation kViews[] = {{"top", NamedView::kTop, {0, 0, 0}},
                                    {"bottom", NamedView::kBottom, {180, 0, 0}},
                                    {"left", NamedView::kLeft, {90, 0, 270}},
                                    {"right", NamedView::kRight, {90, 0, 90}},
                                    {"front", NamedView::kFront, {90, 0, 0}},
                                    {"back", NamedView::kBack, {90, 0, 180}},
                                    {"diagonal", NamedView::kDiagonal, {55, 0, 25}}};

/// World directions of the screen's right, up, and towards the eye.
glm::dmat3 screen_axes(const Camera& camera) {
  return glm::transpose(glm::dmat3(eye_from_world(camera)));
}

double turned(double degrees) {
  const double rest = std::fmod(degrees, 360.0);
  return rest < 0 ? rest + 360.0 : rest;
}

/// From the picture's middle, y upwards.
glm::dvec2 from_middle(const glm::dvec2& pixel, const glm::ivec2& size) {
  return {pixel.x - size.x * 0.5, size.y * 0.5 - pixel.y};
}

}  // namespace

std::optional<NamedView> find_named_view(std::string_view name) {
  for (const NamedRotation& one : kViews) {
    if (one.name == name) return one.view;
  }
  return {};
}

void look_from(Camera& camera, NamedView view) {
  for (const NamedRotation& one : kViews) {
    if (one.view == view) camera.rotation = one.rotation;
  }
}

void orbit(Camera& camera, const glm::dvec2& pixels) {
  camera.rotation.x = turned(camera.rotation.x - pixels.y * kDegreesPerPixel);
  camera.rotation.z = turned(camera.rotation.z - pixels.x * kDegreesPerPixel);
}

double world_per_pixel(const Camera& camera, const glm::ivec2& size) {
  return 2.0 * camera.distance * std::tan(glm::radians(camera.field_of_view) / 2.0) /
         std::max(1, size.y);
}

void pan(Camera& camera, const glm::dvec2& pixels, const glm::ivec2& size) {
  const glm::dmat3 axes = screen_axes(camera);
  camera.target -= (axes[0] * pixels.x - axes[1] * pixels.y) * world_per_pixel(camera, size);
}

void zoom(Camera& camera, double steps, const glm::dvec2& cursor, const glm::ivec2& size) {
  const double before = world_per_pixel(camera, size);
  camera.distance = std::clamp(camera.distance * std::pow(kZoomStep, steps), kNearest, kFarthest);
  const double gone = before - world_per_pixel(camera, size);
  const glm::dmat3 axes = screen_axes(camera);
  const glm::dvec2 at = from_middle(cursor, size);
  camera.target += (axes[0] * at.x + axes[1] * at.y) * gone;
}

void view_all(Camera& camera, const Bounds& box, const glm::ivec2& size) {
  if (box.empty()) return;
  centre_camera(camera, box);
  frame_camera(camera, box, static_cast<double>(size.x) / std::max(1, size.y));
  // A point has no size to fit.
  if (!(camera.distance > 0)) camera.distance = Camera{}.distance;
}

std::optional<glm::dvec2> project(const Camera& camera, const glm::ivec2& size,
                                  const glm::dvec3& world) {
  const glm::dvec3 eye = eye_from_world(camera) * glm::dvec4(world, 1.0);
  const bool perspective = camera.projection == Projection::kPerspective;
  if (perspective && !(-eye.z > 1e-6 * camera.distance)) return {};
  const double scale =
      1.0 / world_per_pixel(camera, size) * (perspective ? camera.distance / -eye.z : 1.0);
  return glm::dvec2(size.x * 0.5 + eye.x * scale, size.y * 0.5 - eye.y * scale);
}

double slide(const Camera& camera, const glm::ivec2& size, const glm::dvec3& point,
             const glm::dvec3& direction, const glm::dvec2& pixels) {
  const double unit = world_per_pixel(camera, size);
  const glm::dmat3 axes = screen_axes(camera);
  // The picture of one world unit, in world units across the screen.
  const glm::dvec2 along(glm::dot(axes[0], direction), -glm::dot(axes[1], direction));
  const double length = glm::length(along);
  constexpr double kTooShort = 0.2;
  if (length < kTooShort) return -pixels.y * unit;
  double scale = 1.0;
  if (camera.projection == Projection::kPerspective) {
    const glm::dvec3 eye = eye_from_world(camera) * glm::dvec4(point, 1.0);
    scale = std::clamp(-eye.z / camera.distance, 0.01, 100.0);
  }
  return glm::dot(pixels, along) / (length * length) * unit * scale;
}

glm::dvec3 world_of(const View& view, const glm::dvec2& pixel_centre, double depth) {
  const glm::dvec4 world =
      glm::inverse(view.image_from_world) * glm::dvec4(pixel_centre, depth, 1.0);
  return glm::dvec3(world) / world.w;
}

}  // namespace strata::view
