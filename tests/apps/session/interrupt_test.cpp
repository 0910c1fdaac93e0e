#include "apps/session/interrupt.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <string>
#include <thread>

#include "core/atomic_file.h"
#include "strata/core/execution.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

namespace strata {
namespace {

using testkit::in_child;

void wait_for_stop(const InterruptGuard& guard) {
  while (!guard.interrupted()) std::this_thread::yield();  // ctest's time limit ends a failure
}

TEST(InterruptGuard, TheFirstSignalRequestsAStop) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const InterruptGuard guard;
    EXPECT_FALSE(guard.interrupted());
    EXPECT_TRUE(guard.token().stop_possible());
    raise(signal);
    wait_for_stop(guard);
    EXPECT_TRUE(guard.token().stop_requested());
  }
}

TEST(InterruptGuard, StopsAParallelJob) {
  const InterruptGuard guard;
  Execution execution;
  execution.threads = 2;
  execution.stop = guard.token();
  std::atomic<std::size_t> begun{0};
  constexpr std::size_t kCount = std::size_t{1} << 62;  // would never end
  parallel_for(execution, kCount, [&](std::size_t, int) {
    if (begun.fetch_add(1) == 100) kill(getpid(), SIGINT);
  });
  EXPECT_GT(begun, 100u);
  EXPECT_TRUE(guard.interrupted());
}

TEST(InterruptGuard, TheSecondSignalRemovesTemporariesAndExits130) {
  const testkit::TemporaryFolder folder;
  const int status = in_child([&folder] {
    const InterruptGuard guard;
    auto file = AtomicFile::create(folder.file("a.bin"));
    if (!file || !file->write("half", 4)) return 1;
    raise(SIGINT);
    wait_for_stop(guard);
    raise(SIGTERM);
    return 2;
  });
  EXPECT_EQ(status, 130);
  EXPECT_TRUE(folder.is_empty());
}

TEST(InterruptGuard, FormerHandlersComeBack) {
  static std::atomic<int> mine{0};
  signal(SIGINT, [](int) { ++mine; });
  { const InterruptGuard guard; }
  raise(SIGINT);
  EXPECT_EQ(mine, 1);
  signal(SIGINT, SIG_DFL);
}

TEST(InterruptGuard, AnIgnoredSignalStaysIgnored) {
  EXPECT_EQ(in_child([] {
              signal(SIGHUP, SIG_IGN);  // as nohup does
              const InterruptGuard guard;
              for (int i = 0; i < 3; ++i) raise(SIGHUP);
              return guard.interrupted() ? 1 : 0;
            }),
            0);
}

TEST(InterruptGuard, AClosedPipeIsAnErrorAndNotTheEnd) {
  EXPECT_EQ(in_child([] {
              const InterruptGuard guard;
              std::array<int, 2> ends{};
              if (pipe(ends.data()) != 0) return 77;
              close(ends[0]);
              dup2(ends[1], STDOUT_FILENO);
              auto file = AtomicFile::create("-");
              if (!file) return 1;
              const auto written = file->write("x", 1);
              if (written) return 2;
              return written.error().message ==
                             "standard output: cannot write 1 bytes at position 0: Broken pipe"
                         ? 0
                         : 3;
            }),
            0);
}

TEST(InterruptGuard, AnUninterruptedProgramIsNotStopped) {
  std::stop_token token;
  {
    const InterruptGuard guard;
    token = guard.token();
  }
  EXPECT_FALSE(token.stop_requested());
}

}  // namespace
}  // namespace strata
