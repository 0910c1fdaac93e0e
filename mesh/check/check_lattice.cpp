#include "mesh/check/check_lattice.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>

#include "mesh/block_sum.h"
#include "strata/mesh/soup_tools.h"

namespace strata {
namespace {

constexpr std::size_t kAllFinite = ~std::size_t{0};

struct Reach {
  Bounds box;
  std::size_t not_finite = kAllFinite;
};

Reach extent_of(std::span<const glm::dvec3> positions, const Execution& execution) {
  return detail::fold_blocks<Reach>(
      execution, positions.size(),
      [&](Reach& extent, std::size_t i) {
        const glm::dvec3& p = positions[i];
        if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) {
          extent.box.include(p);
        } else {
          extent.not_finite = std::min(extent.not_finite, i);
        }
      },
      [](Reach& total, const Reach& part) {
        total.box.include(part.box);
        total.not_finite = std::min(total.not_finite, part.not_finite);
      });
}

// A power of two such that `side` spans at most 2^kCheckBits steps.
double step_for(double side) {
  int exponent = 0;
  std::frexp(side, &exponent);  // side < 2^exponent
  return std::ldexp(1.0, std::max(exponent - kCheckBits, -1074));
}

// x - low is `difference` and a rounding error, which Knuth's sum of two doubles tells. The
// difference is a whole number of steps if there is no error and its quotient is whole.
struct Placed {
  std::int64_t steps;
  bool exact;
};
Placed place(double x, double low, double step) {
  const double difference = x - low;
  const double part = difference - x;
  const double error = (x - (difference - part)) - (low + part);
  const double quotient = difference / step, steps = std::nearbyint(quotient);
  return {static_cast<std::int64_t>(steps), error == 0.0 && steps == quotient};
}

}  // namespace

Result<CheckLattice> check_lattice(std::span<const glm::dvec3> positions,
                                   const Execution& execution) {
  CheckLattice lattice;
  if (positions.empty()) return lattice;
  const Reach extent = extent_of(positions, execution);
  if (extent.not_finite != kAllFinite) {
    return fail(ErrorCode::kGeometry, "vertex {} of the mesh has a coordinate that is not finite",
                extent.not_finite);
  }
  const double side = extent.box.longest_side();
  if (!std::isfinite(side)) {
    return fail(ErrorCode::kGeometry,
                "the mesh spans more than a double holds: from {} to {} along an axis",
                std::min({extent.box.low.x, extent.box.low.y, extent.box.low.z}),
                std::max({extent.box.high.x, extent.box.high.y, extent.box.high.z}));
  }
  lattice.low = extent.box.low;
  lattice.step = side > 0 ? step_for(side) : 1.0;
  lattice.points.resize(positions.size());
  constexpr std::size_t kBlock = std::size_t{1} << 14;
  std::atomic<std::uint64_t> moved = 0;
  parallel_for(execution, (positions.size() + kBlock - 1) / kBlock, [&](std::size_t block, int) {
    std::uint64_t count = 0;
    const std::size_t end = std::min(positions.size(), (block + 1) * kBlock);
    for (std::size_t i = block * kBlock; i < end; ++i) {
      bool exact = true;
      for (int k = 0; k < 3; ++k) {
        const Placed placed = place(positions[i][k], lattice.low[k], lattice.step);
        lattice.points[i][k] = placed.steps;
        exact = exact && placed.exact;
      }
      count += !exact;
    }
    moved += count;
  });
  lattice.moved = moved;
  return lattice;
}

}  // namespace strata
