#include "apps/session/progress.h"

#include <fmt/core.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace strata {
namespace {

constexpr int kLongestBar = 40;
constexpr int kShortestBar = 4;
constexpr auto kRedrawInterval = std::chrono::milliseconds(100);

// A variable that is set and not empty, as https://no-color.org asks.
bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

bool can_draw(ProgressMode mode, int descriptor) {
  if (mode != ProgressMode::kAuto) return mode == ProgressMode::kBar;
  const char* terminal = std::getenv("TERM");
  return isatty(descriptor) == 1 && (terminal == nullptr || std::string_view(terminal) != "dumb");
}

int terminal_columns(int descriptor) {
  winsize size{};
  if (ioctl(descriptor, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
  return size.ws_col;
}

std::string duration_text(double seconds) {
  const auto whole = static_cast<long>(std::ceil(std::min(seconds, 3.6e8)));
  if (whole < 100) return fmt::format("{} s", whole);
  if (whole < 6000) return fmt::format("{} min", (whole + 59) / 60);
  return fmt::format("{} h", (whole + 3599) / 3600);
}

}  // namespace

std::string progress_line(std::string_view label, double fraction, double elapsed_s, int columns,
                          bool colour) {
  fraction = fraction > 0.0 ? std::min(fraction, 1.0) : 0.0;  // NaN becomes 0
  // Rounded down: 100 % is shown when it is true.
  std::string tail = fmt::format(" {:3} %", static_cast<int>(fraction * 100.0));
  if (fraction >= 0.01 && fraction < 1.0 && elapsed_s >= 2.0) {
    tail += fmt::format("  {} left", duration_text(elapsed_s / fraction - elapsed_s));
  }
  const int room = std::max(columns - 1, 0);
  const int around = static_cast<int>(label.size() + tail.size()) + 3;  // " [" and "]"
  const int bar = std::min(kLongestBar, room - around);
  if (bar < kShortestBar) {
    std::string line = fmt::format("{}{}", label, tail);
    line.resize(std::min(line.size(), static_cast<std::size_t>(room)));
    return line;
  }
  const int full = static_cast<int>(fraction * bar);
  return fmt::format("{} [{}{:#<{}}{}{: <{}}]{}", label, colour ? "\x1b[32m" : "", "", full,
                     colour ? "\x1b[0m" : "", "", bar - full, tail);
}

ProgressBar::ProgressBar(std::string label, ProgressMode mode, int descriptor)
    : label_(std::move(label)),
      descriptor_(descriptor),
      draws_(can_draw(mode, descriptor)),
      colour_(draws_ && !is_set("NO_COLOR")),
      started_(Clock::now()) {}

ProgressBar::~ProgressBar() { clear(); }

void ProgressBar::begin(std::string label, Clock::time_point now) {
  label_ = std::move(label);
  started_ = now;
  drawn_ = false;
}

void ProgressBar::update(double fraction, Clock::time_point now) {
  if (!draws_ || (drawn_ && now - last_ < kRedrawInterval)) return;
  last_ = now;
  drawn_ = true;
  const double elapsed_s = std::chrono::duration<double>(now - started_).count();
  // The escape erases what a longer line left behind.
  put("\r" + progress_line(label_, fraction, elapsed_s, terminal_columns(descriptor_), colour_) +
      "\x1b[K");
  visible_ = true;
}

void ProgressBar::clear() {
  if (!visible_) return;
  put("\r\x1b[K");
  visible_ = false;
  drawn_ = false;
}

std::function<void(double)> ProgressBar::callback() {
  if (!draws_) return {};
  return [this](double fraction) { update(fraction); };
}

void ProgressBar::put(std::string_view text) {
  // A bar that cannot be drawn is no reason to stop the work.
  (void)!::write(descriptor_, text.data(), text.size());
}

}  // namespace strata
