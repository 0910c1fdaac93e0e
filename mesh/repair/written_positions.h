#pragma once

#include <array>
#include <glm/vec3.hpp>

#include "exact/cut_points.h"
#include "strata/core/result.h"

namespace strata {

/// Where points are once their world positions are written as double or float. Positions are whole
/// multiples of 2^-24 step, and rounding them to fewer bits gives such multiples again, since the
/// origin is one too. So everything about written positions can be decided in integers.
class WrittenPositions {
 public:
  /// Lattice points p lie at world origin + step * p; the step is a power of two and the origin a
  /// multiple of it.
  /// @return kGeometry when such numbers cannot tell points of the lattice apart: it is too far
  /// from the origin
  static Result<WrittenPositions> make(const glm::dvec3& origin, double step, bool as_float);

  /// The nearest point that can be written.
  exact::FilePoint round(const exact::FilePoint& point) const;
  /// The next point along an axis that can be written, forwards or backwards.
  exact::FilePoint neighbour(const exact::FilePoint& point, int axis, bool forwards) const;
  bool as_float() const { return as_float_; }
  /// Whether round() may move points.
  bool rounds() const { return rounds_; }
  /// World space; exact for points that can be written.
  glm::dvec3 world(const exact::FilePoint& point) const;

 private:
  std::array<exact::Int128, 3> offset_{};  // of the origin, in 2^-24 step
  double unit_ = 1;                        // 2^-24 step, in world units
  bool as_float_ = false, rounds_ = false;
};

}  // namespace strata
