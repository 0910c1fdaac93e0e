#pragma once

#include <functional>
#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "apps/commands/commands.h"
#include "apps/view/scene/renderer.h"
#include "apps/view/script.h"

namespace CLI {
class App;
}

namespace strata::view {

/// The command line of strata-view.
struct ViewOptions {
  /// Inputs, camera, colours, edges, as `strata csg` has them; `size` is the window's.
  apps::CsgCommand command;
  bool watch = false;
  bool ghosts = false;
  bool panels = true;
  Heat heat = Heat::kOff;
  std::string editor;         ///< a command that opens a file at a line; empty: none
  std::string look;           ///< "dark", "light"; empty: the one that was chosen last
  bool default_size = false;  ///< the window's size was not given
  /// A hand will close the window: it opens as large as it was the last time.
  [[nodiscard]] bool attended() const { return script.empty() && screenshot.empty(); }
  std::string media;   ///< a file of media; empty: none
  std::string script;  ///< a file, "-": standard input; empty: none
  std::string
      screenshot;  ///< taken when all is drawn and the script is done; then the window closes
};

/// Reads the command line. A ParseOutcome is to be printed, and the program to end.
[[nodiscard]] std::variant<apps::ParseOutcome, ViewOptions> parse_view_options(
    int argc, const char* const* argv);

/// Defines the options, without what they are read into, and hands them to `visit`.
void visit_view_options(const std::function<void(const CLI::App&)>& visit);

/// Looks whether the window would write a file that it reads, or one twice.
/// Those of scenes are looked at when they are loaded.
/// @param commands of the script @return as apps::check_files()
[[nodiscard]] Result<void> check_files(ViewOptions& options,
                                       const std::vector<ScriptCommand>& commands);

}  // namespace strata::view
