#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/picture/picture.h"
#include "strata/csg/scene/scene.h"
#include "strata/raster/view.h"
#include "strata/transparency/stream/frame.h"

namespace strata::csg {

/// Settings of SeeThrough::make().
struct SeeThroughOptions {
  /// Opacity, in [0, 1], of all solids whose colour has no alpha. Empty: 1 if the scene has an
  /// alpha below 1 or a ghost, else 0.5.
  std::optional<float> opacity;
  const ColourScheme* scheme = nullptr;  ///< null: Cornfield
  /// The solids are meshes, just united: every face is seen, also within others, and also of meshes
  /// that are not closed.
  bool all_faces = false;
};

/// A scene whose parts are seen through, for techniques of order-independent transparency. Several
/// threads may make frames of it.
class SeeThrough {
 public:
  /// @return kUsage (opacity), kLimit, kCancelled
  static Result<SeeThrough> make(Scene scene, const SeeThroughOptions& options = {},
                                 const Execution& execution = {});

  /// What a camera sees. The frame must not outlive this object. @return as make_view() and
  /// transparency::Frame::make()
  [[nodiscard]] Result<transparency::Frame> frame(const Camera& camera, const glm::ivec2& size,
                                                  const transparency::FrameOptions& options = {},
                                                  const Execution& execution = {}) const;

  [[nodiscard]] float opacity() const;            ///< of solids whose colour has no alpha
  [[nodiscard]] std::uint64_t objects() const;    ///< parts with a colour or a tree of their own
  [[nodiscard]] std::uint64_t triangles() const;  ///< of all objects

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace strata::csg
