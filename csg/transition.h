#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "strata/core/depth_list.h"
#include "strata/core/inside_rule.h"

// Private to csg/.

namespace strata::csg {

/// Where a ray enters or leaves one solid. The transitions of a solid along a ray increase in depth
/// and begin with an entry. S. D. Roth, "Ray casting for modeling solids" (1982), classifies
/// rays so.
struct Transition {
  static constexpr std::uint32_t kNone = 0xffffffffu;
  std::uint32_t depth = 0;
  std::uint32_t solid = 0;
  std::uint32_t triangle = 0;  ///< of the solid's ViewPart; kNone: the ray begins inside
  bool exit = false;
};

/// Turns the sorted crossings of one ray with one solid into transitions under an inside rule,
/// appended to `transitions`. With `cut` the ray may begin inside, which the crossings tell from
/// the far end. Crossings of an open solid that have no partner become sheets one step thick.
void transitions_of(std::span<const DepthItem> crossings, std::uint32_t solid, InsideRule rule,
                    bool cut, std::vector<Transition>& transitions);

}  // namespace strata::csg
