#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/picture/picture.h"
#include "strata/csg/scene/scene.h"
#include "strata/mesh/mesh_attributes.h"
#include "strata/raster/view.h"
#include "strata/transparency/stream/frame.h"

namespace strata::csg {

/// What is seen through, and how much.
struct SeeThroughOptions {
  /// Opacity, in [0, 1], of all solids that are not transparent by an alpha below 1. Empty: 1 if
  /// the scene has such an alpha or a ghost, else 0.5.
  std::optional<float> opacity;
  const ColourScheme* scheme = nullptr;  ///< null: default_scheme()
  /// The solids are meshes, just united: every face is seen, also within others, and also of meshes
  /// that are not closed. False: what is seen are the surfaces of the operands of the unions at the
  /// top, as the pictures of Preview show them.
  bool all_faces = false;
  /// With all_faces: those of the meshes of the first solids of the tree. Materials count, their
  /// textures do not.
  std::vector<MeshAttributes> attributes = {};
};

/// A scene whose parts are seen through, for techniques of order-independent transparency.
class SeeThrough {
 public:
  /// @return kUsage (opacity; all_faces with Boolean operations, naming the part), kLimit,
  /// kCancelled
  static Result<SeeThrough> make(Scene scene, const SeeThroughOptions& options = {},
                                 const Execution& execution = {});

  /// What a camera sees. The frame must not outlive this object. Several threads may ask. @return
  /// kUsage (camera, size, samples), kGeometry, kLimit, kCancelled
  [[nodiscard]] Result<transparency::Frame> frame(const Camera& camera, const glm::ivec2& size,
                                                  const transparency::FrameOptions& options = {},
                                                  const Execution& execution = {}) const;
  /// The view of those pictures. @return as make_view()
  [[nodiscard]] Result<View> view(const Camera& camera, const glm::ivec2& size,
                                  const Execution& execution = {}) const;

  /// All triangles with their colours; null without SeeThroughOptions::all_faces.
  [[nodiscard]] const transparency::Scene* faces() const;
  [[nodiscard]] float opacity() const;            ///< of solids without an alpha below 1
  [[nodiscard]] std::uint64_t objects() const;    ///< parts with a colour or a tree of their own
  [[nodiscard]] std::uint64_t triangles() const;  ///< of all parts

 private:
  struct Parts;
  std::shared_ptr<Parts> parts_;
};

}  // namespace strata::csg
