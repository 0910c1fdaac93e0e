#pragma once

#include <span>

#include "strata/csg/picture/picture.h"

namespace strata::view {

/// The values that the first and the last colour of a map stand for.
struct ValueRange {
  double low = 0, high = 0;
  bool below = false, above = false;  ///< there are values outside of it
};

/// A range of round ends around the values between the 2nd and the 98th percentile; from 0 where
/// these hardly differ. Values that are not above 0, or infinite, do not count. All 0: no values.
[[nodiscard]] ValueRange percentile_range(std::span<const float> values);

/// A range that was given, with what lies outside of it.
[[nodiscard]] ValueRange given_range(double low, double high, std::span<const float> values);

/// The colour of a part of a heat map's range, in [0, 1]: dark blue, green, yellow.
[[nodiscard]] csg::Rgba heat_colour(double part);

}  // namespace strata::view
