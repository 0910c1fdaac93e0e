#include "mesh/repair/written_positions.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace strata {

using exact::FilePoint;
using exact::Int128;

Result<WrittenPositions> WrittenPositions::make(const glm::dvec3& origin, double step,
                                                bool as_float) {
  constexpr double kReach = 0x1p52;  // of the lattice, in 2^-24 step
  WrittenPositions result;
  result.as_float_ = as_float;
  result.unit_ = std::ldexp(step, -exact::kFileBits);
  const int digits =
      as_float ? std::numeric_limits<float>::digits : std::numeric_limits<double>::digits;
  double furthest = 0;
  for (int k = 0; k < 3; ++k) {
    furthest = std::max(furthest, std::abs(origin[k]));
    const double steps = origin[k] / step;
    if (!(std::abs(steps) < std::ldexp(1.0, digits + exact::kFileBits))) {
      return fail(ErrorCode::kGeometry,
                  "the result is {} from the origin, where a {} cannot hold steps of {}{}",
                  furthest, as_float ? "float" : "double", step,
                  as_float ? "; a format with double positions can" : "");
    }
    result.offset_[static_cast<std::size_t>(k)] =
        static_cast<Int128>(steps) * (Int128{1} << exact::kFileBits);
  }
  if (as_float && (furthest + kReach * result.unit_ > std::numeric_limits<float>::max() ||
                   result.unit_ < std::numeric_limits<float>::min())) {
    return fail(ErrorCode::kGeometry,
                "steps of {} and positions up to {} do not fit in a float; "
                "a format with double positions can hold them",
                step, furthest + kReach * result.unit_);
  }
  result.rounds_ = as_float || furthest / result.unit_ + kReach > 0x1p53;
  return result;
}

FilePoint WrittenPositions::round(const FilePoint& point) const {
  if (!rounds_) return point;
  FilePoint result;
  for (int k = 0; k < 3; ++k) {
    const Int128 offset = offset_[static_cast<std::size_t>(k)], sum = offset + point[k];
    const Int128 rounded = as_float_ ? static_cast<Int128>(static_cast<float>(sum))
                                     : static_cast<Int128>(static_cast<double>(sum));
    result[k] = static_cast<std::int64_t>(rounded - offset);
  }
  return result;
}

FilePoint WrittenPositions::neighbour(const FilePoint& point, int axis, bool forwards) const {
  const Int128 offset = offset_[static_cast<std::size_t>(axis)], sum = offset + point[axis];
  const double towards = forwards ? 0x1p127 : -0x1p127;
  const Int128 next = as_float_
                          ? static_cast<Int128>(std::nextafter(static_cast<float>(sum),
                                                               static_cast<float>(towards)))
                          : static_cast<Int128>(std::nextafter(static_cast<double>(sum), towards));
  FilePoint result = point;
  // Numbers near 0 are closer together than 2^-24 step.
  const Int128 step = forwards ? std::max<Int128>(next - sum, 1) : std::min<Int128>(next - sum, -1);
  result[axis] += static_cast<std::int64_t>(step);
  return result;
}

glm::dvec3 WrittenPositions::world(const FilePoint& point) const {
  glm::dvec3 result;
  for (int k = 0; k < 3; ++k) {
    result[k] = static_cast<double>(offset_[static_cast<std::size_t>(k)] + point[k]) * unit_;
  }
  return result;
}

}  // namespace strata
