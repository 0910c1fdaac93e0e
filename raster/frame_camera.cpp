#include "raster/frame_camera.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <limits>

namespace strata {
namespace {

/// What is filled of a side of the picture.
constexpr double kFilled = 1.0 - 2.0 / 24.0;

}  // namespace

FrameFit::FrameFit(const Camera& camera, double aspect)
    : perspective_(camera.projection == Projection::kPerspective),
      up_(std::tan(glm::radians(camera.field_of_view) / 2.0) * kFilled) {
  across_ = up_ * aspect;
  const glm::dmat3 world_from_eye = glm::transpose(glm::dmat3(eye_from_world(camera)));
  for (int i = 0; i < 3; ++i) axes_[static_cast<std::size_t>(i)] = world_from_eye[i];
  most_up_ = up_;
  most_across_ = across_;
  set_normals();
}

void FrameFit::set_normals() {
  const glm::dvec3 lean = perspective_ ? axes_[2] : glm::dvec3(0.0);
  normals_ = {axes_[0] + across_ * lean, across_ * lean - axes_[0], axes_[1] + up_ * lean,
              up_ * lean - axes_[1]};
}

FrameReach FrameFit::nothing() {
  FrameReach reach;
  reach.fill(-std::numeric_limits<double>::infinity());
  return reach;
}

FrameReach FrameFit::reach(const Bounds& box) const {
  FrameReach result = nothing();
  if (box.empty()) return result;
  for (std::size_t side = 0; side < result.size(); ++side) {
    const glm::dvec3 low = normals_[side] * box.low, high = normals_[side] * box.high;
    const glm::dvec3 most = glm::max(low, high);
    result[side] = most.x + most.y + most.z;
  }
  return result;
}

void FrameFit::include(FrameReach& reach, const glm::dvec3& point) const {
  for (std::size_t side = 0; side < reach.size(); ++side) {
    reach[side] = std::max(reach[side], glm::dot(normals_[side], point));
  }
}

bool FrameFit::place(Camera& camera, const FrameReach& reach, const glm::dvec3& centre) const {
  const auto [right, left, top, bottom] = from(centre, reach);
  const double distance = std::max((right + left) / across_, (top + bottom) / up_) / 2.0;
  if (!(distance > 0)) return false;
  camera.target = centre + axes_[0] * ((right - left) / 2.0) + axes_[1] * ((top - bottom) / 2.0);
  camera.distance = distance;
  return true;
}

FrameReach FrameFit::from(const glm::dvec3& centre, FrameReach reach) const {
  for (std::size_t side = 0; side < reach.size(); ++side) {
    reach[side] -= glm::dot(normals_[side], centre);
  }
  return reach;
}

bool FrameFit::narrow(const FrameReach& reach, const glm::dvec3& centre) {
  const auto [right, left, top, bottom] = from(centre, reach);
  const double across = (right + left) / across_, up = (top + bottom) / up_;
  if (!(across > 0) || !(up > 0)) return false;
  if (loose_ == Loose::kUnknown) loose_ = across > up ? Loose::kUp : Loose::kAcross;
  const bool is_up = loose_ == Loose::kUp;
  double& side = is_up ? up_ : across_;
  const double before = side, sum = is_up ? top + bottom : right + left;
  const double wanted = is_up ? across : up;
  // The sum is linear in the side while the same points are the outermost ones.
  const bool known = last_side_ > 0 && last_side_ != before;
  const double slope = known ? (sum - last_sum_) / (before - last_side_) : 0.0;
  const double next = (sum - slope * before) / (wanted - slope);
  side = std::min(is_up ? most_up_ : most_across_,
                  next > 0 && std::isfinite(next) ? next : sum / wanted);
  last_side_ = before;
  last_sum_ = sum;
  set_normals();
  constexpr double kSettled = 0.003;
  return std::abs(side - before) > kSettled * before;
}

double FrameFit::distance(const FrameReach& reach, const glm::dvec3& centre) const {
  double result = 0;
  const FrameReach sides = from(centre, reach);
  for (std::size_t side = 0; side < sides.size(); ++side) {
    result = std::max(result, sides[side] / (side < 2 ? across_ : up_));
  }
  return std::isfinite(result) ? result : 0.0;
}

void frame_camera(Camera& camera, const Bounds& box, double aspect) {
  if (box.empty()) return;
  FrameFit fit(camera, aspect);
  const glm::dvec3 centre = box.low * 0.5 + box.high * 0.5;
  for (int i = 0; i < kNarrowings && fit.narrow(fit.reach(box), centre); ++i) continue;
  fit.place(camera, fit.reach(box), centre);
}

}  // namespace strata
