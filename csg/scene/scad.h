#pragma once

#include <optional>
#include <string>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/file_identity.h"
#include "strata/core/result.h"
#include "strata/csg/scene/scene.h"

namespace strata::csg {

struct OpenscadOptions {
  std::vector<std::string> options = {};  ///< handed on, word by word: "-D", "x=40"
  double timeout_s = 300.0;
};

/// What a run of `openscad` gave.
struct OpenscadRun {
  std::string text;                   ///< the `.csg`
  std::vector<std::string> warnings;  ///< its own, `file:line: openscad: WARNING: ...`
  std::vector<std::string> notes;     ///< all else it said, line by line: ECHO, DEPRECATED, ...
  /// What it read: the program, what that includes, uses and imports. What is not there has no
  /// identity.
  std::vector<FileIdentity> files;
  std::optional<SceneView> view;  ///< where the program says something of it
};

/// The `.csg` text that the installed `openscad` makes of a program. It runs as a child process,
/// without a terminal, and is killed when the time is over, when a stop is requested, or when the
/// thread that runs it is gone with the whole process. What it writes goes to memory. It ends well
/// also after errors of the program, so that what it says decides.
/// @return kInput: openscad is not installed (and what to do then), refused the program (with the
/// end of what it said), reported an error, took too long; kCancelled
Result<OpenscadRun> run_openscad(const std::string& path, const OpenscadOptions& options,
                                 const Execution& execution = {});

/// What a rule for `make` of the kind that `openscad -d` writes depends on.
[[nodiscard]] std::vector<std::string> files_of_rule(std::string_view rule);

/// Whether a program's text gives a variable a value outside of all braces.
[[nodiscard]] bool assigns(std::string_view program, std::string_view variable);

}  // namespace strata::csg
