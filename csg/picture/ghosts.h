#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <span>

#include "csg/picture/shade.h"
#include "csg/surface/translucent.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/picture/picture.h"

// Parts of a scene that are drawn transparent, by all their surfaces in order. Private to csg/.

namespace strata::csg {

/// The colour of a surface of translucent trees, under the light of a view: not premultiplied.
/// @param source  the triangle of the slot's mesh
[[nodiscard]] glm::vec4 translucent_colour(const TranslucentTrees& trees, std::uint32_t slot,
                                           std::uint32_t source, bool exit, const Shader& shader);

/// Draws translucent trees over opaque surfaces.
class GhostPainter {
 public:
  /// Borrows `geometry`. @param world_error  as Coincidence has it
  GhostPainter(const Tree& tree, std::span<const Translucent> ghosts, const Geometry& geometry,
               double world_error)
      : trees_(tree, ghosts, geometry, world_error) {}

  [[nodiscard]] bool empty() const { return trees_.empty(); }

  /// Blends all surfaces that lie before those of `opaque` into `colours`, which are
  /// premultiplied. @return kGeometry, kLimit, kCancelled
  Result<void> paint(const View& view, const SurfaceImage& opaque, const Shader& shader,
                     const Execution& execution, std::span<Rgba> colours);

  [[nodiscard]] std::uint64_t fragments() const { return fragments_; }

 private:
  TranslucentTrees trees_;
  std::uint64_t fragments_ = 0;
};

}  // namespace strata::csg
