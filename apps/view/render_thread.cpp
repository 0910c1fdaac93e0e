#include "apps/view/render_thread.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <new>
#include <utility>

namespace strata::view {
namespace {

double pixels_of(const glm::ivec2& size) {
  return static_cast<double>(size.x) * static_cast<double>(size.y);
}

/// A renderer's exceptions stop here.
template <class Call>
auto guarded(Call&& call) -> decltype(call()) {
  try {
    return call();
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "out of memory while drawing");
  } catch (const std::exception& failure) {
    return fail(ErrorCode::kInternal, "internal error: {}", failure.what());
  }
}

}  // namespace

glm::ivec2 coarse_size(const glm::ivec2& size, int divisor) {
  return glm::max(glm::ivec2(1), (size + divisor - 1) / divisor);
}

int CoarsePolicy::divisor(const glm::ivec2& size, bool changed) const {
  if (!known_) return 4;
  const double target = changed ? kTargetMs / 2 : kTargetMs;
  for (const int divisor : kDivisors) {
    if (expected(pixels_of(coarse_size(size, divisor))) <= target) return divisor;
  }
  return kDivisors[std::size(kDivisors) - 1];
}

void CoarsePolicy::learn(const glm::ivec2& size, int divisor, double ms) {
  const double pixels = pixels_of(coarse_size(size, divisor));
  if (!known_) {
    // Half of a first coarse picture's time is a guess at what no pixel is to blame for.
    fixed_ = divisor > 1 ? ms / 2 : 0;
    per_pixel_ = (ms - fixed_) / pixels;
    known_ = true;
    return;
  }
  // Large pictures tell what a pixel costs, small ones what is left.
  if (divisor == 1) {
    per_pixel_ = std::max(0.0, ms - fixed_) / pixels;
  } else {
    const double rest = std::max(0.0, ms - per_pixel_ * pixels);
    fixed_ += 0.5 * (rest - fixed_);
    if (rest == 0) per_pixel_ = 0.5 * (per_pixel_ + ms / pixels);
  }
}

RenderThread::RenderThread(std::unique_ptr<Renderer> renderer, int threads,
                           std::function<void()> wake)
    : renderer_(std::move(renderer)),
      threads_(threads),
      wake_(std::move(wake)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

RenderThread::~RenderThread() {
  thread_.request_stop();
  const std::lock_guard lock(mutex_);
  whole_stop_.request_stop();
}

std::uint64_t RenderThread::submit(FrameRequest request, bool whole) {
  const std::lock_guard lock(mutex_);
  request.number = ++last_number_;
  current_ = request;
  wanted_ = std::move(request);
  wanted_whole_ = whole;
  whole_stop_.request_stop();
  changed_.notify_all();
  return last_number_;
}

void RenderThread::pick(const glm::ivec2& pixel) {
  const std::lock_guard lock(mutex_);
  if (!current_) return;
  wanted_pick_ = pixel;
  changed_.notify_all();
}

std::optional<Frame> RenderThread::take_frame() {
  const std::lock_guard lock(mutex_);
  return std::exchange(frame_, {});
}
std::optional<Result<Picked>> RenderThread::take_pick() {
  const std::lock_guard lock(mutex_);
  return std::exchange(picked_, {});
}
std::optional<Error> RenderThread::take_error() {
  const std::lock_guard lock(mutex_);
  return std::exchange(error_, {});
}
bool RenderThread::resting() const {
  const std::lock_guard lock(mutex_);
  return !working_ && !wanted_ && !wanted_pick_;
}

Execution RenderThread::execution(const std::stop_token& stop) const {
  Execution result;
  result.threads = threads_;
  result.stop = stop;
  return result;
}

void RenderThread::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    changed_.wait(lock, stop, [this] { return wanted_ || wanted_pick_; });
    if (stop.stop_requested()) return;
    working_ = true;
    if (wanted_pick_ && !wanted_) {
      const glm::ivec2 pixel = *std::exchange(wanted_pick_, {});
      const FrameRequest request = *current_;
      lock.unlock();
      auto picked = guarded([&] { return renderer_->pick(request, pixel, execution({})); });
      lock.lock();
      picked_ = std::move(picked);
      working_ = false;
      wake_();
      continue;
    }
    const FrameRequest request = *std::exchange(wanted_, {});
    const bool whole = std::exchange(wanted_whole_, false);
    whole_stop_ = {};
    const std::stop_token newer = whole_stop_.get_token();
    lock.unlock();
    // A section that is dragged or a colour that changes makes another arrangement of about the
    // same cost.
    if (request.what->tree.solids().size() / 4 != drawn_solids_ / 4) {
      policy_.forget();
      heat_policy_.forget();
      drawn_solids_ = request.what->tree.solids().size();
    }
    CoarsePolicy& policy = request.heat == Heat::kOff ? policy_ : heat_policy_;
    const int divisor = whole ? 1 : policy.divisor(request.size, request.what != drawn_);
    drawn_ = request.what;
    // A coarse picture is finished even when a newer one is wanted, or a moving hand would never
    // see any.
    draw_coarse(request, divisor, divisor == 1);
    lock.lock();
    if (divisor > 1 && !error_) {
      const auto superseded = [this] { return wanted_.has_value(); };
      changed_.wait_for(lock, stop, std::chrono::milliseconds(kRestMs), superseded);
      if (!superseded() && !stop.stop_requested()) {
        lock.unlock();
        const auto begin = std::chrono::steady_clock::now();
        auto frame = guarded([&] { return renderer_->draw(request, execution(newer)); });
        const std::chrono::duration<double, std::milli> took =
            std::chrono::steady_clock::now() - begin;
        if (frame) policy.learn(request.size, 1, took.count() - frame->prepare_ms);
        lock.lock();
        if (frame) {
          frame_ = *std::move(frame);
        } else if (frame.error().code != ErrorCode::kCancelled) {
          error_ = std::move(frame.error());
        }
      }
    }
    working_ = false;
    wake_();
  }
}

void RenderThread::draw_coarse(const FrameRequest& request, int divisor, bool last) {
  FrameRequest coarse = request;
  coarse.size = coarse_size(request.size, divisor);
  const auto begin = std::chrono::steady_clock::now();
  auto frame = guarded([&] { return renderer_->draw(coarse, execution({})); });
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  CoarsePolicy& policy = request.heat == Heat::kOff ? policy_ : heat_policy_;
  const std::lock_guard lock(mutex_);
  if (frame) {
    frame->wanted = request.size;
    frame->divisor = divisor;
    policy.learn(request.size, divisor, took.count() - frame->prepare_ms);
    frame_ = *std::move(frame);
  } else {
    error_ = std::move(frame.error());
  }
  if (!last) wake_();
}

}  // namespace strata::view
