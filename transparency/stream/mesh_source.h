#pragma once

#include <glm/vec4.hpp>
#include <memory>
#include <span>
#include <vector>

#include "strata/core/execution.h"
#include "strata/raster/view.h"
#include "strata/transparency/stream/frame.h"
#include "transparency/stream/fragment_source.h"

namespace strata::transparency {

/// What an object looks like.
struct Look {
  glm::vec4 colour{0.0f};  ///< as Object::colour
  bool opaque = false;     ///< it is drawn first and hides what lies behind it
};

/// Rasterizes the triangles of a scene, which it borrows. @param looks  of the objects, instead of
/// their colours @return kGeometry, kLimit, kCancelled
Result<std::shared_ptr<const FragmentSource>> make_mesh_source(const Scene& scene,
                                                               std::span<const Look> looks,
                                                               const View& view, int samples,
                                                               const Execution& execution);

/// The looks that the objects' colours give them.
[[nodiscard]] std::vector<Look> looks_of(const Scene& scene, const FrameOptions& options);

}  // namespace strata::transparency
