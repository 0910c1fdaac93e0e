#include "strata/core/execution.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace strata {
namespace {

class ParallelFor : public testing::TestWithParam<int> {
 protected:
  Execution execution() const {
    Execution result;
    result.threads = GetParam();
    return result;
  }
};

TEST_P(ParallelFor, VisitsEveryIndexOnce) {
  for (const std::size_t count : {0u, 1u, 2u, 7u, 1000u}) {
    std::vector<std::atomic<int>> visits(count);
    parallel_for(execution(), count, [&](std::size_t index, int) { ++visits[index]; });
    for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(visits[i], 1) << i << " of " << count;
  }
}

TEST_P(ParallelFor, AWorkerNumberIsUsedByOneThreadAtATime) {
  std::vector<std::atomic<int>> users(static_cast<std::size_t>(GetParam()));
  std::vector<int> scratch(users.size());  // plain memory: ThreadSanitizer watches it
  std::atomic<int> clashes{0}, outside{0};
  constexpr std::size_t kCount = 5000;
  parallel_for(execution(), kCount, [&](std::size_t, int worker) {
    if (worker < 0 || worker >= GetParam()) {
      ++outside;
      return;
    }
    const auto w = static_cast<std::size_t>(worker);
    if (++users[w] != 1) ++clashes;
    ++scratch[w];
    --users[w];
  });
  EXPECT_EQ(outside, 0);
  EXPECT_EQ(clashes, 0);
  std::size_t sum = 0;
  for (const int part : scratch) sum += static_cast<std::size_t>(part);
  EXPECT_EQ(sum, kCount);
}

TEST_P(ParallelFor, RunsOnAsManyThreadsAsAsked) {
  // Each body waits until all are inside, so fewer threads would wait for ever; the limit makes
  // that a failure.
  std::mutex mutex;
  std::condition_variable all_here;
  int here = 0;
  bool in_time = true;
  parallel_for(execution(), static_cast<std::size_t>(GetParam()), [&](std::size_t, int) {
    std::unique_lock lock(mutex);
    ++here;
    all_here.notify_all();
    in_time &=
        all_here.wait_for(lock, std::chrono::seconds(60), [&] { return here == GetParam(); });
  });
  EXPECT_TRUE(in_time);
  EXPECT_EQ(here, GetParam());
}

TEST_P(ParallelFor, IndicesAreTakenInIncreasingOrderByEachWorker) {
  std::vector<std::size_t> last(static_cast<std::size_t>(GetParam()), 0);
  std::atomic<int> backwards{0};
  parallel_for(execution(), 1000, [&](std::size_t index, int worker) {
    std::size_t& before = last[static_cast<std::size_t>(worker)];
    if (index + 1 <= before) ++backwards;
    before = index + 1;
  });
  EXPECT_EQ(backwards, 0);
}

TEST_P(ParallelFor, AnExceptionComesOutAfterAllBodiesHaveReturned) {
  std::atomic<int> inside{0}, begun{0};
  constexpr std::size_t kCount = 10000;
  try {
    parallel_for(execution(), kCount, [&](std::size_t index, int) {
      ++inside;
      ++begun;
      if (index == 10) {
        --inside;
        throw std::runtime_error("index 10");
      }
      std::this_thread::yield();
      --inside;
    });
    ADD_FAILURE() << "the exception was lost";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(error.what(), std::string("index 10"));
  }
  EXPECT_EQ(inside, 0);
  EXPECT_GE(begun, 11);
}

TEST_P(ParallelFor, OneOfManyExceptionsComesOut) {
  EXPECT_THROW(parallel_for(execution(), 100,
                            [](std::size_t, int) { throw std::runtime_error("each fails"); }),
               std::runtime_error);
}

TEST_P(ParallelFor, NothingBeginsAfterAStop) {
  std::stop_source source;
  Execution stopped = execution();
  stopped.stop = source.get_token();
  std::atomic<int> begun{0}, begun_at_stop{0}, begun_after{0};
  parallel_for(stopped, 100000, [&](std::size_t, int) {
    // Those that were taken before the request may still run, one a worker.
    if (source.stop_requested()) ++begun_after;
    if (++begun != 50) return;
    source.request_stop();
    begun_at_stop = begun.load();
  });
  EXPECT_GE(begun, 50);
  EXPECT_LE(begun, begun_at_stop + GetParam());
  EXPECT_LT(begun_after, GetParam() + 1);

  begun = 0;
  parallel_for(stopped, 1000, [&](std::size_t, int) { ++begun; });
  EXPECT_EQ(begun, 0);
}

TEST_P(ParallelFor, MayBeNested) {
  std::atomic<int> sum{0};
  parallel_for(execution(), 8, [&](std::size_t, int) {
    parallel_for(execution(), 50, [&](std::size_t, int) { ++sum; });
  });
  EXPECT_EQ(sum, 400);
}

TEST_P(ParallelFor, WhatBodiesWroteIsVisibleAfterwards) {
  std::vector<std::size_t> squares(10000);
  parallel_for(execution(), squares.size(),
               [&](std::size_t index, int) { squares[index] = index * index; });
  for (std::size_t i = 0; i < squares.size(); ++i) ASSERT_EQ(squares[i], i * i);
}

INSTANTIATE_TEST_SUITE_P(Threads, ParallelFor, testing::Range(1, 9));

TEST(Execution, CountsTheProcessorsItMayUse) {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  ASSERT_EQ(sched_getaffinity(0, sizeof allowed, &allowed), 0);
  EXPECT_EQ(Execution{}.thread_count(), CPU_COUNT(&allowed));

  // A process bound to one processor, as a batch system binds it, gets one thread.
  std::thread([] {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(sched_getcpu(), &one);
    if (sched_setaffinity(0, sizeof one, &one) == 0) {
      EXPECT_EQ(Execution{}.thread_count(), 1);
    }
  }).join();
}

TEST(Execution, TakesTheNumberAsked) {
  Execution execution;
  execution.threads = 5;
  EXPECT_EQ(execution.thread_count(), 5);
  execution.threads = -1;
  EXPECT_GE(execution.thread_count(), 1);
}

}  // namespace
}  // namespace strata
