#include "apps/session/session.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <utility>

#include "apps/session/file_conflicts.h"
#include "apps/session/process_memory.h"
#include "core/atomic_file.h"
#include "core/printable.h"

namespace strata::apps {
namespace {

/// Bytes of writable private memory this process has mapped.
std::uint64_t data_bytes() {
  const int descriptor = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return 0;
  char text[256] = {};
  const ssize_t length = read(descriptor, text, sizeof text - 1);
  close(descriptor);
  unsigned long long pages = 0;  // the sixth number is data + stack
  if (length <= 0 || std::sscanf(text, "%*u %*u %*u %*u %*u %llu", &pages) != 1) return 0;
  return static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

/// The last wall: allocations beyond it fail instead of taking the machine down. The limit is
/// obeyed by estimates and slabs long before; this catches what they did not foresee. RLIMIT_DATA
/// counts private writable memory, not files read through mmap nor reserved address space.
void set_memory_wall(std::uint64_t limit, int threads) {
  rlimit now{};
  if (getrlimit(RLIMIT_DATA, &now) != 0) return;
  // Each thread has a stack of 8 MB that it does not fill, and the allocator's own slack.
  const std::uint64_t slack = (std::uint64_t{64} << 20) +
                              static_cast<std::uint64_t>(threads + 2) * (std::uint64_t{9} << 20);
  const std::uint64_t wall = data_bytes() + limit + slack;
  if (wall < limit || (now.rlim_cur != RLIM_INFINITY && now.rlim_cur <= wall)) return;
  now.rlim_cur = wall;
  setrlimit(RLIMIT_DATA, &now);
}

}  // namespace

void Session::configure(const CommonOptions& options) {
  options_ = options;
  memory_limit_ = options.memory_limit > 0 ? options.memory_limit : usable_memory_bytes() / 4 * 3;
  if (memory_limit_ > 0) set_memory_wall(memory_limit_, threads());
  if (options.time_limit_s > 0) watch_time(options.time_limit_s);
}

void Session::watch_time(double limit_s) {
  constexpr double kLongest = 1e8;  // three years, which a clock can add to a time
  const auto end = start_ + std::chrono::duration_cast<Clock::duration>(
                                std::chrono::duration<double>(std::min(limit_s, kLongest)));
  watch_ = std::jthread([this, end](const std::stop_token& done) {
    std::mutex mutex;
    std::condition_variable_any never;
    std::unique_lock lock(mutex);
    never.wait_until(lock, done, end, [] { return false; });
    if (done.stop_requested()) return;
    timed_out_ = true;
    if (interrupts_) interrupts_->request_stop();
    // Work hears a stop within a second; a library that does not is ended with the process.
    constexpr std::chrono::seconds kPatience(3);
    never.wait_for(lock, done, kPatience, [] { return false; });
    if (done.stop_requested()) return;
    complain({ErrorCode::kCancelled, {}});
    remove_temporary_files();
    std::_Exit(static_cast<int>(ErrorCode::kLimit));
  });
}

void Session::set_outputs(std::vector<FileUse> written, bool together) {
  outputs_ = std::move(written);
  if (together) group_.emplace();
}

Result<void> Session::opened(std::span<const FileIdentity> files) const {
  for (const FileIdentity& file : files) {
    if (auto kept = check_opened(file, outputs_); !kept) return kept;
  }
  return {};
}

Result<void> Session::commit_outputs() {
  if (!group_) return {};
  auto done = group_->commit();
  committed_ = committed_ || done.has_value();
  return done;
}

int Session::threads() const {
  if (given_) return given_->thread_count();
  Execution execution;
  execution.threads = options_.threads;
  return execution.thread_count();
}

Execution Session::execution(std::string label, double share) {
  if (given_) return *given_;
  Execution result;
  result.threads = options_.threads;
  result.stop = interrupts_->token();
  result.memory_limit = memory_limit_;
  const ProgressMode mode = options_.quiet ? ProgressMode::kNone : options_.progress;
  if (mode == ProgressMode::kNone) return result;
  if (!bar_) bar_.emplace(label, mode);
  bar_->begin(std::move(label), start_);  // the time that is left is judged by all there was
  if (!bar_->draws()) return result;
  result.progress = [this, begin = shown_, length = share * (1 - shown_)](double done) {
    shown_ = std::max(shown_, begin + length * std::clamp(done, 0.0, 1.0));
    if (bar_) bar_->update(shown_);
  };
  return result;
}

void Session::say(std::string_view kind, std::string_view message) {
  print(fmt::format("strata: {}{}", kind, message));
}

void Session::echo(std::string_view line) {
  if (!options_.quiet) print(line);
}

void Session::tell(std::string_view line) {
  if (!options_.quiet && isatty(STDERR_FILENO) != 0) print(line);
}

void Session::print(std::string_view text) {
  if (bar_) bar_->clear();
  // Names in it may come from files, which are not to drive the terminal.
  const std::string line = printable_lines(text) + '\n';
  // Nobody is left to tell when standard error is closed.
  (void)write_text(STDERR_FILENO, line, "standard error");
}

void Session::warn(std::string code, std::string message) {
  if (!given_warnings_.insert(message).second) return;
  // Under --strict the first one becomes the error, and is printed as that.
  if (!options_.quiet && !options_.strict) say("warning: ", message);
  warnings_.push_back({std::move(code), std::move(message)});
}

void Session::note(std::string_view message) {
  if (options_.verbose) say("", message);
}

Result<void> Session::check_strict() const {
  if (!options_.strict || warnings_.empty()) return {};
  return fail(ErrorCode::kGeometry, "{} (refused by --strict{})", warnings_.front().message,
              warnings_.size() > 1
                  ? fmt::format("; {}", counted(warnings_.size() - 1, "further warning"))
                  : "");
}

void Session::complain(const Error& error) {
  const char* written = committed_ ? "complete outputs are kept" : "no output was written";
  if (timed_out()) {
    return say("error: ", fmt::format("not finished within {:g} s (--time-limit); {}",
                                      options_.time_limit_s, written));
  }
  if (error.code == ErrorCode::kCancelled) return say("", fmt::format("interrupted; {}", written));
  say("error: ", error.message);
}

double Session::milliseconds() const {
  return std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
}

Result<void> write_text(int descriptor, std::string_view text, const std::string& name) {
  while (!text.empty()) {
    const ssize_t written = write(descriptor, text.data(), text.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      return fail(ErrorCode::kOutput, "{}: {}", name, std::strerror(errno));
    }
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return {};
}

Result<void> print_report(std::string_view text, const std::string& where, bool stdout_is_taken) {
  if (where != "-") return write_file(where, text.data(), text.size());
  if (stdout_is_taken) return write_text(STDERR_FILENO, text, "standard error");
  return write_text(STDOUT_FILENO, text, "standard output");
}

std::string readable_bytes(std::uint64_t bytes) {
  constexpr const char* kUnits[] = {"kB", "MB", "GB", "TB", "PB", "EB"};
  if (bytes < 1000) return fmt::format("{} bytes", bytes);
  double value = static_cast<double>(bytes) / 1000;
  std::size_t unit = 0;
  while (value >= 999.5 && unit + 1 < std::size(kUnits)) {
    value /= 1000;
    ++unit;
  }
  return fmt::format("{:.3g} {}", value, kUnits[unit]);
}

}  // namespace strata::apps
