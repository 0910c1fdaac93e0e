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

/// A point p within reach has normal . p <= bound.
void NearTriangle::Limits::add(const glm::dvec3& normal, double bound, double slack) {
  constexpr double kSteep = 1e-6;
  if (std::abs(normal.z) <= kSteep) {
    flat[flat_count++] = {bound + slack, -normal.x, -normal.y};
    return;
  }
  // Divided by normal.z: bound has room for what that rounds.
  const Bound made{bound / normal.z, -normal.x / normal.z, -normal.y / normal.z};
  if (normal.z > 0.0) {
    above[above_count++] = made;
  } else {
    below[below_count++] = made;
  }
}

/// Both sides of the plane, and three edges.
NearTriangle::Limits NearTriangle::limits(double far) const {
  Limits made;
  if (!has_area_) return made;
  const double slack = 1e-6 * (std::abs(low_.z) + std::abs(high_.z) + 2.0 * far + 1.0);
  made.add(normal_, height_ + far, slack);
  made.add(-normal_, far - height_, slack);
  for (const Edge& edge : edges_) made.add(edge.outward, edge.border + far, slack);
  return made;
}

void NearTriangle::clip_to_outline(double far, double y, double& u_low, double& u_high) const {
  if (!has_area_ || std::abs(normal_.z) <= 1e-3) return;  // edge-on there is no outline
  const double turn = normal_.z > 0.0 ? 1.0 : -1.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3 &a = corners_[i], &b = corners_[i == 2 ? 0 : i + 1];
    const double across_u = turn * (b.y - a.y), across_v = turn * (a.x - b.x);
    const double length = std::sqrt(across_u * across_u + across_v * across_v);
    // across . p <= across . a + far length
    const double rest = across_u * a.x + across_v * (a.y - y) + far * length;
    if (across_u > 0.0) {
      u_high = std::min(u_high, rest / across_u + kSlack);
    } else if (across_u < 0.0) {
      u_low = std::max(u_low, rest / across_u - kSlack);
    }
  }
}

}  // namespace strata
