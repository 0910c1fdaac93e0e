#include "voxelize/picture/voxel_slope.h"

#include <algorithm>
#include <cmath>

namespace strata {
namespace {

// The bump is a product over the axes of (1 - (x / R)^2)^2: smooth, and a polynomial, so that its
// integral over a run is one.
constexpr double kRadius = 3.0;
/// Columns that the bump barely touches are left out: they cost as much as others.
constexpr double kLeastWeight = 0.02;
constexpr int kMostColumns = 8;  // that meet an interval of length 2 R

/// The bump at x.
double bump(double x) {
  const double s = x / kRadius;
  if (s <= -1 || s >= 1) return 0.0;
  return (1 - s * s) * (1 - s * s);
}
/// Its integral from 0 to x.
double integral(double x) {
  const double s = std::clamp(x / kRadius, -1.0, 1.0);
  const double q = s * s;
  return kRadius * s * (1 - q * (2.0 / 3.0 - q / 5.0));
}

/// How much the columns along an axis count, and how that changes as the point moves.
struct Weights {
  int first = 0, count = 0;
  double weight[kMostColumns], change[kMostColumns];

  Weights(double at, int columns) {
    first = std::max(0, static_cast<int>(std::floor(at - kRadius)));
    const int end = std::min(columns, static_cast<int>(std::floor(at + kRadius)) + 1);
    if (integral(first + 1 - at) - integral(first - at) < kLeastWeight) ++first;
    for (int i = first; i < end && count < kMostColumns; ++i) {
      weight[count] = integral(i + 1 - at) - integral(i - at);
      change[count] = bump(i - at) - bump(i + 1 - at);
      if (weight[count] >= kLeastWeight) ++count;
    }
  }
};

}  // namespace

glm::dvec3 occupancy_slope(const VoxelIntervals& set, const glm::dvec3& point) {
  const AxisFrame frame(set.axis());
  const Weights across(point[frame.u], set.columns());
  const Weights down(point[frame.v], set.grid().dims[frame.v]);
  const Weights layers(point[frame.w], set.grid().dims[frame.w]);
  const double along = point[frame.w];
  const int low = layers.first, high = layers.first + layers.count;
  glm::dvec3 sum(0.0);
  for (int j = 0; j < down.count; ++j) {
    const int v = down.first + j;
    if (v < set.v_begin() || v >= set.v_end()) continue;
    double mass = 0.0, sloped = 0.0, ends = 0.0;
    for (int i = 0; i < across.count; ++i) {
      const std::span<const Interval> runs = set.column(across.first + i, v);
      auto run = std::partition_point(runs.begin(), runs.end(),
                                      [low](Interval one) { return one.end() <= low; });
      for (; run != runs.end() && run->begin() < high; ++run) {
        const double from = std::max(run->begin(), low) - along;
        const double to = std::min(run->end(), high) - along;
        const double inside = integral(to) - integral(from);
        mass += across.weight[i] * inside;
        sloped += across.change[i] * inside;
        ends += across.weight[i] * (bump(from) - bump(to));
      }
    }
    sum[frame.u] += down.weight[j] * sloped;
    sum[frame.v] += down.change[j] * mass;
    sum[frame.w] += down.weight[j] * ends;
  }
  return sum;
}

}  // namespace strata
