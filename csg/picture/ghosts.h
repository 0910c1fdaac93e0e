#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <memory>
#include <span>

#include "csg/picture/shade.h"
#include "csg/translucent/translucent.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/picture/picture.h"

// Parts of a scene that are drawn transparent, by all their surfaces in order. Private to csg/.

namespace strata::csg {

/// The colour of a surface of translucent trees, under the light of a view: not premultiplied.
/// @param source  the triangle of the slot's mesh
[[nodiscard]] glm::vec4 translucent_colour(const TranslucentTrees& trees, std::uint32_t slot,
                                           std::uint32_t source, bool exit, const Shader& shader);

/// Draws translucent trees over opaque surfaces, tile by tile.
class GhostPainter {
 public:
  /// Borrows `geometry`. @param world_error  as Coincidence has it
  GhostPainter(const Tree& tree, std::span<const Translucent> ghosts, const Geometry& geometry,
               double world_error);
  ~GhostPainter();

  [[nodiscard]] bool empty() const { return trees_.empty(); }

  /// Prepares for the tiles of a view. Keeps a reference to `shader`.
  /// @return kGeometry, kLimit, kCancelled
  Result<void> begin(const View& view, const Shader& shader, const Execution& execution);
  /// Whether surfaces may lie in a tile. @param tile  its pixels
  [[nodiscard]] bool meets(const PixelRect& tile) const;
  /// Blends all surfaces of a tile that lie before the opaque ones into its colours, which are
  /// premultiplied. @param opaque  depths of the opaque surfaces from the tile's first pixel on,
  /// rows `stride` apart as those of `colours`; null: there are none @param worker  of the thread
  void paint(const PixelRect& tile, const std::uint32_t* opaque, Rgba* colours, std::size_t stride,
             std::size_t worker);
  /// What begin() prepared is given back. @return kLimit: some tile was not painted
  Result<void> end();

  /// Crossings of the last view.
  [[nodiscard]] std::uint64_t fragments() const { return fragments_; }

 private:
  struct Prepared;

  TranslucentTrees trees_;
  std::unique_ptr<Prepared> prepared_;
  std::uint64_t fragments_ = 0;
};

}  // namespace strata::csg
