#include "apps/view/measure/value_range.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "apps/view/measure/guides.h"

namespace strata::view {
namespace {

/// Samples of the colour map viridis (S. van der Walt, N. Smith, 2015): as even to the eye as to
/// the colour-blind eye.
constexpr glm::vec3 kHeat[] = {{68, 1, 84},    {72, 40, 120},  {62, 74, 137},  {49, 104, 142},
                               {38, 130, 142}, {31, 158, 137}, {53, 183, 121}, {109, 205, 89},
                               {180, 222, 44}, {253, 231, 37}};

}  // namespace

ValueRange given_range(double low, double high, std::span<const float> values) {
  ValueRange range{low, high, false, false};
  const double slack = 1e-6 * std::abs(high);
  for (const float value : values) {
    if (!(value > 0.0f)) continue;
    range.below = range.below || static_cast<double>(value) < low - slack;
    range.above = range.above || static_cast<double>(value) > high + slack;
  }
  return range;
}

ValueRange percentile_range(std::span<const float> values) {
  std::vector<float> sorted;
  for (const float value : values) {
    if (value > 0.0f && std::isfinite(value)) sorted.push_back(value);
  }
  if (sorted.empty()) return {};
  const auto at = [&](double part) {
    const auto i = static_cast<std::ptrdiff_t>(part * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), sorted.begin() + i, sorted.end());
    return static_cast<double>(sorted[static_cast<std::size_t>(i)]);
  };
  double low = at(0.02), high = at(0.98);
  // Round ends do not flicker from picture to picture.
  constexpr double kAlike = 1e-3, kSteps = 8.0, kSlack = 1e-4;
  if (high - low < kAlike * high) low = 0.0;
  const double step = round_step((high - low) / kSteps);
  low = std::floor(low / step + kSlack) * step;
  high = std::ceil(high / step - kSlack) * step;
  return given_range(low, high, values);
}

csg::Rgba heat_colour(double part) {
  constexpr int kLast = static_cast<int>(std::size(kHeat)) - 1;
  const double at = std::clamp(part, 0.0, 1.0) * kLast;
  const int below = std::min(static_cast<int>(at), kLast - 1);
  const auto rest = static_cast<float>(at - below);
  const glm::vec3 colour = kHeat[below] * (1 - rest) + kHeat[below + 1] * rest;
  return csg::Rgba(glm::u8vec3(colour + 0.5f), 255);
}

}  // namespace strata::view
