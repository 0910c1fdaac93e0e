#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "strata/core/depth_list.h"
#include "strata/core/inside_rule.h"

// Private to csg/.

namespace strata::csg {

/// Where a ray enters or leaves one solid: its flips along a ray increase in depth and begin with
/// an entry.
struct Flip {
  static constexpr std::uint32_t kNone = 0xffffffffu;
  std::uint32_t depth = 0;
  std::uint32_t solid = 0;
  std::uint32_t triangle = 0;  ///< of the solid's ViewPart; kNone: the ray begins inside
  bool exit = false;
};

/// Turns the sorted crossings of one ray with one solid into flips under an inside rule, appended
/// to `flips`. With `cut` the ray may begin inside, which the crossings tell from the far end.
/// Crossings of an open solid that have no partner become sheets one step thick.
void flips_of(std::span<const DepthItem> crossings, std::uint32_t solid, InsideRule rule, bool cut,
              std::vector<Flip>& flips);

}  // namespace strata::csg
