#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/view/script.h"
#include "apps/view/viewer.h"

namespace strata::view {

/// What a script needs of a window beside the viewer.
class Stage {
 public:
  virtual ~Stage() = default;
  virtual void resize(const glm::ivec2& size) = 0;
  /// Of what is on the screen, all of it or the picture alone.
  virtual Result<void> screenshot(const std::string& path, bool picture_only) = 0;
  /// A line to standard output.
  virtual void print(const std::string& line) = 0;
};

/// Runs the commands of a script, some of them over many turns of the window's loop. A command
/// begins when no load is under way; those that look at the picture when it is whole.
class ScriptRunner {
 public:
  /// @param name of the script, for messages
  ScriptRunner(std::vector<ScriptCommand> commands, std::string name)
      : commands_(std::move(commands)), name_(std::move(name)) {}

  /// Goes on as far as can be now. To be called once a turn, after what was on the screen has been
  /// presented. @return what the command failed with, naming file:line
  Result<void> step(Viewer& viewer, Stage& stage);
  /// All commands are done.
  [[nodiscard]] bool ended() const { return next_ == commands_.size(); }
  /// Commands done so far.
  [[nodiscard]] std::size_t position() const { return next_; }
  [[nodiscard]] bool quit() const { return quit_; }
  /// Whether a command picks, and prints a measurement.
  [[nodiscard]] static bool measures(Action action);

 private:
  using Clock = std::chrono::steady_clock;
  /// True when the command is done, false when it wants another turn.
  Result<bool> run(const ScriptCommand& command, Viewer& viewer, Stage& stage);
  static Result<void> apply(const ScriptCommand& command, Viewer& viewer);
  /// What panels and history show, at once.
  static Result<void> window(const ScriptCommand& command, Viewer& viewer);
  /// What opens, sets and tells, but for pictures.
  [[nodiscard]] static bool is_of_document(Action action);
  Result<bool> document(const ScriptCommand& command, Viewer& viewer, Stage& stage);
  Result<bool> export_file(const ScriptCommand& command, Viewer& viewer, Stage& stage);
  /// @return whether what was to be read is; a change of its files from now on is new. Why it
  /// cannot
  ///   be read
  Result<bool> done_loading(const Viewer& viewer);
  [[nodiscard]] static bool is_guide(Action action);
  Result<bool> measure(const ScriptCommand& command, Viewer& viewer, Stage& stage);
  Result<bool> guide(const ScriptCommand& command, Viewer& viewer, Stage& stage);
  bool drag(const ScriptCommand& command, Viewer& viewer);
  bool wait(const ScriptCommand& command, const Viewer& viewer);
  static Result<void> see_through(const ScriptCommand& command, Viewer& viewer);
  static Result<void> section(const ScriptCommand& command, Viewer& viewer);
  static Result<void> voxels(const ScriptCommand& command, Viewer& viewer);
  static Result<void> solids(const ScriptCommand& command, Viewer& viewer);

  std::vector<ScriptCommand> commands_;
  std::string name_;
  std::size_t next_ = 0;
  bool begun_ = false;  ///< the command has had its first turn
  bool acted_ = false;  ///< something may have changed that a tick has not seen
  bool quit_ = false;
  int moves_ = 0;
  std::uint64_t measured_ = 0;  ///< before the command that measures
  Clock::time_point since_{};
  std::uint64_t loads_seen_ = 1;    ///< loads that were waited for; the first one always is
  std::uint64_t loads_before_ = 0;  ///< that had ended when the command began
};

/// The numbers of the part as one line of JSON. @pre they have been measured
[[nodiscard]] std::string numbers_json(const Viewer& viewer);

/// The statistics as one line of JSON.
[[nodiscard]] std::string statistics_json(const Viewer& viewer);

}  // namespace strata::view
