#include "csg/surface.h"

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>

namespace strata::csg {

Coincidence::Coincidence(const View& view, double world_error) {
  constexpr double kPixelPart = 0.1;
  // Length of a pixel in the world is 1 / scale, times the distance in a perspective view.
  const glm::dmat4 image_from_eye = view.image_from_world * glm::inverse(view.eye_from_world);
  const double scale = std::abs(image_from_eye[1][1]);
  if (view.perspective) {
    const double difference = 1.0 / view.near - 1.0 / view.far;
    a_ = 1.0 / view.near;
    b_ = difference / kPictureDepthLimit;
    const double steps = kPictureDepthLimit / difference;  // d(depth) = steps * d(1 / distance)
    flat_ = steps * world_error;
    pixel_ = steps * kPixelPart / scale;
  } else {
    const double steps = kPictureDepthLimit / (view.far - view.near);
    flat_ = steps * world_error;
    pixel_ = steps * kPixelPart / scale;
  }
}

double Coincidence::error(const TriangleSetup& t, std::uint32_t depth) const {
  const double nearness = a_ - b_ * depth;
  const double slopes =
      static_cast<double>(std::abs(t.slope_u) + std::abs(t.slope_v)) / static_cast<double>(t.area);
  return std::min(1.5 + flat_ * nearness * nearness + 0.5 * slopes, largest(depth));
}

Coincidence::Range Coincidence::range() const {
  constexpr double kMore = 2.0 * 1.01;
  return {static_cast<float>(a_), static_cast<float>(b_), static_cast<float>(kMore * 1.5 + 1.0),
          static_cast<float>(kMore * pixel_), static_cast<float>(kMore * flat_)};
}

}  // namespace strata::csg
