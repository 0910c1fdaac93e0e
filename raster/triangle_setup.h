#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <glm/vec3.hpp>
#include <utility>

#include "strata/core/grid.h"
#include "strata/raster/lattice_mesh.h"
#include "strata/raster/raster_target.h"

// The exact geometry of a triangle seen along an axis: which pixel centres it covers and at what
// depth, in integers, with ties decided by one symbolic perturbation of the sample point by
// (e, e^2, e^3) in x, y, z order (H. Edelsbrunner, E. P. Muecke: Simulation of Simplicity, 1990).
// In the image the rule is the rasterizers' top-left rule; along the ray it makes the lists of the
// three axes agree on every voxel centre.

namespace strata {

__extension__ using Int128 = __int128;

/// A triangle in the frame of a target, turned counter-clockwise.
struct TriangleSetup {
  std::int64_t u[3], v[3];  ///< lattice positions of the vertices
  std::int64_t w0;          ///< depth of vertex 0
  std::int64_t area;        ///< twice the area, > 0
  std::int64_t slope_u;     ///< depth = w0 + (slope_u (pu - u[0]) + slope_v (pv - v[0])) / area
  std::int64_t slope_v;
  std::int64_t tie_down;  ///< 1: a depth that is a whole number counts as just below it
  bool exit;              ///< the outward normal looks along the ray

  /// a pu + b pv + c >= 0 for the three edges exactly where the pixel centre is covered.
  struct Edge {
    std::int64_t a, b, c;
  };
  /// Depth steps that a lattice step along u and one along v make together, about.
  [[nodiscard]] double steepness() const {
    return static_cast<double>(std::abs(slope_u) + std::abs(slope_v)) / static_cast<double>(area);
  }
  [[nodiscard]] Edge edge(int i) const {
    const int j = i == 2 ? 0 : i + 1;
    const std::int64_t a = v[i] - v[j];
    const std::int64_t b = u[j] - u[i];
    const bool tie_inside = a > 0 || (a == 0 && b > 0);
    return {a, b, -a * u[i] - b * v[i] - (tie_inside ? 0 : 1)};
  }
};

/// First and one past the last pixel whose centre lies in [low, high] (lattice steps).
inline int first_pixel(std::int64_t low) {
  return static_cast<int>((low + kLatticeSteps / 2 - 1) >> kLatticeBits);
}
inline int end_pixel(std::int64_t high) {
  return static_cast<int>((high - kLatticeSteps / 2) >> kLatticeBits) + 1;
}

/// The pixels whose centres lie in the box of the triangle, cut to `clip`.
inline PixelRect pixel_bounds(const TriangleSetup& t, const PixelRect& clip) {
  return {std::max(clip.u0, first_pixel(std::min({t.u[0], t.u[1], t.u[2]}))),
          std::max(clip.v0, first_pixel(std::min({t.v[0], t.v[1], t.v[2]}))),
          std::min(clip.u1, end_pixel(std::max({t.u[0], t.u[1], t.u[2]}))),
          std::min(clip.v1, end_pixel(std::max({t.v[0], t.v[1], t.v[2]})))};
}

/// Fills `t`; false for a triangle seen edge-on, which covers nothing (its neighbours agree).
inline bool setup_triangle(const glm::ivec3& p0, const glm::ivec3& p1, const glm::ivec3& p2,
                           const AxisFrame& frame, TriangleSetup& t) {
  std::int64_t w1 = p1[frame.w], w2 = p2[frame.w];
  t.u[0] = p0[frame.u], t.u[1] = p1[frame.u], t.u[2] = p2[frame.u];
  t.v[0] = p0[frame.v], t.v[1] = p1[frame.v], t.v[2] = p2[frame.v];
  t.w0 = p0[frame.w];
  t.area = (t.u[1] - t.u[0]) * (t.v[2] - t.v[0]) - (t.u[2] - t.u[0]) * (t.v[1] - t.v[0]);
  if (t.area == 0) return false;
  // The frame of the y axis is left-handed: there the signed area is minus the normal's component.
  t.exit = (t.area > 0) != (frame.w == 1);
  if (t.area < 0) {
    std::swap(t.u[1], t.u[2]);
    std::swap(t.v[1], t.v[2]);
    std::swap(w1, w2);
    t.area = -t.area;
  }
  const std::int64_t u1 = t.u[1] - t.u[0], v1 = t.v[1] - t.v[0], u2 = t.u[2] - t.u[0],
                     v2 = t.v[2] - t.v[0];
  w1 -= t.w0, w2 -= t.w0;
  t.slope_u = w1 * v2 - w2 * v1;
  t.slope_v = u1 * w2 - u2 * w1;
  // On the plane itself the perturbed sample lies beyond it when the first non-zero component, in
  // x, y, z order, of the normal (-slope_u, -slope_v, area) is positive.
  bool down = true;
  if (frame.w != 0) down = t.slope_u < 0 || (t.slope_u == 0 && (frame.w == 1 || t.slope_v <= 0));
  t.tie_down = down ? 1 : 0;
  return true;
}

inline Int128 floor_div(Int128 numerator, Int128 denominator) {
  const Int128 quotient = numerator / denominator;
  return quotient - (numerator % denominator < 0 ? 1 : 0);
}

/// The exact floor of the perturbed depth above pixel (u, v), in lattice steps, unclamped.
inline std::int64_t exact_depth(const TriangleSetup& t, int u, int v) {
  const std::int64_t du = std::int64_t{u} * kLatticeSteps + kLatticeSteps / 2 - t.u[0];
  const std::int64_t dv = std::int64_t{v} * kLatticeSteps + kLatticeSteps / 2 - t.v[0];
  const Int128 numerator = Int128{t.slope_u} * du + Int128{t.slope_v} * dv - t.tie_down;
  return t.w0 + static_cast<std::int64_t>(floor_div(numerator, t.area));
}

/// Depth as stored: near and far clamp it, they never remove a crossing.
inline std::uint32_t clamp_depth(std::int64_t depth, std::uint32_t depth_limit) {
  return static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(depth, 0, std::int64_t{depth_limit} - 1));
}

/// The reference rasterizer: obviously right, any size, no speed. Calls emit(u, v, depth) for each
/// covered pixel of `clip`.
template <class Emit>
void rasterize_exact(const TriangleSetup& t, const PixelRect& clip, std::uint32_t depth_limit,
                     Emit&& emit) {
  const PixelRect box = pixel_bounds(t, clip);
  const TriangleSetup::Edge edges[3] = {t.edge(0), t.edge(1), t.edge(2)};
  for (int v = box.v0; v < box.v1; ++v) {
    const std::int64_t pv = std::int64_t{v} * kLatticeSteps + kLatticeSteps / 2;
    for (int u = box.u0; u < box.u1; ++u) {
      const std::int64_t pu = std::int64_t{u} * kLatticeSteps + kLatticeSteps / 2;
      bool covered = true;
      for (const auto& e : edges) covered = covered && e.a * pu + e.b * pv + e.c >= 0;
      if (covered) emit(u, v, clamp_depth(exact_depth(t, u, v), depth_limit));
    }
  }
}

}  // namespace strata
