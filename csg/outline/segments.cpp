#include "csg/outline/segments.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace strata::csg {

int Segments::count(double radius) const {
  constexpr double kSmallest = 0x1p-20;
  if (!(radius >= kSmallest) || !std::isfinite(fn)) return 3;
  if (fn > 0) {
    const double whole = round_up ? std::ceil(fn) : std::trunc(fn);
    return static_cast<int>(std::clamp(whole, 3.0, kMost));
  }
  const double angle = std::max(fa, 0.01), length = std::max(fs, 0.01);
  const double wanted = std::min(360.0 / angle, 2.0 * std::numbers::pi * radius / length);
  return static_cast<int>(std::ceil(std::clamp(wanted, 5.0, kMost)));
}

double cos_degrees(double degrees) { return sin_degrees(degrees + 90.0); }

double sin_degrees(double degrees) {
  double turned = std::fmod(degrees, 360.0);
  if (turned < 0) turned += 360.0;
  double sign = 1.0;
  if (turned >= 180.0) turned -= 180.0, sign = -1.0;
  if (turned > 90.0) turned = 180.0 - turned;
  if (turned == 0.0) return 0.0;
  if (turned == 30.0) return sign * 0.5;
  if (turned == 45.0) return sign * std::numbers::sqrt2 / 2.0;
  if (turned == 60.0) return sign * std::numbers::sqrt3 / 2.0;
  if (turned == 90.0) return sign;
  const double radians = std::numbers::pi / 180.0;
  return sign * (turned > 45.0 ? std::cos((90.0 - turned) * radians) : std::sin(turned * radians));
}

}  // namespace strata::csg
