#include "voxelize/colours/near_triangle.h"

#include <glm/common.hpp>

namespace strata {

NearTriangle::NearTriangle(const shell::Triangle& corners, const shell::Vector& origin) {
  constexpr double kVoxel = kLatticeSteps;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      corners_[i][static_cast<int>(axis)] =
          static_cast<double>(corners[i][axis] - origin[axis] * kLatticeSteps) / kVoxel;
    }
  }
  low_ = glm::min(corners_[0], glm::min(corners_[1], corners_[2]));
  high_ = glm::max(corners_[0], glm::max(corners_[1], corners_[2]));
  const shell::Vector n = shell::normal(corners);  // exact
  has_area_ = n[0] != 0 || n[1] != 0 || n[2] != 0;
  if (has_area_) {
    const glm::dvec3 across(static_cast<double>(n[0]), static_cast<double>(n[1]),
                            static_cast<double>(n[2]));
    const double length = glm::length(across);
    normal_ = across / length;
    height_ = glm::dot(normal_, corners_[0]);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    Edge& edge = edges_[i];
    const glm::dvec3 a = corners_[i], b = corners_[i == 2 ? 0 : i + 1];
    edge.length = glm::distance(a, b);
    if (edge.length > 0.0) edge.along = (b - a) / edge.length;
    edge.start = glm::dot(edge.along, a);
    edge.outward = glm::cross(edge.along, normal_);
    edge.border = glm::dot(edge.outward, a);
  }
}

double NearTriangle::edge_distance2(const glm::dvec3& p) const {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const Edge& edge = edges_[i];
    const double t = std::clamp(glm::dot(edge.along, p) - edge.start, 0.0, edge.length);
    const glm::dvec3 away = p - (corners_[i] + edge.along * t);
    best = std::min(best, glm::dot(away, away));
  }
  return best;
}

glm::dvec3 NearTriangle::nearest(const glm::dvec3& p) const {
  double best = std::numeric_limits<double>::infinity();
  glm::dvec3 weights(1.0, 0.0, 0.0), inner(0.0);
  bool inside = has_area_;
  for (int i = 0; i < 3; ++i) {
    const Edge& edge = edges_[static_cast<std::size_t>(i)];
    const double e = glm::dot(edge.outward, p) - edge.border;
    if (has_area_ && e <= 0.0) {
      inner[(i + 2) % 3] = -e * edge.length;
      continue;
    }
    inside = false;
    const double t = std::clamp(glm::dot(edge.along, p) - edge.start, 0.0, edge.length);
    const glm::dvec3 away = p - (corners_[static_cast<std::size_t>(i)] + edge.along * t);
    if (const double d = glm::dot(away, away); d < best) {
      best = d;
      const double part = edge.length > 0.0 ? t / edge.length : 0.0;
      weights = glm::dvec3(0.0);
      weights[i] = 1.0 - part;
      weights[(i + 1) % 3] = part;
    }
  }
  const double sum = inner.x + inner.y + inner.z;
  return inside && sum > 0.0 ? inner / sum : weights;
}

}  // namespace strata
