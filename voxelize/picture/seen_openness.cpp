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
  const int left = std::clamp(static_cast<int>(place.x), 0, surfaces_.width - 1);
  const int top = std::clamp(static_cast<int>(place.y), 0, surfaces_.height - 1);
  const int right = std::min(left + 1, surfaces_.width - 1);
  const int bottom = std::min(top + 1, surfaces_.height - 1);
  const auto index = [&](int column, int row) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(surfaces_.width) +
           static_cast<std::size_t>(column);
  };
  const std::size_t around[] = {index(left, top), index(right, top), index(left, bottom),
                                index(right, bottom)};
  if ((open_[around[0]] & open_[around[1]] & open_[around[2]] & open_[around[3]]) == 255) {
    return 1.0f;
  }
  const auto to_right = static_cast<float>(std::clamp(place.x - left, 0.0, 1.0));
  const auto down = static_cast<float>(std::clamp(place.y - top, 0.0, 1.0));
  const float shares[] = {(1 - to_right) * (1 - down), to_right * (1 - down), (1 - to_right) * down,
                          to_right * down};
  const glm::vec3 here = position(pixel, double{seen.distance});
  const auto pixel_width =
      static_cast<float>((surfaces_.perspective ? double{seen.distance} : 1.0) / surfaces_.scale);
  float sum = 0.0f, weights = 0.0f;
  for (int k = 0; k < 4; ++k) {
    const glm::vec3& there = surfaces_.positions[around[k]];
    if (there.z <= EyeSurfaces::kNowhere.z) continue;
    const float off = std::abs(glm::dot(seen.face, there - here));
    const float same = glm::dot(seen.face, surfaces_.normals[around[k]]);
    // Others count a little, for where there is no point of the face.
    const float like =
        std::max(0.0f, 1.0f - off / (2.0f * pixel_width)) * std::max(0.0f, 4.0f * same - 3.0f);
    const float weight = (shares[k] + 0.02f) * (like + 0.002f);
    sum += weight * static_cast<float>(open_[around[k]]);
    weights += weight;
  }
  return weights > 0.0f ? sum / (255.0f * weights) : 1.0f;
}

}  // namespace strata
