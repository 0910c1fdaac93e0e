#pragma once

#include <algorithm>
#include <cmath>

#include "transparency/stream/tile_stream.h"

namespace strata::transparency {

/// Distances from the eye of the depths of a frame, as techniques scale them. Depths of bare
/// fragments are distances.
class Distances {
 public:
  explicit Distances(const FrameInfo& frame) {
    if (frame.triangles == nullptr || !frame.triangles->view.perspective) return;
    perspective_ = true;
    nearest_ = static_cast<float>(frame.triangles->view.near);
    farthest_ = static_cast<float>(frame.triangles->view.far);
    log_scale_ = 2.0f / std::log(farthest_ / nearest_);
  }

  /// The depth in [0, 1), as a depth buffer has it.
  [[nodiscard]] static float depth(DepthItem item) {
    return static_cast<float>(item.depth()) * (1.0f / static_cast<float>(kPictureDepthLimit));
  }
  /// 0 at the nearest distance of the view, 1 at the farthest one.
  [[nodiscard]] float linear(DepthItem item) const {
    const float d = depth(item);
    if (!perspective_) return d;
    return (distance(d) - nearest_) / (farthest_ - nearest_);
  }
  /// The same by the logarithm of the distance, from -1 to 1. Linear without perspective.
  [[nodiscard]] float logarithmic(DepthItem item) const {
    const float d = depth(item);
    if (!perspective_) return 2.0f * d - 1.0f;
    return std::log(distance(d) / nearest_) * log_scale_ - 1.0f;
  }

 private:
  [[nodiscard]] float distance(float depth) const {
    return 1.0f / ((1.0f - depth) / nearest_ + depth / farthest_);
  }

  bool perspective_ = false;
  float nearest_ = 0.0f, farthest_ = 1.0f, log_scale_ = 0.0f;
};

}  // namespace strata::transparency
