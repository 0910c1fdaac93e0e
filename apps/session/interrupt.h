#pragma once

#include <stop_token>
#include <thread>

namespace strata {

/// Makes a program stop cleanly on SIGINT, SIGTERM and SIGHUP, for as long as it lives. The first
/// signal requests a stop: jobs return ErrorCode::kCancelled and their owners remove what is half
/// written. A second one does not wait for them: it removes all temporary files
/// (remove_temporary_files) and ends the process with status 130. A signal that the caller's
/// environment ignores (nohup) stays ignored. SIGPIPE and SIGXFSZ are ignored meanwhile, so that
/// a closed pipe or a file size limit becomes an error of the write that met it. For main(); at
/// most one lives at a time.
class InterruptGuard {
 public:
  InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
  ~InterruptGuard();  ///< puts the former signal handlers back

  /// For Execution::stop.
  [[nodiscard]] std::stop_token token() const { return source_.get_token(); }
  /// Asks for a stop without a signal, as a time limit does. Any thread may.
  void request_stop() { source_.request_stop(); }
  /// Whether a stop was asked for. Any thread may ask.
  [[nodiscard]] bool interrupted() const { return source_.stop_requested(); }

 private:
  std::stop_source source_;
  std::jthread watcher_;  // turns the handler's note into a stop request
};

}  // namespace strata
