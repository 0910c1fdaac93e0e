#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <optional>
#include <span>
#include <vector>

#include "csg/geometry.h"
#include "csg/picture/shade.h"
#include "csg/program.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/picture/picture.h"

// Parts of a scene that are drawn transparent, by all their surfaces in order. Private to csg/.

namespace strata::csg {

/// A tree that is seen through.
struct Translucent {
  Tree::NodeId node = Tree::kNone;
  std::optional<glm::vec4> colour;  ///< of all its faces; empty: each face has its solid's colour
};

/// Takes the children of the root's unions whose solids all have an alpha below 1 (but for what is
/// taken away from them) out of the tree: they are added to `out`, and the root of what is left,
/// which may be a new node, is returned.
[[nodiscard]] Tree::NodeId take_translucent(Tree& tree, std::vector<Translucent>& out);

/// Draws translucent trees over opaque surfaces.
class GhostPainter {
 public:
  /// @param world_error as Coincidence has it
  GhostPainter(const Tree& tree, std::span<const Translucent> ghosts, const Geometry& geometry,
               double world_error);

  [[nodiscard]] bool empty() const { return slots_.empty(); }

  /// Blends all surfaces that lie before those of `opaque` into `colours`, which are
  /// premultiplied. @return kGeometry, kLimit, kCancelled
  Result<void> paint(const View& view, const SurfaceImage& opaque, const Shader& shader,
                     const Execution& execution, std::span<Rgba> colours);

  [[nodiscard]] std::uint64_t fragments() const { return fragments_; }

 private:
  /// A solid of a ghost.
  struct Slot {
    std::uint32_t ghost = 0;
    std::uint32_t solid = 0;  ///< of the whole tree
    std::uint32_t leaf = 0;   ///< of the ghost's program
  };
  struct GhostProgram {
    Program program;
    std::optional<glm::vec4> colour;
  };
  struct Painted;
  class PixelPainter;

  const Geometry* geometry_;
  double world_error_;
  std::vector<Slot> slots_;  ///< ghost by ghost
  std::vector<GhostProgram> programs_;
  std::uint64_t fragments_ = 0;
};

}  // namespace strata::csg
