#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "apps/view/scene/renderer.h"

namespace strata::view {

/// Chooses how coarse a picture must be to be there in time. The last picture decides: a step
/// coarser when it took too long, a step finer when that would still be in time.
class CoarsePolicy {
 public:
  static constexpr double kTargetMs = 35;  ///< two of them and the panels fit into 100 ms
  static constexpr int kDivisors[] = {1, 2, 3, 4, 6, 8, 12, 16};

  /// What to try next; a step coarser when what is shown has `changed`, for nobody knows what that
  /// costs.
  [[nodiscard]] int divisor(bool changed = false) const;
  /// A picture took `ms`. @param hurried it was the first answer to a request; else it was drawn at
  /// leisure, and tells only whether whole pictures are in time.
  void learn(int divisor, double ms, bool hurried);
  /// The scene has changed: nothing is known.
  void forget() { *this = {}; }

 private:
  int step_ = 3;  ///< into kDivisors
};

/// The size of a picture that is `divisor` times as coarse.
[[nodiscard]] glm::ivec2 coarse_size(const glm::ivec2& size, int divisor);

/// Samples a pixel of the picture at rest; while the picture moves there is one.
[[nodiscard]] int samples_at_rest(const FrameRequest& request);

/// Draws what is asked for last, on a thread of its own: a coarse picture at once, then, when no
/// other has been asked for in the meantime, the whole one, and then the one with all samples.
class RenderThread {
 public:
  /// @param wake called from the drawing thread when there is something to take
  /// @param threads that draw; 0: one a processor
  RenderThread(std::unique_ptr<Renderer> renderer, int threads, std::function<void()> wake);
  RenderThread(const RenderThread&) = delete;
  RenderThread& operator=(const RenderThread&) = delete;
  ~RenderThread();

  /// Replaces what was asked for before. Gives its number. With `whole`, no coarse picture.
  std::uint64_t submit(FrameRequest request, bool whole = false);
  /// Asks for a pick in the request given last. Replaces one that waits. @param probe  what is to
  /// be measured there
  void pick(const glm::ivec2& pixel, std::optional<ProbeWish> probe = {});

  /// The newest picture since the last call.
  std::optional<Frame> take_frame();
  std::optional<Result<Picked>> take_pick();
  /// Why the last request could not be drawn; once.
  std::optional<Error> take_error();
  /// Nothing is under way: the last request is drawn, whole, or has failed; picks are answered.
  [[nodiscard]] bool resting() const;

 private:
  void run(const std::stop_token& stop);
  /// Heat maps and transparent pictures take another time than shaded ones.
  [[nodiscard]] CoarsePolicy& policy_of(const FrameRequest& request) {
    return request.heat == Heat::kOff && !request.see_through ? policy_ : heat_policy_;
  }
  void draw_coarse(const FrameRequest& request, int divisor, const std::stop_token& stop);
  /// Waits for a while. @return whether nothing new is wanted
  bool rests(std::unique_lock<std::mutex>& lock, const std::stop_token& stop);
  /// @param lock held before and after, not while it draws
  /// @param last  with all samples, and no other picture follows
  void draw_whole(FrameRequest request, bool last, const std::stop_token& newer,
                  std::unique_lock<std::mutex>& lock);
  void draw_smooth(std::unique_lock<std::mutex>& lock);
  [[nodiscard]] Execution execution(const std::stop_token& stop) const;

  /// No new request for so long, and the hand rests.
  static constexpr int kRestMs = 60;

  std::unique_ptr<Renderer> renderer_;
  int threads_;
  std::function<void()> wake_;
  CoarsePolicy policy_, heat_policy_;
  std::size_t drawn_solids_ = 0;
  std::shared_ptr<const Arrangement> drawn_;
  bool drawn_edges_ = false;

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::uint64_t last_number_ = 0;
  std::optional<FrameRequest> wanted_;  ///< not yet begun
  bool wanted_whole_ = false;
  std::optional<FrameRequest> current_;  ///< given last
  std::optional<glm::ivec2> wanted_pick_;
  std::optional<ProbeWish> wanted_probe_;  ///< of the pick
  std::optional<FrameRequest> smooth_;     ///< to be drawn with all samples when the hand rests
  bool working_ = false, smoothing_ = false;
  std::stop_source whole_stop_;  ///< of the whole picture that is being drawn
  std::optional<Frame> frame_;
  std::optional<Result<Picked>> picked_;
  std::optional<Error> error_;
  std::jthread thread_;
};

}  // namespace strata::view
