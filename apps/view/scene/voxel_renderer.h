#pragma once

#include <memory>
#include <optional>

#include "apps/view/scene/renderer.h"

namespace strata::view {

/// Draws the voxels of an arrangement: the solid, or a slice. One thread at a time.
class VoxelRenderer {
 public:
  /// @pre request.what->voxels. @return as VoxelPicture::draw()
  Result<Frame> draw(const FrameRequest& request, const Execution& execution);
  Result<Picked> pick(const FrameRequest& request, const glm::ivec2& pixel,
                      const Execution& execution);

 private:
  Result<void> prepare(const FrameRequest& request, const Execution& execution);

  std::shared_ptr<const VoxelScene> scene_;
  std::optional<float> threshold_;
  std::optional<VoxelPicture> picture_;
  Bounds box_;  ///< of the solid voxels
};

}  // namespace strata::view
