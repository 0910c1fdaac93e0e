#include "apps/view/scene/loader.h"

#include <algorithm>
#include <exception>
#include <new>
#include <utility>

namespace strata::view {
namespace {

Result<std::shared_ptr<const Model>> load(const apps::CsgCommand& command,
                                          const Execution& execution) {
  try {
    return load_model(command, execution);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "out of memory while reading");
  } catch (const std::exception& failure) {
    return fail(ErrorCode::kInternal, "internal error: {}", failure.what());
  }
}

}  // namespace

Loader::~Loader() { cancel(); }

void Loader::start(const apps::CsgCommand& command, int threads) {
  cancel();
  const std::lock_guard lock(mutex_);
  const std::uint64_t number = ++current_;
  busy_ = true;
  done_.reset();
  progress_ = 0;
  begin_ = std::chrono::steady_clock::now();
  // Of the loads that were cancelled some may still be on their way out.
  std::erase_if(jobs_, [](const Job& job) { return job.ended->load(); });
  auto ended = std::make_shared<std::atomic<bool>>(false);
  auto work = [this, command, threads, number, ended](const std::stop_token& stop) {
    Execution execution;
    execution.threads = threads;
    execution.stop = stop;
    execution.progress = [this, stop](double fraction) {
      if (!stop.stop_requested()) progress_ = fraction;
    };
    auto result = load(command, execution);
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
  jobs_.push_back({ended, std::jthread(std::move(work))});
}

void Loader::cancel() {
  const std::lock_guard lock(mutex_);
  if (!jobs_.empty()) jobs_.back().thread.request_stop();
}

bool Loader::busy() const {
  const std::lock_guard lock(mutex_);
  return busy_;
}

double Loader::seconds() const {
  const std::lock_guard lock(mutex_);
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

std::optional<Result<std::shared_ptr<const Model>>> Loader::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(done_, {});
}

}  // namespace strata::view
