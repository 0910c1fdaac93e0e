#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "csg/geometry.h"
#include "csg/program.h"
#include "csg/transition.h"
#include "raster/view_part.h"
#include "strata/core/depth_list.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"
#include "strata/raster/lattice_mesh.h"
#include "strata/raster/view.h"

// Parts of a scene that are seen through: all their surfaces along a ray. Private to csg/.

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

/// Translucent trees, compiled each by itself.
class TranslucentTrees {
 public:
  /// A solid of a translucent tree.
  struct Slot {
    std::uint32_t part = 0;   ///< the tree
    std::uint32_t solid = 0;  ///< of the whole tree
    std::uint32_t leaf = 0;   ///< of the part's program
  };
  struct Part {
    Program program;
    std::optional<glm::vec4> colour;  ///< as Translucent has it
  };

  /// Borrows `geometry`. @param world_error  as Coincidence has it
  TranslucentTrees(const Tree& tree, std::span<const Translucent> translucent,
                   const Geometry& geometry, double world_error);

  [[nodiscard]] bool empty() const { return slots_.empty(); }
  [[nodiscard]] std::span<const Slot> slots() const { return slots_; }  ///< part by part
  [[nodiscard]] std::span<const Part> parts() const { return parts_; }
  [[nodiscard]] const Geometry& geometry() const { return *geometry_; }
  [[nodiscard]] double world_error() const { return world_error_; }
  [[nodiscard]] const Geometry::Part& solid_of(const Slot& slot) const {
    return geometry_->parts()[slot.solid];
  }

 private:
  const Geometry* geometry_;
  double world_error_;
  std::vector<Slot> slots_;
  std::vector<Part> parts_;
};

/// Translucent trees in one view.
struct TranslucentView {
  std::vector<ViewPart> parts;                 ///< of each slot
  std::vector<std::uint32_t> first_triangles;  ///< of each slot, among those of all
  std::vector<std::uint32_t> slot_of;          ///< of each triangle

  /// The slot of a crossing, whose triangle counts among those of all slots.
  [[nodiscard]] std::uint32_t slot(DepthItem item) const { return slot_of[item.triangle()]; }
  /// The triangle of the slot's mesh behind triangle `t` of all.
  [[nodiscard]] std::uint32_t source(std::uint32_t t) const {
    const std::uint32_t slot = slot_of[t];
    return parts[slot].source(t - first_triangles[slot]);
  }
  /// All slots as one mesh.
  struct Mesh {
    std::vector<glm::uvec3> triangles;
    LatticeMesh mesh;
  };
  [[nodiscard]] Mesh joined() const;

  /// @return kGeometry, kLimit, kCancelled
  static Result<TranslucentView> make(const TranslucentTrees& trees, const View& view,
                                      const Execution& execution);
};

/// Walks rays through translucent trees. Scratch of one thread.
class TranslucentWalk {
 public:
  /// A surface of a translucent tree.
  struct Fragment {
    std::uint32_t depth = 0, part = 0, solid = 0, triangle = 0;  ///< triangle of all slots
    bool exit = false;
  };

  /// Keeps references to `trees` and `seen`.
  TranslucentWalk(const TranslucentTrees& trees, const TranslucentView& seen, const View& view);

  /// All surfaces of all trees along a ray, front to back. Valid until the next call.
  /// @param items  crossings, sorted
  std::span<const Fragment> surfaces(std::span<const DepthItem> items);
  /// How far apart faces may be and still be one, in depth steps: thinner is nothing.
  [[nodiscard]] double slack(std::uint32_t depth) const {
    const double nearness = a_ - b_ * depth;
    return 3.0 + pixel_ * nearness + flat_ * nearness * nearness;
  }

 private:
  void walk(std::uint32_t part);

  const TranslucentTrees* trees_;
  const TranslucentView* seen_;
  double a_ = 1, b_ = 0, pixel_ = 0, flat_ = 0;
  std::vector<std::unique_ptr<ProgramState>> states_;
  std::vector<DepthItem> sorted_;
  std::vector<Transition> transitions_;
  std::vector<Fragment> fragments_;
};

}  // namespace strata::csg
