#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "apps/session/file_conflicts.h"
#include "apps/session/interrupt.h"
#include "apps/session/progress.h"
#include "core/atomic_file.h"
#include "core/printable.h"
#include "strata/core/execution.h"
#include "strata/core/file_identity.h"
#include "strata/core/result.h"

namespace strata::apps {

/// What every sub-command takes.
struct CommonOptions {
  int threads = 0;                 ///< 0: all processors
  std::uint64_t memory_limit = 0;  ///< bytes; 0: three quarters of what this process may use
  bool quiet = false;              ///< errors only
  bool verbose = false;            ///< also say what is done
  ProgressMode progress = ProgressMode::kAuto;
  bool strict = false;        ///< warnings are errors
  double time_limit_s = 0.0;  ///< of the whole command; 0: none
};

/// Something the user should know of that did not stop the run.
struct Warning {
  std::string code;  ///< for machines, see docs/json.md
  std::string message;
};

/// One run of a command: its clock, its talk on standard error, interrupts and limits.
class Session {
 public:
  using Clock = std::chrono::steady_clock;

  explicit Session(Clock::time_point start) : start_(start) { interrupts_.emplace(); }
  /// For a program that has its own ways to talk and to stop, such as a window: nothing is printed,
  /// signals are left alone, and every phase runs as `execution`.
  Session(Clock::time_point start, Execution execution)
      : start_(start), given_(std::move(execution)) {
    options_.quiet = true;
  }

  /// Takes the options every command has. Sets a wall against memory beyond the limit.
  void configure(const CommonOptions& options);

  /// What the command writes, for opened(). @param together  the files appear together, by
  /// commit_outputs(); for the thread that writes them
  void set_outputs(std::vector<FileUse> written, bool together = false);
  /// Holds files that were opened against those that will be written. @return kUsage naming the two
  [[nodiscard]] Result<void> opened(std::span<const FileIdentity> files) const;
  /// Gives all files that have been written their names. @return kOutput
  Result<void> commit_outputs();
  /// Where an output lies before that.
  [[nodiscard]] std::string place_of(const std::string& path) const {
    return group_ ? group_->place_of(path) : path;
  }

  /// For the next phase of the job; `label` is what the progress bar says. All phases share one
  /// bar, which never goes back: this one goes on from where the last one was seen, and takes
  /// `share` of what is left.
  [[nodiscard]] Execution execution(std::string label, double share = 0.5);
  /// Takes the progress bar away, before a report is printed.
  void end_progress() { bar_.reset(); }
  [[nodiscard]] int threads() const;
  [[nodiscard]] std::uint64_t memory_limit() const { return memory_limit_; }
  /// Whether --time-limit is over; then interrupted() is true as well.
  [[nodiscard]] bool timed_out() const { return timed_out_.load(); }
  [[nodiscard]] bool interrupted() const { return interrupts_ && interrupts_->interrupted(); }

  /// Prints and keeps a warning; one that was given already is not repeated. Under --strict the job
  /// ends at the next check_strict().
  void warn(std::string code, std::string message);
  /// A line that a scene's program prints itself.
  void echo(std::string_view line);
  /// A line for a person: on a terminal alone, and not with --quiet.
  void tell(std::string_view line);
  /// Something for --verbose.
  void note(std::string_view message);
  /// @return kGeometry with the first warning's text under --strict
  [[nodiscard]] Result<void> check_strict() const;
  [[nodiscard]] const std::vector<Warning>& warnings() const { return warnings_; }
  void complain(const Error& error);  ///< prints `strata: error: ...`

  [[nodiscard]] double milliseconds() const;  ///< since the program began

 private:
  void say(std::string_view kind, std::string_view message);
  void print(std::string_view line);
  void watch_time(double limit_s);

  Clock::time_point start_;
  std::optional<InterruptGuard> interrupts_;
  std::optional<Execution> given_;
  CommonOptions options_;
  std::uint64_t memory_limit_ = 0;
  std::optional<ProgressBar> bar_;
  double shown_ = 0;  ///< of the bar
  std::vector<FileUse> outputs_;
  std::optional<OutputGroup> group_;
  bool committed_ = false;  ///< some outputs have their names
  std::vector<Warning> warnings_;
  std::set<std::string> given_warnings_;
  std::atomic<bool> timed_out_{false};
  std::jthread watch_;  ///< of --time-limit
};

/// Writes all of `text` to a descriptor. @return kOutput naming `name`
Result<void> write_text(int descriptor, std::string_view text, const std::string& name);

/// Prints a report where the user asked for it: "-" is standard output, or standard error when that
/// carries the output file; else a file. @return kOutput
Result<void> print_report(std::string_view text, const std::string& where, bool stdout_is_taken);

/// "12.3 MB", powers of 1000 with three digits.
[[nodiscard]] std::string readable_bytes(std::uint64_t bytes);

}  // namespace strata::apps
