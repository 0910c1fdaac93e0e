#pragma once

// A triangle, the voxel centres near it, and the point of it that is nearest to one. Private to
// voxelize/colours. All lengths are in voxels, from the lowest corner of a tile; (u, v, w) are two
// axes of the image and the axis of the columns.

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>

#include "voxelize/overlap/shell_overlap.h"

namespace strata {

class NearTriangle {
 public:
  /// @param corners on the lattice @param origin of the tile, voxels
  NearTriangle(const shell::Triangle& corners, const shell::Vector& origin);

  /// Calls run(u, v, first, last) for columns of a window, in tile coordinates: voxels first..last
  /// are those that may be no farther than `reach` from the triangle, and few others.
  /// @param size of the window, columns along u and v, voxels along w
  template <class Run>
  void columns_within(double reach, const glm::ivec3& size, Run&& run) const;

  /// The square of the distance of the point p.
  [[nodiscard]] double distance2(const glm::dvec3& p) const {
    if (!has_area_) return edge_distance2(p);
    const double h = glm::dot(normal_, p) - height_;
    double beside = 0.0;  // of the place above which p lies, within the plane
    bool inside = true;
    for (const Edge& edge : edges_) {
      const double e = glm::dot(edge.outward, p) - edge.border;
      if (e <= 0.0) continue;
      const double t = glm::dot(edge.along, p) - edge.start;
      const double over = t < 0.0 ? t : t > edge.length ? t - edge.length : 0.0;
      const double d = e * e + over * over;
      beside = inside ? d : std::min(beside, d);
      inside = false;
    }
    return h * h + beside;
  }
  /// Weights of the corners that make the nearest point to p.
  [[nodiscard]] glm::dvec3 nearest(const glm::dvec3& p) const;

 private:
  struct Edge {                           // from corner i to corner i + 1
    glm::dvec3 outward{0.0}, along{0.0};  // of length 1; across the edge within the plane
    double border = 0.0, start = 0.0, length = 0.0;
  };
  [[nodiscard]] double edge_distance2(const glm::dvec3& p) const;

  glm::dvec3 low_{0.0}, high_{0.0};  // box
  glm::dvec3 normal_{0.0};           // of length 1
  double height_ = 0.0;              // of the plane along it
  bool has_area_ = false;
  std::array<glm::dvec3, 3> corners_{};
  std::array<Edge, 3> edges_{};
};

template <class Run>
void NearTriangle::columns_within(double reach, const glm::ivec3& size, Run&& run) const {
  constexpr double kSlack = 1e-6;  // far above what the numbers here are rounded by
  const double far = reach + kSlack;
  // Voxel i has its centre at i + 1/2.
  const auto first_of = [&](double low, int end) {
    return static_cast<int>(std::clamp(std::ceil(low - 0.5), 0.0, static_cast<double>(end)));
  };
  const auto last_of = [&](double high, int end) {
    return static_cast<int>(std::clamp(std::floor(high - 0.5), -1.0, end - 1.0));
  };
  const int v_first = first_of(low_.y - far, size.y), v_last = last_of(high_.y + far, size.y);
  // A point p within reach has side . p <= bound for both sides of the plane and the three edges.
  struct Side {
    glm::dvec3 normal{0.0};
    double bound = 0.0;
  };
  std::array<Side, 5> sides;
  std::size_t side_count = 0;
  if (has_area_) {
    sides[side_count++] = {normal_, height_ + far};
    sides[side_count++] = {-normal_, far - height_};
    for (const Edge& edge : edges_) sides[side_count++] = {edge.outward, edge.border + far};
  }
  // Seen along the columns: the triangle's outline. Edge-on there is none.
  const bool outlined = has_area_ && std::abs(normal_.z) > 1e-3;
  std::array<Side, 3> outline;
  for (std::size_t i = 0; outlined && i < 3; ++i) {
    const glm::dvec3 a = corners_[i], b = corners_[i == 2 ? 0 : i + 1];
    const double turn = normal_.z > 0.0 ? 1.0 : -1.0;
    const glm::dvec3 across(turn * (b.y - a.y), turn * (a.x - b.x), 0.0);
    const double length = std::hypot(across.x, across.y);
    outline[i] = {across, glm::dot(across, a) + far * length};
  }
  for (int v = v_first; v <= v_last; ++v) {
    const double y = v + 0.5;
    double u_low = low_.x - far, u_high = high_.x + far;
    if (outlined) {
      for (const Side& side : outline) {  // normal.x u <= rest
        const double rest = side.bound - side.normal.y * y;
        if (side.normal.x > 0.0) {
          u_high = std::min(u_high, rest / side.normal.x + kSlack);
        } else if (side.normal.x < 0.0) {
          u_low = std::max(u_low, rest / side.normal.x - kSlack);
        }
      }
    }
    const int u_first = first_of(u_low, size.x), u_last = last_of(u_high, size.x);
    for (int u = u_first; u <= u_last; ++u) {
      double w_low = low_.z - far, w_high = high_.z + far;
      bool any = true;
      for (std::size_t i = 0; i < side_count; ++i) {
        const Side& side = sides[i];
        const double rest = side.bound - side.normal.x * (u + 0.5) - side.normal.y * y;
        if (side.normal.z > 1e-6) {
          w_high = std::min(w_high, rest / side.normal.z + kSlack);
        } else if (side.normal.z < -1e-6) {
          w_low = std::max(w_low, rest / side.normal.z - kSlack);
        } else if (rest < -1e-6 * (std::abs(w_low) + std::abs(w_high) + 1.0)) {
          any = false;
        }
      }
      if (!any || w_low > w_high) continue;
      const int first = first_of(w_low, size.z), last = last_of(w_high, size.z);
      if (first <= last) run(u, v, first, last);
    }
  }
}

}  // namespace strata
