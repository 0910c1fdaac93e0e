#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <stop_token>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "strata/core/result.h"

namespace strata::view {

/// Works on a thread of its own; of several jobs only the latest one counts.
template <class T>
class LatestJob {
 public:
  /// @param wake called from the working thread when there is something to take()
  explicit LatestJob(std::function<void()> wake) : wake_(std::move(wake)) {}
  LatestJob(const LatestJob&) = delete;
  LatestJob& operator=(const LatestJob&) = delete;
  ~LatestJob() { stop(); }  ///< and waits

  /// Begins; what is under way is stopped and its result forgotten.
  /// @param doing  for the message when memory runs out: "reading"
  /// @param work  Result<T>(const std::stop_token&)
  template <class Work>
  void start(std::string_view doing, Work&& work) {
    stop();
    const std::lock_guard lock(mutex_);
    const std::uint64_t number = ++current_;
    busy_ = true;
    done_.reset();
    // Of the jobs that were stopped some may still be on their way out.
    std::erase_if(jobs_, [](const Job& job) { return job.ended->load(); });
    auto ended = std::make_shared<std::atomic<bool>>(false);
    auto run = [this, doing, number, ended,
                work = std::forward<Work>(work)](const std::stop_token& stop) {
      auto result = safely(doing, work, stop);
      {
        const std::lock_guard inner(mutex_);
        if (number == current_) {
          busy_ = false;
          done_ = std::move(result);
        }
      }
      wake_();
      ended->store(true);
    };
    jobs_.push_back({ended, std::jthread(std::move(run))});
  }
  /// What is under way ends soon, and says so as its result.
  void stop() {
    const std::lock_guard lock(mutex_);
    if (!jobs_.empty()) jobs_.back().thread.request_stop();
  }
  /// What is under way ends soon; there is nothing to take().
  void forget() {
    stop();
    const std::lock_guard lock(mutex_);
    ++current_;
    busy_ = false;
    done_.reset();
  }
  [[nodiscard]] bool busy() const {
    const std::lock_guard lock(mutex_);
    return busy_;
  }
  /// Nothing is under way, and there is nothing to take().
  [[nodiscard]] bool idle() const {
    const std::lock_guard lock(mutex_);
    return !busy_ && !done_;
  }
  /// The result of a job that has ended; once.
  std::optional<Result<T>> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(done_, {});
  }

 private:
  struct Job {
    std::shared_ptr<std::atomic<bool>> ended;
    std::jthread thread;
  };

  template <class Work>
  static Result<T> safely(std::string_view doing, const Work& work, const std::stop_token& stop) {
    try {
      return work(stop);
    } catch (const std::bad_alloc&) {
      return fail(ErrorCode::kLimit, "out of memory while {}", doing);
    } catch (const std::exception& failure) {
      return fail(ErrorCode::kInternal, "internal error: {}", failure.what());
    }
  }

  std::function<void()> wake_;
  mutable std::mutex mutex_;
  std::uint64_t current_ = 0;
  bool busy_ = false;
  std::optional<Result<T>> done_;
  std::vector<Job> jobs_;  ///< the last one is the current one
};

}  // namespace strata::view
