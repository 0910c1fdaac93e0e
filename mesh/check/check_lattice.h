#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "exact/cut_points.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"

namespace strata {

/// The vertices of a mesh on a lattice of its own: world = low + step * point, for points from 0 to
/// 2^53. The step is a power of two.
struct CheckLattice {
  glm::dvec3 low{0.0};
  double step = 1.0;
  std::vector<exact::FilePoint> points;  ///< one for each position
  std::uint64_t moved = 0;               ///< positions that do not lie on the lattice

  [[nodiscard]] glm::dvec3 world(const glm::dvec3& point) const { return low + step * point; }
};

inline constexpr int kCheckBits = 53;

/// @return kGeometry for a position that is not finite
Result<CheckLattice> check_lattice(std::span<const glm::dvec3> positions,
                                   const Execution& execution);

}  // namespace strata
