#include "voxelize/picture/seen_openness.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace strata {
namespace {

constexpr int kSmall = 384;  ///< pictures up to this many pixels a side are looked at as they are

}  // namespace

/// In eye space, as EyeSurfaces has it.
glm::vec3 SeenOpenness::position(const glm::dvec2& pixel, double distance) const {
  const double wide = (surfaces_.perspective ? distance : 1.0) / scale_;
  return {(pixel.x - centre_.x) * wide, (centre_.y - pixel.y) * wide,
          surfaces_.origin_distance - distance};
}

SeenOpenness::SeenOpenness(const View& view, const std::vector<SeenVoxel>& seen, double radius,
                           const Execution& execution)
    : step_(std::max(view.size.x, view.size.y) <= kSmall ? 1 : 2) {
  const glm::dmat4 image_from_eye = view.image_from_world * glm::inverse(view.eye_from_world);
  const glm::dvec4& axis = image_from_eye[view.perspective ? 2 : 3];
  scale_ = image_from_eye[0][0];
  centre_ = glm::dvec2(axis) / axis.w;
  surfaces_.perspective = view.perspective;
  surfaces_.scale = scale_ / step_;
  // The first pixel of a square stands for it; its middle is where the square's is looked for.
  const double shift = 0.5 - 0.5 / step_;
  surfaces_.centre = centre_ / static_cast<double>(step_) + shift;
  surfaces_.origin_distance = 0.5 * (view.near + view.far);
  surfaces_.resize((view.size.x + step_ - 1) / step_, (view.size.y + step_ - 1) / step_);
  const auto width = static_cast<std::size_t>(surfaces_.width);
  const auto step = static_cast<std::size_t>(step_);
  parallel_for(execution, static_cast<std::size_t>(surfaces_.height), [&](std::size_t y, int) {
    for (std::size_t x = 0; x < width; ++x) {
      const SeenVoxel& one = seen[y * step * static_cast<std::size_t>(view.size.x) + x * step];
      const std::size_t at = y * width + x;
      surfaces_.normals[at] = one.face;
      surfaces_.positions[at] =
          one.found() ? position(glm::dvec2(glm::uvec2(x, y)) * static_cast<double>(step_) + 0.5,
                                 double{one.distance})
                      : EyeSurfaces::kNowhere;
    }
  });
  open_ = openness(surfaces_, radius, execution);
}

float SeenOpenness::at(const glm::dvec2& pixel, const SeenVoxel& seen) const {
  if (open_.empty()) return 1.0f;
  const glm::dvec2 place = (pixel - 0.5) / static_cast<double>(step_);
  const glm::vec3 here = position(pixel, double{seen.distance});
  const auto pixel_width =
      static_cast<float>((surfaces_.perspective ? double{seen.distance} : 1.0) / surfaces_.scale);
  return openness_between(surfaces_, open_, place, seen.face, [&](const glm::vec3& there) {
    return std::abs(glm::dot(seen.face, there - here)) / (2.0f * pixel_width);
  });
}

}  // namespace strata
