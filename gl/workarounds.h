#pragma once

#include <string_view>
#include <vector>

#include "strata/gl/context.h"

namespace strata::gl {

/// Every workaround there is, in force where `info` (all else of it is known by now) shows the
/// driver that needs it, or where `switches` says so: the value of STRATA_GL_WORKAROUNDS.
[[nodiscard]] std::vector<Workaround> choose_workarounds(const Info& info,
                                                         std::string_view switches);

}  // namespace strata::gl
