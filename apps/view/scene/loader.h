#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "apps/view/scene/document.h"
#include "apps/view/scene/latest_job.h"

namespace strata::view {

/// Reads models on a thread of its own, one at a time.
class Loader {
 public:
  /// @param wake called from the loading thread when there is something to take()
  explicit Loader(std::function<void()> wake) : job_(std::move(wake)) {}

  /// Begins; what is under way is cancelled and its result forgotten.
  void start(const apps::CsgCommand& command, int threads);
  void cancel() { job_.stop(); }
  [[nodiscard]] bool busy() const { return job_.busy(); }
  /// Nothing is under way, and there is nothing to take().
  [[nodiscard]] bool idle() const { return job_.idle(); }
  /// Of the phase that is under way, in [0, 1].
  [[nodiscard]] double progress() const { return progress_.load(); }
  [[nodiscard]] double seconds() const;  ///< since start()
  /// The result of a load that has ended; once.
  std::optional<Result<std::shared_ptr<const Model>>> take() { return job_.take(); }

 private:
  std::atomic<double> progress_{0};
  std::chrono::steady_clock::time_point begin_;
  LatestJob<std::shared_ptr<const Model>> job_;  ///< last: it uses the others
};

}  // namespace strata::view
