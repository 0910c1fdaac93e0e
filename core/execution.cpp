#include "strata/core/execution.h"

#include <sched.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

#ifdef STRATA_USE_TBB
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <new>
#include <optional>
#include <stdexcept>
#else
#include <system_error>
#include <vector>
#endif

namespace strata {
namespace {

int allowed_processors() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (sched_getaffinity(0, sizeof allowed, &allowed) == 0) return std::max(1, CPU_COUNT(&allowed));
  // More processors than a cpu_set_t holds.
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace

int Execution::thread_count() const { return threads > 0 ? threads : allowed_processors(); }

void parallel_for(const Execution& execution, std::size_t count,
                  const std::function<void(std::size_t, int)>& body) {
  const int workers = static_cast<int>(std::min<std::size_t>(
      static_cast<std::size_t>(execution.thread_count()), std::max<std::size_t>(count, 1)));
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto run = [&](int worker) {
    try {
      while (!execution.stop.stop_requested()) {
        const std::size_t index = next.fetch_add(1, std::memory_order_relaxed);
        if (index >= count) return;
        body(index, worker);
      }
    } catch (...) {
      next.store(count, std::memory_order_relaxed);  // the others need not begin anything new
      const std::lock_guard lock(failure_mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  if (workers == 1) {
    run(0);
  } else {
#ifdef STRATA_USE_TBB
    try {
      // Left alone, oneTBB never runs more threads than there are processors; who asks for more, to
      // test what schedules do, gets them.
      std::optional<tbb::global_control> more;
      if (workers > allowed_processors()) {
        more.emplace(tbb::global_control::max_allowed_parallelism,
                     static_cast<std::size_t>(workers));
      }
      tbb::task_arena arena(workers);
      arena.execute([&] { tbb::parallel_for(0, workers, run, tbb::simple_partitioner()); });
    } catch (const std::runtime_error&) {
      // Not a body's, which run() keeps: oneTBB reports threads that the system refuses like this.
      throw std::bad_alloc();
    }
#else
    std::vector<std::jthread> pool;
    pool.reserve(static_cast<std::size_t>(workers));
    try {
      for (int worker = 1; worker < workers; ++worker) pool.emplace_back(run, worker);
    } catch (const std::system_error&) {
      // The system gives no more threads; those there are do the work.
    }
    run(0);
    pool.clear();  // joins
#endif
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace strata
