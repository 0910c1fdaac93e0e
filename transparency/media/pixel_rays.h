#pragma once

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "strata/raster/view.h"

namespace strata::transparency {

/// A ray through the centre of a pixel, in eye space. A point of it is origin + t direction, where
/// t is the distance along the view axis.
struct PixelRay {
  glm::dvec3 origin{0.0}, direction{0.0, 0.0, -1.0};
  double length = 1.0;  ///< of the direction: world units along the ray per unit of t

  [[nodiscard]] glm::dvec3 at(double t) const { return origin + direction * t; }
};

/// View::distance(), for many depths.
class DepthDistances {
 public:
  explicit DepthDistances(const View& view)
      : perspective_(view.perspective),
        first_(view.perspective ? 1.0 / view.near : view.near),
        step_((view.perspective ? 1.0 / view.far - 1.0 / view.near : view.far - view.near) /
              kPictureDepthLimit) {}

  [[nodiscard]] double operator()(std::uint32_t depth) const {
    const double x = first_ + static_cast<double>(depth) * step_;
    return perspective_ ? 1.0 / x : x;
  }

 private:
  bool perspective_;
  double first_, step_;
};

/// The rays of a view.
class PixelRays {
 public:
  explicit PixelRays(const View& view)
      : eye_from_world_(view.eye_from_world),
        world_from_eye_(glm::inverse(view.eye_from_world)),
        perspective_(view.perspective) {
    const glm::dmat4 image_from_eye = view.image_from_world * world_from_eye_;
    const glm::dvec4& shift = image_from_eye[perspective_ ? 2 : 3];
    scale_ = {image_from_eye[0].x, image_from_eye[1].y};
    unit_ = 1.0 / scale_;
    // A perspective view divides by -z.
    shift_ = perspective_ ? glm::dvec2(shift.x, shift.y) : -glm::dvec2(shift.x, shift.y);
  }

  /// The place of pixel (u, v) at distance 1 along the view axis.
  [[nodiscard]] glm::dvec2 place(double u, double v) const {
    return (glm::dvec2(u, v) + shift_) * unit_;
  }
  [[nodiscard]] PixelRay ray(int u, int v) const {
    const glm::dvec2 at = place(u + 0.5, v + 0.5);
    if (!perspective_) return {{at, 0.0}, {0.0, 0.0, -1.0}, 1.0};
    const glm::dvec3 direction(at, -1.0);
    return {glm::dvec3(0.0), direction, glm::length(direction)};
  }
  /// Pixels of a world unit across the ray, at distance 1 of a perspective view.
  [[nodiscard]] const glm::dvec2& scale() const { return scale_; }
  [[nodiscard]] const glm::dvec2& shift() const { return shift_; }
  [[nodiscard]] bool perspective() const { return perspective_; }
  [[nodiscard]] const glm::dmat4& eye_from_world() const { return eye_from_world_; }
  [[nodiscard]] const glm::dmat4& world_from_eye() const { return world_from_eye_; }

 private:
  glm::dmat4 eye_from_world_, world_from_eye_;
  bool perspective_;
  glm::dvec2 scale_{1.0}, unit_{1.0}, shift_{0.0};
};

}  // namespace strata::transparency
