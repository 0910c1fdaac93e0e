#pragma once

// A triangle and the voxel centres near it. Private to voxelize/colours. All lengths are in voxels,
// from the lowest corner of a tile; (u, v, w) are two axes of the image and the axis of the
// columns.

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "voxelize/overlap/shell_overlap.h"

namespace strata {

class NearTriangle {
 public:
  struct Edge {                           // from corner i to corner i + 1
    glm::dvec3 outward{0.0}, along{0.0};  // of length 1; across the edge within the plane
    double border = 0.0, start = 0.0, length = 0.0;
  };

  /// @param corners on the lattice @param origin of the tile, voxels
  NearTriangle(const shell::Triangle& corners, const shell::Vector& origin);

  /// Calls run(u, v, first, last) for columns of a window, in tile coordinates: voxels first..last
  /// are those that may be no farther than `reach` from the triangle, and few others.
  /// @param size of the window, columns along u and v, voxels along w
  template <class Run>
  void columns_within(double reach, const glm::ivec3& size, Run&& run) const;

  /// False: the triangle is a line or a point, and has neither plane nor outward directions.
  [[nodiscard]] bool has_area() const { return has_area_; }
  [[nodiscard]] const glm::dvec3& normal() const { return normal_; }  ///< of length 1
  [[nodiscard]] double height() const { return height_; }             ///< of the plane along it
  [[nodiscard]] const std::array<glm::dvec3, 3>& corners() const { return corners_; }
  [[nodiscard]] const std::array<Edge, 3>& edges() const { return edges_; }

 private:
  /// first + u * per_u + v * per_v: a bound of w at the column (u, v).
  struct Bound {
    double first = 0.0, per_u = 0.0, per_v = 0.0;
  };
  /// What a point within reach keeps to.
  struct Limits {
    std::array<Bound, 5> above, below;  // w is no more, no less
    std::array<Bound, 5> flat;          // the bound is 0 or more, whatever w is
    std::size_t above_count = 0, below_count = 0, flat_count = 0;
    void add(const glm::dvec3& normal, double bound, double slack);
  };
  [[nodiscard]] Limits limits(double far) const;
  /// Narrows the columns of row y to those that the triangle, seen along w, is not too far from.
  void clip_to_outline(double far, double y, double& u_low, double& u_high) const;

  static constexpr double kSlack = 1e-6;  // far above what the numbers here are rounded by
  glm::dvec3 low_{0.0}, high_{0.0};       // box
  glm::dvec3 normal_{0.0};
  double height_ = 0.0;
  bool has_area_ = false;
  std::array<glm::dvec3, 3> corners_{};
  std::array<Edge, 3> edges_{};
};

template <class Run>
void NearTriangle::columns_within(double reach, const glm::ivec3& size, Run&& run) const {
  const double far = reach + kSlack;
  // Voxel i has its centre at i + 1/2. No std::ceil: that is a call on the least common machine.
  const auto first_of = [](double low, int end) {
    const double at = low - 0.5;
    if (!(at > 0.0)) return 0;
    if (at >= end) return end;
    const int whole = static_cast<int>(at);
    return whole + (whole < at ? 1 : 0);
  };
  const auto last_of = [](double high, int end) {
    const double at = high - 0.5;
    return at < 0.0 ? -1 : at >= end - 1.0 ? end - 1 : static_cast<int>(at);
  };
  const int v_first = first_of(low_.y - far, size.y), v_last = last_of(high_.y + far, size.y);
  const Limits side = limits(far);
  for (int v = v_first; v <= v_last; ++v) {
    const double y = v + 0.5;
    double u_low = low_.x - far, u_high = high_.x + far;
    clip_to_outline(far, y, u_low, u_high);
    const int u_first = first_of(u_low, size.x), u_last = last_of(u_high, size.x);
    for (int u = u_first; u <= u_last; ++u) {
      const auto at = [x = u + 0.5, y](const Bound& bound) {
        return bound.first + bound.per_v * y + bound.per_u * x;
      };
      double w_low = low_.z - far, w_high = high_.z + far;
      for (std::size_t i = 0; i < side.above_count; ++i) {
        w_high = std::min(w_high, at(side.above[i]));
      }
      for (std::size_t i = 0; i < side.below_count; ++i) {
        w_low = std::max(w_low, at(side.below[i]));
      }
      bool any = w_low <= w_high;
      for (std::size_t i = 0; i < side.flat_count; ++i) any = any && at(side.flat[i]) >= 0.0;
      if (!any) continue;
      const int first = first_of(w_low, size.z), last = last_of(w_high, size.z);
      if (first <= last) run(u, v, first, last);
    }
  }
}

}  // namespace strata
