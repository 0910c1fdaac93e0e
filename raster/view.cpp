#include "strata/raster/view.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>

namespace strata {
namespace {

/// With something behind or beside the eye the depth range starts at this part of its end: nearer,
/// and the reciprocal depth would leave too few steps for the far end.
constexpr double kNearestPart = 1.0 / 1024.0;

double half_height(const Camera& camera) {
  return camera.distance * std::tan(glm::radians(camera.field_of_view) / 2.0);
}

glm::dvec3 corner(const Bounds& box, int i) {
  return {(i & 1) != 0 ? box.high.x : box.low.x, (i & 2) != 0 ? box.high.y : box.low.y,
          (i & 4) != 0 ? box.high.z : box.low.z};
}

}  // namespace

Camera look_at(const glm::dvec3& eye, const glm::dvec3& centre) {
  Camera camera;
  camera.target = centre;
  const glm::dvec3 away = eye - centre;
  camera.distance = glm::length(away);
  const double across = std::hypot(away.x, away.y);
  camera.rotation.x = glm::degrees(std::atan2(across, away.z));
  camera.rotation.y = 0.0;
  camera.rotation.z = across > 0 ? glm::degrees(std::atan2(away.x, -away.y)) : 0.0;
  return camera;
}

void centre_camera(Camera& camera, const Bounds& box) {
  camera.target = box.empty() ? glm::dvec3(0.0) : (box.low + box.high) * 0.5;
}

void fit_camera(Camera& camera, const Bounds& box, double aspect) {
  if (box.empty()) return;
  // The ball around the box, and around the target where that is elsewhere.
  const double radius = glm::length(box.high - box.low) * 0.5 +
                        glm::length((box.low + box.high) * 0.5 - camera.target);
  if (!(radius > 0)) return;
  double half_angle = glm::radians(camera.field_of_view) / 2.0;
  const double scale = std::tan(half_angle);
  if (aspect < 1) half_angle = std::atan(scale * aspect);
  camera.distance = camera.projection == Projection::kPerspective || aspect >= 1
                        ? radius / std::sin(half_angle)
                        : radius / std::sin(glm::radians(camera.field_of_view) / 2.0) / aspect;
}

glm::dmat4 eye_from_world(const Camera& camera) {
  glm::dmat4 m(1.0);
  m = glm::translate(m, glm::dvec3(0, 0, -camera.distance));
  m = glm::rotate(m, glm::radians(-camera.rotation.x), glm::dvec3(1, 0, 0));
  m = glm::rotate(m, glm::radians(-camera.rotation.y), glm::dvec3(0, 1, 0));
  m = glm::rotate(m, glm::radians(-camera.rotation.z), glm::dvec3(0, 0, 1));
  return glm::translate(m, -camera.target);
}

double View::distance(double depth) const {
  const double part = depth / kPictureDepthLimit;
  if (!perspective) return near + part * (far - near);
  return 1.0 / (1.0 / near - part * (1.0 / near - 1.0 / far));
}

void View::set_distances(double nearest, double farthest) {
  near = nearest, far = farthest;
  const double range = 1.0 / (1.0 / nearest - 1.0 / farthest) * kPictureDepthLimit;
  for (int column = 0; column < 4; ++column) {
    // Along the view axis eye space has -z.
    const double along = eye_from_world[column].z, one = eye_from_world[column].w;
    image_from_world[column].z = -range / nearest * along - range * one;
  }
}

Result<View> make_view(const Camera& camera, const glm::ivec2& size, const Bounds& box) {
  if (size.x < 1 || size.y < 1 || size.x > kMaxPictureSide || size.y > kMaxPictureSide) {
    return fail(ErrorCode::kUsage, "a picture of {} x {} pixels: each side must be 1 to {}", size.x,
                size.y, kMaxPictureSide);
  }
  const bool finite = std::isfinite(camera.distance) && std::isfinite(camera.target.x) &&
                      std::isfinite(camera.target.y) && std::isfinite(camera.target.z) &&
                      std::isfinite(camera.rotation.x) && std::isfinite(camera.rotation.y) &&
                      std::isfinite(camera.rotation.z);
  if (!finite || !(camera.distance > 0)) {
    return fail(ErrorCode::kUsage, "a camera at distance {}: it must be finite and above 0",
                camera.distance);
  }
  if (!(camera.field_of_view > 0 && camera.field_of_view < 180)) {
    return fail(ErrorCode::kUsage, "a field of view of {} degrees: it must be between 0 and 180",
                camera.field_of_view);
  }
  View view;
  view.size = size;
  view.perspective = camera.projection == Projection::kPerspective;
  view.eye_from_world = eye_from_world(camera);

  double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
  for (int i = 0; i < 8 && !box.empty(); ++i) {
    const double distance = -(view.eye_from_world * glm::dvec4(corner(box, i), 1.0)).z;
    nearest = std::min(nearest, distance);
    farthest = std::max(farthest, distance);
  }
  if (box.empty()) nearest = farthest = camera.distance;
  // A little room, so that rounding clamps nothing.
  const double room = std::max((farthest - nearest) * 1e-6, std::abs(farthest) * 1e-9) + 1e-12;
  nearest -= room, farthest += room;
  if (view.perspective) {
    farthest = std::max(farthest, 1e-9 * camera.distance);
    view.cut_short = nearest < farthest * kNearestPart;
    nearest = std::max(nearest, farthest * kNearestPart);
  }
  view.near = nearest, view.far = farthest;

  // Pixels a world unit: at distance 1 for a perspective view.
  const double scale =
      size.y / 2.0 /
      (view.perspective ? std::tan(glm::radians(camera.field_of_view) / 2.0) : half_height(camera));
  glm::dmat4 image(0.0);  // columns: x, y, z, 1 of eye space
  image[0][0] = scale;
  image[1][1] = -scale;
  if (view.perspective) {
    const double range = 1.0 / (1.0 / nearest - 1.0 / farthest) * kPictureDepthLimit;
    image[2] = {-size.x / 2.0, -size.y / 2.0, -range / nearest, -1.0};
    image[3] = {0, 0, -range, 0};
  } else {
    const double range = kPictureDepthLimit / (farthest - nearest);
    image[2][2] = -range;
    image[3] = {size.x / 2.0, size.y / 2.0, -nearest * range, 1.0};
  }
  view.image_from_world = image * view.eye_from_world;
  return view;
}

View band_of(const View& view, int first, int rows, int across, int down) {
  View band = view;
  band.size = {view.size.x * across, rows * down};
  // Rows of the matrix: u w, v w, depth w, w.
  for (int column = 0; column < 4; ++column) {
    glm::dvec4& m = band.image_from_world[column];
    m.x *= across;
    m.y = (m.y - first * m.w) * down;
  }
  return band;
}

Result<void> check_samples(int samples) {
  if (samples < 1 || samples > 64 || !std::has_single_bit(static_cast<unsigned>(samples))) {
    return fail(ErrorCode::kUsage, "samples per pixel must be 1, 2, 4, 8, 16, 32 or 64, got {}",
                samples);
  }
  return {};
}

SampleGrid sample_grid(int samples) {
  const int bits = std::countr_zero(static_cast<unsigned>(samples));
  return {1 << ((bits + 1) / 2), 1 << (bits / 2)};
}

float eye_light(const glm::dvec3& normal) {
  const double length = glm::length(normal);
  if (!(length > 0)) return 1.0f;
  const glm::dvec3 unit = normal / length;
  const double third = 1.0 / std::sqrt(3.0);
  const double one = std::max(0.0, glm::dot(unit, glm::dvec3(-third, third, third)));
  const double other = std::max(0.0, glm::dot(unit, glm::dvec3(third, -third, -third)));
  return static_cast<float>(std::min(1.0, 0.2 + one + other));
}

}  // namespace strata
