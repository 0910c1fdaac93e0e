#include "apps/session/interrupt.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>

#include "core/atomic_file.h"
#include "strata/core/result.h"

namespace strata {
namespace {

constexpr std::array kStopSignals = {SIGINT, SIGTERM, SIGHUP};
constexpr std::array kWriteSignals = {SIGPIPE, SIGXFSZ};

// What a signal handler can reach: a handler takes no argument of ours, so this cannot be a member.
std::atomic<int> signals_seen{0};
std::atomic<int> event_descriptor{-1};
std::array<struct sigaction, kStopSignals.size() + kWriteSignals.size()> former_actions;

void on_signal(int) {
  const int saved = errno;
  if (signals_seen.fetch_add(1) > 0) {
    remove_temporary_files();
    _exit(static_cast<int>(ErrorCode::kCancelled));
  }
  // request_stop() runs callbacks and may lock: the watcher does it.
  const std::uint64_t one = 1;
  (void)!write(event_descriptor.load(), &one, sizeof one);
  errno = saved;
}

}  // namespace

InterruptGuard::InterruptGuard() {
  signals_seen = 0;
  event_descriptor = eventfd(0, EFD_CLOEXEC);
  watcher_ = std::jthread([this](const std::stop_token& done) {
    while (!done.stop_requested()) {
      std::uint64_t count = 0;
      if (read(event_descriptor.load(), &count, sizeof count) < 0) continue;  // EINTR
      if (!done.stop_requested()) source_.request_stop();
    }
  });

  struct sigaction action {};
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;  // readers and writers need not know about us
  std::size_t i = 0;
  for (const int signal : kStopSignals) {
    action.sa_handler = on_signal;
    sigaction(signal, nullptr, &former_actions[i]);
    if (former_actions[i].sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
    ++i;
  }
  action.sa_handler = SIG_IGN;
  for (const int signal : kWriteSignals) sigaction(signal, &action, &former_actions[i++]);
}

InterruptGuard::~InterruptGuard() {
  std::size_t i = 0;
  for (const int signal : kStopSignals) sigaction(signal, &former_actions[i++], nullptr);
  for (const int signal : kWriteSignals) sigaction(signal, &former_actions[i++], nullptr);
  watcher_.request_stop();
  const std::uint64_t one = 1;
  (void)!write(event_descriptor.load(), &one, sizeof one);
  watcher_.join();
  close(event_descriptor.exchange(-1));
}

}  // namespace strata
