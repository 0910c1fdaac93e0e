#include "csg/surface.h"

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>

namespace strata::csg {

Coincidence::Coincidence(const View& view, double world_error) {
  constexpr double kPixelPart = 0.1;
  const glm::dmat4 image_from_eye = view.image_from_world * glm::inverse(view.eye_from_world);
  const double scale = std::abs(image_from_eye[1][1]);  // pixels a world unit (at distance 1)
  if (view.perspective) {
    const double difference = 1.0 / view.near - 1.0 / view.far;
    a_ = 1.0 / view.near;
    b_ = difference / kPictureDepthLimit;
    const double steps = kPictureDepthLimit / difference;  // d(depth) = steps * d(1 / distance)
    flat_ = steps * world_error;
    // A pixel is distance / scale wide: steps / (scale * distance) depth steps, least far away.
    steep_from_ = 2.0 * kPixelPart * steps / (scale * view.far);
  } else {
    const double steps = kPictureDepthLimit / (view.far - view.near);
    flat_ = steps * world_error;
    steep_from_ = 2.0 * kPixelPart * steps / scale;
  }
}

Coincidence::Bound Coincidence::bound(const LatticeMesh& mesh, std::uint32_t triangle,
                                      std::uint32_t depth) const {
  const glm::uvec3& t = mesh.triangles[triangle];
  const glm::ivec3 &p = mesh.vertices[t.x], &q = mesh.vertices[t.y], &r = mesh.vertices[t.z];
  TriangleSetup setup;
  if (!setup_triangle(p, q, r, AxisFrame(Axis::kZ), setup)) return {};
  const double slopes = 0.5 * setup.steepness();
  const auto [low, high] = std::minmax({p.z, q.z, r.z});
  const double least = flat(depth), at = depth;
  return {least + std::min(slopes, std::max(0.0, at - low)),
          least + std::min(slopes, std::max(0.0, high - at))};
}

Coincidence::Range Coincidence::range() const {
  constexpr double kMore = 2.0 * 1.01;
  return {static_cast<float>(a_), static_cast<float>(b_),
          static_cast<float>(kMore * (1.5 + 0.5 * steep_from_) + 1.0),
          static_cast<float>(kMore * flat_)};
}

}  // namespace strata::csg
