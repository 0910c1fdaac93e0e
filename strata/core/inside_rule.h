#pragma once

namespace strata {

/// Which winding numbers are inside.
enum class InsideRule { kWinding, kNonzero, kParity };  // > 0, != 0, odd

/// Whether a point of this winding number is inside.
[[nodiscard]] constexpr bool is_inside(InsideRule rule, int winding) {
  switch (rule) {
    case InsideRule::kWinding:
      return winding > 0;
    case InsideRule::kNonzero:
      return winding != 0;
    case InsideRule::kParity:
      break;
  }
  return winding % 2 != 0;
}

}  // namespace strata
