#pragma once

#include <cstdint>
#include <vector>

#include "csg/arrangement/cut_lines.h"

namespace strata::csg {

/// A place next to the front of a triangle: so near to the corner v that nothing is closer than the
/// triangle's own side, v + d (u - v) + d^2 (w - v) + d^3 n for all d that are small enough.
struct Nearby {
  std::uint32_t triangle;
  std::uint32_t v, u, w;  ///< its corners, in any order
};

/// Counts winding numbers along rays towards -x. All comparisons are exact.
class WindingRays {
 public:
  /// @param rays  how many will be asked for, about
  WindingRays(const ArrangementInput& input, std::size_t rays);

  /// Adds the winding numbers at a place to `windings`, of each solid.
  void count(const Nearby& place, std::vector<std::int32_t>& windings) const;

 private:
  void build(std::size_t rays);
  std::size_t cell(const exact::LatticePoint& p) const;
  void cross(std::uint32_t triangle, const Nearby& place, const exact::Normal& normal,
             std::vector<std::int32_t>& windings) const;

  const ArrangementInput& input_;
  // Cells over y and z; none when there are few rays.
  std::size_t across_ = 1, size_[2] = {1, 1};
  exact::LatticePoint low_{0};
  std::vector<std::uint32_t> first_, triangles_;
};

}  // namespace strata::csg
