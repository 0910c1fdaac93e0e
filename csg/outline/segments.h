#pragma once

namespace strata::csg {

/// How finely round shapes are divided: OpenSCAD's $fn, $fa and $fs.
struct Segments {
  static constexpr double kMost = 1e6;  ///< segments of a full circle

  double fn = 0;          ///< segments of a full circle; 0: derived from fa and fs
  double fa = 12;         ///< smallest angle of a segment, degrees
  double fs = 2;          ///< smallest length of a segment
  bool round_up = false;  ///< newer dialect: a fractional $fn is rounded up, not down

  /// The number of segments of a full circle of `radius`, at least 3.
  [[nodiscard]] int count(double radius) const;
};

/// Cosine and sine of degrees, exact at multiples of 30 and 45.
[[nodiscard]] double cos_degrees(double degrees);
[[nodiscard]] double sin_degrees(double degrees);

}  // namespace strata::csg
