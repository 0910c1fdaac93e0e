#include "contour/cell_vertex.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

// After: T. Ju, F. Losasso, S. Schaefer, J. Warren: Dual contouring of Hermite data, 2002. We
// differ: planes are those of triangles, without the error of samples, so that small angles between
// them count. Where the best place lies outside the cell, small angles count less, as long as the
// vertex stays at the planes; else it is the best place at the cell's sides.

namespace strata::contouring {
namespace {

/// Weight of the distance from the mean beside that of one plane. The first moves a corner of
/// planes 1 degree apart by 1/30 of a cell's side times 1e-3, far below half a step; with the
/// second, planes less than about 8 degrees apart are nearly one.
constexpr double kSharp = 1e-7, kBlunt = 0.02;
/// The blunt place may be this many steps from a plane, 1/128 voxel.
constexpr double kMostOff = 2.0;
/// Steps from a triangle, half a cell, times its corners' greatest error by rounding.
constexpr double kUnknown = 128.0 * 0.7;
/// Normals this close are one plane: doubles of coordinates below 2^24 steps know them to 2^-48.
constexpr double kSameNormal = 1e-9;

/// The nearest step to a coordinate, within bounds.
int rounded(double place, int low, int high, bool& clamped) {
  const double step = place + 0.5;
  if (step >= low && step < high + 1) return static_cast<int>(step);
  clamped = true;
  return step < low ? low : high;
}
CellVertex rounded(const glm::dvec3& place, const CellBounds& bounds) {
  CellVertex result;
  result.at = {rounded(place.x, bounds.low.x, bounds.high.x, result.clamped),
               rounded(place.y, bounds.low.y, bounds.high.y, result.clamped),
               rounded(place.z, bounds.low.z, bounds.high.z, result.clamped)};
  return result;
}

/// The step x from the mean with the least weighted sum of squared distances from planes, plus
/// weight x^2: (sum of w n n^T + weight) x = sum of w n (d - n . mean).
class LeastSquares {
 public:
  LeastSquares(std::span<const Plane> planes, const glm::dvec3& mean) {
    double most = 0.0;  // of the weights
    for (const Plane& plane : planes) most = std::max(most, plane.weight);
    for (const Plane& plane : planes) {
      const glm::dvec3 n = plane.normal, weighted = n * (plane.weight / most);
      diagonal_ += weighted * n;
      xy_ += weighted.x * n.y, xz_ += weighted.x * n.z, yz_ += weighted.y * n.z;
      right_ += weighted * (plane.offset - glm::dot(n, mean));
    }
  }
  void add_weight(double weight) { diagonal_ += weight; }
  /// Makes a coordinate of the step known.
  void fix(int axis, double value) {
    if (axis == 0) right_ -= glm::dvec3(0.0, xy_, xz_) * value, xy_ = xz_ = 0.0;
    if (axis == 1) right_ -= glm::dvec3(xy_, 0.0, yz_) * value, xy_ = yz_ = 0.0;
    if (axis == 2) right_ -= glm::dvec3(xz_, yz_, 0.0) * value, xz_ = yz_ = 0.0;
    diagonal_[axis] = 1.0;
    right_[axis] = value;
  }
  /// By L D L^T.
  [[nodiscard]] glm::dvec3 solved() const {
    const double l21 = xy_ / diagonal_.x, l31 = xz_ / diagonal_.x;
    const double d2 = diagonal_.y - l21 * xy_;
    const double l32 = (yz_ - l31 * xy_) / d2;
    const double d3 = diagonal_.z - l31 * xz_ - l32 * l32 * d2;
    const double y2 = right_.y - l21 * right_.x;
    const double z = (right_.z - l31 * right_.x - l32 * y2) / d3, y = y2 / d2 - l32 * z;
    return {right_.x / diagonal_.x - l21 * y - l31 * z, y, z};
  }

 private:
  glm::dvec3 diagonal_{0.0}, right_{0.0};
  double xy_ = 0.0, xz_ = 0.0, yz_ = 0.0;
};

bool lies_at(std::span<const Plane> planes, const CellVertex& vertex) {
  return std::all_of(planes.begin(), planes.end(), [&](const Plane& plane) {
    const double off = glm::dot(plane.normal, glm::dvec3(vertex.at)) - plane.offset;
    return off * off * plane.weight <= kMostOff * kMostOff;
  });
}

/// The best place within bounds: whichever coordinate is farthest out is set to its bound, and the
/// others follow.
CellVertex bounded(LeastSquares squares, const glm::dvec3& mean, const CellBounds& bounds) {
  for (int fixed = 0; fixed < 3; ++fixed) {
    const glm::dvec3 place = mean + squares.solved();
    const glm::dvec3 kept = glm::clamp(place, glm::dvec3(bounds.low), glm::dvec3(bounds.high));
    const glm::dvec3 out = glm::abs(place - kept);
    const int axis = out.x >= out.y && out.x >= out.z ? 0 : out.y >= out.z ? 1 : 2;
    if (!(out[axis] > 0.0)) break;
    squares.fix(axis, kept[axis] - mean[axis]);
  }
  return rounded(mean + squares.solved(), bounds);
}

}  // namespace

Plane plane_of(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  Plane plane;
  const glm::dvec3 u = b - a, v = c - a, w = c - b, normal = glm::cross(u, v);
  const double squared = glm::dot(normal, normal);
  if (!(squared > 0.0)) return plane;
  plane.normal = normal / std::sqrt(squared);
  plane.offset = glm::dot(plane.normal, a);
  const double height_squared =
      squared / std::max({glm::dot(u, u), glm::dot(v, v), glm::dot(w, w)});
  plane.weight = height_squared / (height_squared + kUnknown * kUnknown);
  return plane;
}

void CellPlanes::add(const Plane& plane) {
  if (plane.normal == glm::dvec3(0.0)) return;
  for (Plane& other : std::span(planes_).first(count_)) {
    const glm::dvec3 apart = glm::cross(other.normal, plane.normal);
    if (!(glm::dot(apart, apart) < kSameNormal * kSameNormal)) continue;
    if (plane.weight > other.weight) other = plane;
    return;
  }
  planes_[count_++] = plane;
}

CellVertex mean_vertex(const glm::dvec3& mean, const CellBounds& bounds) {
  CellVertex result = rounded(mean, bounds);
  result.clamped = false;
  return result;
}

CellVertex feature_vertex(const glm::dvec3& mean, const CellPlanes& planes,
                          const CellBounds& bounds) {
  const auto all = planes.all();
  if (all.empty()) return mean_vertex(mean, bounds);
  if (all.size() == 1) {  // the most usual case
    const glm::dvec3& n = all.front().normal;
    const CellVertex on_plane =
        rounded(mean + n * (all.front().offset - glm::dot(n, mean)), bounds);
    if (!on_plane.clamped) return on_plane;
  }
  LeastSquares squares(all, mean);
  squares.add_weight(kSharp);
  const CellVertex sharp = rounded(mean + squares.solved(), bounds);
  if (!sharp.clamped) return sharp;
  LeastSquares blunter = squares;
  blunter.add_weight(kBlunt);
  CellVertex result = rounded(mean + blunter.solved(), bounds);
  if (result.clamped || !lies_at(all, result)) result = bounded(squares, mean, bounds);
  result.clamped = true;
  return result;
}

}  // namespace strata::contouring
