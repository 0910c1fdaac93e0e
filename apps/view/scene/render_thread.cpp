#include "apps/view/scene/render_thread.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <new>
#include <utility>

namespace strata::view {
namespace {

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

int samples_at_rest(const FrameRequest& request) {
  if (request.heat != Heat::kOff) return 1;
  const auto& how = request.see_through;
  // Errors are told pixel by pixel, and light through media takes its time with one sample.
  return how && (how->errors || how->media != nullptr) ? 1 : request.look.samples;
}

int CoarsePolicy::divisor(bool changed) const {
  constexpr int kLast = static_cast<int>(std::size(kDivisors)) - 1;
  return kDivisors[std::min(step_ + (changed ? 1 : 0), kLast)];
}

void CoarsePolicy::learn(int divisor, double ms, bool hurried) {
  constexpr int kLast = static_cast<int>(std::size(kDivisors)) - 1;
  const int step = static_cast<int>(std::find(std::begin(kDivisors), std::end(kDivisors), divisor) -
                                    std::begin(kDivisors));
  const bool late = ms > kTargetMs;
  const int coarser = std::min(step + (ms > 2 * kTargetMs ? 2 : 1), kLast);
  if (!hurried) {
    step_ = late ? std::max(step_, 1) : 0;
    return;
  }
  step_ = late ? coarser : std::min(step, kLast);
  if (late || step == 0) return;
  // All of the time is put down to pixels: the finer picture takes no longer than this.
  const double more = static_cast<double>(divisor) / kDivisors[step - 1];
  if (ms * more * more < kTargetMs) step_ = step - 1;
}

RenderThread::RenderThread(std::unique_ptr<Renderer> renderer, int threads,
                           std::function<void()> wake)
    : renderer_(std::move(renderer)),
      threads_(threads),
      wake_(std::move(wake)),
      thread_([this](const std::stop_token& stop) {
        run(stop);
        renderer_.reset();  // what it has on the GPU is this thread's
      }) {}

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

void RenderThread::pick(const glm::ivec2& pixel, std::optional<ProbeWish> probe) {
  const std::lock_guard lock(mutex_);
  if (!current_) return;
  wanted_pick_ = pixel;
  if (smoothing_) whole_stop_.request_stop();
  wanted_probe_ = probe;
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
  return !working_ && !wanted_ && !wanted_pick_ && !smooth_;
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
    const auto asked = [this] { return wanted_ || wanted_pick_; };
    if (smooth_) {
      changed_.wait_for(lock, stop, std::chrono::milliseconds(kRestMs), asked);
    } else {
      changed_.wait(lock, stop, asked);
    }
    if (stop.stop_requested()) return;
    working_ = true;
    if (!asked()) {
      draw_smooth(lock);
      working_ = false;
      wake_();
      continue;
    }
    if (wanted_pick_ && !wanted_) {
      const glm::ivec2 pixel = *std::exchange(wanted_pick_, {});
      FrameRequest request = *current_;
      request.probe = std::exchange(wanted_probe_, {});
      lock.unlock();
      auto picked = guarded([&] { return renderer_->pick(request, pixel, execution(stop)); });
      lock.lock();
      picked_ = std::move(picked);
      working_ = false;
      wake_();
      continue;
    }
    const FrameRequest request = *std::move(wanted_);
    wanted_.reset();
    const bool whole = std::exchange(wanted_whole_, false);
    smooth_.reset();
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
    CoarsePolicy& policy = policy_of(request);
    const bool changed = drawn_ && (request.what != drawn_ || request.look.edges != drawn_edges_);
    const int divisor = whole ? 1 : policy.divisor(changed);
    drawn_ = request.what;
    drawn_edges_ = request.look.edges;
    // A coarse picture is finished even when a newer one is wanted, or a moving hand would never
    // see any.
    draw_coarse(request, divisor, stop);
    const bool smooth = samples_at_rest(request) > 1;
    lock.lock();
    if (divisor > 1 && rests(lock, stop)) draw_whole(request, !smooth, newer, lock);
    if (smooth && !error_ && !wanted_) smooth_ = request;
    working_ = false;
    wake_();
  }
}

bool RenderThread::rests(std::unique_lock<std::mutex>& lock, const std::stop_token& stop) {
  if (error_) return false;
  const auto superseded = [this] { return wanted_.has_value(); };
  changed_.wait_for(lock, stop, std::chrono::milliseconds(kRestMs), superseded);
  return !superseded() && !stop.stop_requested();
}

void RenderThread::draw_whole(FrameRequest request, bool last, const std::stop_token& newer,
                              std::unique_lock<std::mutex>& lock) {
  lock.unlock();
  request.look.samples = last ? samples_at_rest(request) : 1;
  const auto begin = std::chrono::steady_clock::now();
  auto frame = guarded([&] { return renderer_->draw(request, execution(newer)); });
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  if (frame && request.look.samples == 1) {
    policy_of(request).learn(1, took.count() - frame->prepare_ms, false);
  }
  lock.lock();
  if (frame) {
    frame->last = last;
    frame_ = *std::move(frame);
    if (!last) wake_();
  } else if (frame.error().code != ErrorCode::kCancelled) {
    error_ = std::move(frame.error());
  }
}

void RenderThread::draw_smooth(std::unique_lock<std::mutex>& lock) {
  FrameRequest request = *std::exchange(smooth_, {});
  whole_stop_ = {};
  const std::stop_token newer = whole_stop_.get_token();
  smoothing_ = true;
  draw_whole(request, true, newer, lock);
  smoothing_ = false;
  // A pick has stopped it, and it begins again afterwards.
  if (newer.stop_requested() && !wanted_) smooth_ = std::move(request);
}

void RenderThread::draw_coarse(const FrameRequest& request, int divisor,
                               const std::stop_token& stop) {
  FrameRequest coarse = request;
  coarse.size = coarse_size(request.size, divisor);
  coarse.moving = divisor > 1;
  coarse.look.samples = 1;
  const auto begin = std::chrono::steady_clock::now();
  auto frame = guarded([&] { return renderer_->draw(coarse, execution(stop)); });
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  CoarsePolicy& policy = policy_of(request);
  const std::lock_guard lock(mutex_);
  if (frame) {
    frame->wanted = request.size;
    frame->divisor = divisor;
    frame->last = divisor == 1 && samples_at_rest(request) == 1;
    policy.learn(divisor, took.count() - frame->prepare_ms, true);
    frame_ = *std::move(frame);
  } else {
    error_ = std::move(frame.error());
  }
  wake_();
}

}  // namespace strata::view
