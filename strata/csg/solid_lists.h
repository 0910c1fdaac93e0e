#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"
#include "strata/hashbuffer/tile_lists.h"
#include "strata/mesh/triangle_soup.h"

// Labels divide the result of a tree into parts. A point belongs to the first solid of the tree
// that holds it and is not subtracted. SolidLists::set_labels() makes lists that name the parts by
// the labels of their solids.

namespace strata::csg {

/// A tree for algorithms on lists of crossings: all its solids as one soup in world space, and the
/// filter that turns the soup's lists into the lists of the tree's result. So all functions that
/// take a mesh and a filter (voxelize(), build_ldi()) also take a tree, with every crossing (law
/// 6): a depth is inside if the tree is true after all crossings up to it. No tolerance is applied.
///
/// A crossing of the result has the index of a triangle of `soup`; solid_of() gives its solid.
class SolidLists {
 public:
  /// The tree below `root`. Solids that it does not reach are left out of the soup.
  SolidLists(const Tree& tree, Tree::NodeId root);
  ~SolidLists();
  /// A moved-from object may only be destroyed or assigned to.
  SolidLists(SolidLists&&) noexcept;
  /// As the constructor.
  SolidLists& operator=(SolidLists&&) noexcept;

  /// All solids, world space.
  [[nodiscard]] const TriangleSoup& soup() const;
  /// Moves the soup out; the filter stays valid.
  [[nodiscard]] TriangleSoup take_soup();
  /// From the soup's lists to the result's. Borrows this object.
  [[nodiscard]] const TileListFilter& filter() const;
  /// The same, but never labelled.
  [[nodiscard]] const TileListFilter& unlabelled_filter() const;
  /// Clamps the soup where it does not fit the lattice of `grid`, far outside the grid. Lists of
  /// the grid's rays do not change. The filter must have no workers meanwhile.
  /// @param taken  the soup, if it was moved out
  /// @return kCancelled
  Result<void> fit(const VoxelGrid& grid, TriangleSoup* taken = nullptr,
                   const Execution& execution = {});
  /// Labels the filter's lists from now on: the label of a crossing is that of the solid behind it,
  /// see strata/csg/solid_lists.h. The filter must have no workers meanwhile. @param labels one
  /// for each solid of the tree, in [1, 2^31)
  void set_labels(const std::vector<std::uint32_t>& labels);
  /// Whether a triangle's solid is subtracted, so that the triangle faces into the result.
  [[nodiscard]] bool is_subtracted(std::uint32_t triangle) const;
  /// Index into Tree::solids().
  [[nodiscard]] std::uint32_t solid_of(std::uint32_t triangle) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The solids below `root` that are not subtracted, in the order of the tree's operands.
[[nodiscard]] std::vector<std::uint32_t> added_solids(const Tree& tree, Tree::NodeId root);

/// Labels that divide a tree into parts of one colour.
struct ColourLabels {
  std::vector<std::uint32_t>
      labels;  ///< one for each solid of the tree; colour n has the label n + 1
  std::vector<glm::vec4>
      colours;  ///< of the solids that are not subtracted, in order of appearance
};

/// @param none  the colour of solids without one
[[nodiscard]] ColourLabels colour_labels(const Tree& tree, Tree::NodeId root,
                                         const glm::vec4& none);

/// Labels that divide a tree into its solids: solid n has the label n + 1.
[[nodiscard]] std::vector<std::uint32_t> id_labels(const Tree& tree);

}  // namespace strata::csg
