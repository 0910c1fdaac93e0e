#pragma once

#include <string>

#include "core/execution.h"
#include "core/result.h"

namespace strata::csg {

/// The `.csg` text that the installed `openscad` makes of a program. It runs as a child process,
/// without a terminal, and is killed when the time is over or a stop is requested.
/// @return kInput: openscad is not installed (and what to do then), refused the program (with the
/// end of what it said), took too long; kCancelled
Result<std::string> run_openscad(const std::string& path, double timeout_s,
                                 const Execution& execution = {});

}  // namespace strata::csg
