#pragma once

namespace strata {

/// Which winding numbers are inside.
enum class InsideRule { kWinding, kNonzero, kParity };  // > 0, != 0, odd

}  // namespace strata
