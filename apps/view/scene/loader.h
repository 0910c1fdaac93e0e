#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "apps/view/scene/document.h"

namespace strata::view {

/// Reads models on a thread of its own, one at a time.
class Loader {
 public:
  /// @param wake called from the loading thread when there is something to take()
  explicit Loader(std::function<void()> wake) : wake_(std::move(wake)) {}
  Loader(const Loader&) = delete;
  Loader& operator=(const Loader&) = delete;
  ~Loader();  ///< cancels and waits

  /// Begins; what is under way is cancelled and its result forgotten.
  void start(const apps::CsgCommand& command, int threads);
  void cancel();
  [[nodiscard]] bool busy() const;
  /// Nothing is under way, and there is nothing to take().
  [[nodiscard]] bool idle() const {
    const std::lock_guard lock(mutex_);
    return !busy_ && !done_;
  }
  /// Of the phase that is under way, in [0, 1].
  [[nodiscard]] double progress() const { return progress_.load(); }
  [[nodiscard]] double seconds() const;  ///< since start()
  /// The result of a load that has ended; once.
  std::optional<Result<std::shared_ptr<const Model>>> take();

 private:
  std::function<void()> wake_;
  std::atomic<double> progress_{0};
  mutable std::mutex mutex_;
  std::uint64_t current_ = 0;
  bool busy_ = false;
  std::optional<Result<std::shared_ptr<const Model>>> done_;
  std::chrono::steady_clock::time_point begin_;
  struct Job {
    std::shared_ptr<std::atomic<bool>> ended;
    std::jthread thread;
  };
  std::vector<Job> jobs_;  ///< the last one is the current one
};

}  // namespace strata::view
