#pragma once

#include <cstdint>

#include "csg/gl/result_lists.h"

namespace strata::csg {

struct ResultListsForTests {
  /// Tables of at most that many bytes, 32 at least, where the driver takes larger ones.
  static void limit_binding(GlResultSource& source, std::uint64_t bytes);
};

}  // namespace strata::csg
