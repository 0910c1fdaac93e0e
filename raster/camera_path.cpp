// This work is based on:
// Edwin Catmull, Raphael Rom. A Class of Local Interpolating Splines. 1974.
// We differ: times need not be even, so slopes are differences of positions over those of times.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>

#include "strata/raster/camera_file.h"

namespace strata {
namespace {

/// An eye, what it looks at, and what is up.
struct Pose {
  glm::dvec3 eye, target, up;
};

Pose pose_of(const Camera& camera) {
  const glm::dmat3 world_from_eye = glm::transpose(glm::dmat3(eye_from_world(camera)));
  return {camera.target + world_from_eye[2] * camera.distance, camera.target, world_from_eye[1]};
}

/// The way from a direction to another, both of length 1.
glm::dvec3 turned(const glm::dvec3& from, const glm::dvec3& to, double part) {
  const double angle = std::acos(std::clamp(glm::dot(from, to), -1.0, 1.0));
  constexpr double kSmall = 1e-6;  // below, and for opposite ones, the chord is as good
  if (std::sin(angle) < kSmall) return glm::mix(from, to, part);
  return (std::sin((1 - part) * angle) * from + std::sin(part * angle) * to) / std::sin(angle);
}

/// Sets the place and rotation of a camera.
void place(Camera& camera, const Pose& pose) {
  const glm::dvec3 away = pose.eye - pose.target;
  camera.target = pose.target;
  camera.distance = glm::length(away);
  if (!(camera.distance > 0)) return;
  const glm::dvec3 back = away / camera.distance;
  const glm::dvec3 across = glm::cross(pose.up, back);
  if (!(glm::length(across) > 0)) return;
  const glm::dvec3 right = glm::normalize(across), up = glm::cross(back, right);
  // The axes are the columns of Rz Ry Rx.
  camera.rotation.y = glm::degrees(std::asin(std::clamp(-right.z, -1.0, 1.0)));
  camera.rotation.x = glm::degrees(std::atan2(up.z, back.z));
  camera.rotation.z = glm::degrees(std::atan2(right.y, right.x));
}

}  // namespace

Camera camera_at(std::span<const TimedCamera> path, double time) {
  if (path.size() == 1 || time <= path.front().time) return path.front().camera;
  if (time >= path.back().time) return path.back().camera;
  const auto next =
      std::upper_bound(path.begin(), path.end(), time,
                       [](double value, const TimedCamera& camera) { return value < camera.time; });
  const auto i = static_cast<std::size_t>(next - path.begin()) - 1;
  const double length = path[i + 1].time - path[i].time;
  const double t = (time - path[i].time) / length;
  const Pose from = pose_of(path[i].camera), to = pose_of(path[i + 1].camera);
  const auto curve = [&](glm::dvec3 Pose::*member) {
    const auto slope = [&](std::size_t k) {
      const std::size_t before = k > 0 ? k - 1 : k, after = std::min(k + 1, path.size() - 1);
      return (pose_of(path[after].camera).*member - pose_of(path[before].camera).*member) /
             (path[after].time - path[before].time);
    };
    const double t2 = t * t, t3 = t2 * t;
    return from.*member * (2 * t3 - 3 * t2 + 1) + to.*member * (3 * t2 - 2 * t3) +
           (slope(i) * (t3 - 2 * t2 + t) + slope(i + 1) * (t3 - t2)) * length;
  };
  Camera camera = path[i].camera;
  camera.field_of_view = glm::mix(camera.field_of_view, path[i + 1].camera.field_of_view, t);
  const Pose pose{curve(&Pose::eye), curve(&Pose::target), turned(from.up, to.up, t)};
  if (camera.rotation.y == 0 && path[i + 1].camera.rotation.y == 0 && pose.eye != pose.target) {
    // Where the horizon is level at both ends it is level in between.
    const Camera level = look_at(pose.eye, pose.target);
    camera.target = level.target;
    camera.rotation = level.rotation;
    camera.distance = level.distance;
  } else {
    place(camera, pose);
  }
  return camera;
}

}  // namespace strata
