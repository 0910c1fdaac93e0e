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
  std::vector<std::string> options = {};  ///< passed on to openscad, word by word: "-D", "x=40"
  double timeout_s = 300.0;
};

/// The output of a run of `openscad`.
struct OpenscadRun {
  std::string text;                   ///< the `.csg` text
  std::vector<std::string> warnings;  ///< openscad's warnings, `file:line: openscad: WARNING: ...`
  std::vector<std::string> notes;     ///< every other line that it printed: ECHO, DEPRECATED, ...
  /// The files that it read: the program and those it includes, uses and imports. A missing file
  /// has no identity.
  std::vector<FileIdentity> files;
  std::optional<SceneView> view;  ///< the view, if the program sets one
};

/// Converts a program to `.csg` text by the installed `openscad`. It runs as a child process
/// without a terminal. It is killed when the time is over, when a stop is requested, or when this
/// process ends. Its output goes to memory. Its exit status is 0 even after errors in the program,
/// so its messages decide.
/// @return kInput: openscad is not installed (with advice), refused the program (with the end of
/// its output), reported an error or took too long; kCancelled
Result<OpenscadRun> run_openscad(const std::string& path, const OpenscadOptions& options,
                                 const Execution& execution = {});

/// The files that a make rule, as `openscad -d` writes it, depends on.
[[nodiscard]] std::vector<std::string> files_of_rule(std::string_view rule);

/// Whether a program's text assigns a variable outside of all braces.
[[nodiscard]] bool assigns(std::string_view program, std::string_view variable);

}  // namespace strata::csg
