#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <stop_token>

namespace strata {

/// How a long job runs: threads, cancel, progress, memory. Passed last and defaulted. Results never
/// depend on it.
struct Execution {
  /// Worker threads; 0 means one for each processor this process may use.
  int threads = 0;
  /// Asked between tiles; a stopped job returns ErrorCode::kCancelled.
  std::stop_token stop = {};
  /// Called with the finished fraction in [0, 1], from the thread that started the job; may be
  /// empty.
  std::function<void(double)> progress = {};
  /// Bytes the job may hold beyond its inputs; 0 means no limit.
  std::uint64_t memory_limit = 0;

  /// Worker threads that will be used, at least 1.
  [[nodiscard]] int thread_count() const;
};

/// Calls body(index, worker) for every index in [0, count), on up to `thread_count()` workers that
/// take indices in increasing order as they become free. `worker` is in [0, thread_count()) and is
/// used by one thread at a time, so it may select scratch memory. Indices not yet begun are skipped
/// once `execution.stop` is requested. The first exception of a body is rethrown here after all
/// workers have returned.
void parallel_for(const Execution& execution, std::size_t count,
                  const std::function<void(std::size_t index, int worker)>& body);

}  // namespace strata
