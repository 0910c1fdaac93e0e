#pragma once

#include <string>
#include <vector>

#include "core/execution.h"
#include "core/result.h"

namespace strata::csg {

/// What a run of `openscad` gave.
struct OpenscadRun {
  std::string text;                   ///< the `.csg`
  std::vector<std::string> warnings;  ///< its own, `file:line: openscad: WARNING: ...`
  std::vector<std::string> notes;     ///< all else it said, line by line: ECHO, DEPRECATED, ...
};

/// The `.csg` text that the installed `openscad` makes of a program. It runs as a child process,
/// without a terminal, and is killed when the time is over or a stop is requested. It ends well
/// also after errors of the program, so that what it says decides.
/// @return kInput: openscad is not installed (and what to do then), refused the program (with the
/// end of what it said), reported an error, took too long; kCancelled
Result<OpenscadRun> run_openscad(const std::string& path, double timeout_s,
                                 const Execution& execution = {});

}  // namespace strata::csg
