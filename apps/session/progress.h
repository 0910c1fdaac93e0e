#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <string_view>

namespace strata {

/// When a ProgressBar draws.
enum class ProgressMode {
  kAuto,  ///< only on a terminal that can move its cursor (TERM is not "dumb")
  kBar,   ///< always
  kNone   ///< never
};

/// One line of a progress bar, without line end: `lists [#####     ]  50 %  12 s left`.
/// @param fraction in [0, 1]; what lies outside is clamped
/// @param elapsed_s seconds since the start; the rest is shown once 1 % and 2 s have passed
/// @param columns width of the terminal; the line is at most columns - 1 wide
/// @param colour whether the bar may hold colour escapes
[[nodiscard]] std::string progress_line(std::string_view label, double fraction, double elapsed_s,
                                        int columns, bool colour);

/// A progress bar on standard error for the phases of a command. It draws on terminals only, at
/// most ten times a second, without colour when NO_COLOR is set, and removes itself when done: logs
/// and pipes never see it. Not for use by several threads at once; Execution::progress is called by
/// one. Move is not needed and not offered.
class ProgressBar {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param label what is being done, in a word or two
  /// @param descriptor where to draw; standard error
  explicit ProgressBar(std::string label, ProgressMode mode = ProgressMode::kAuto,
                       int descriptor = 2);
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  ~ProgressBar();  ///< clears the line

  /// Names the next phase and begins its time anew.
  void begin(std::string label, Clock::time_point now = Clock::now());
  /// Draws the finished fraction in [0, 1], unless it has just done so.
  void update(double fraction, Clock::time_point now = Clock::now());
  /// Clears the line; the next update() draws again. To be called before anything else is printed.
  void clear();

  /// update() as Execution::progress takes it; empty when nothing will be drawn. The bar must
  /// outlive it.
  [[nodiscard]] std::function<void(double)> callback();
  [[nodiscard]] bool draws() const { return draws_; }

 private:
  void put(std::string_view text);

  std::string label_;
  int descriptor_;
  bool draws_ = false;
  bool colour_ = false;
  bool visible_ = false;
  bool drawn_ = false;  // in this phase
  Clock::time_point started_, last_;
};

}  // namespace strata
