#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"
#include "strata/hashbuffer/list_filter.h"
#include "strata/mesh/triangle_soup.h"

namespace strata::csg {

/// A tree for those who work on lists of crossings: all its solids as one soup in world space, and
/// the filter that makes the lists of the tree's result of the soup's lists. So whatever takes a
/// mesh and a filter (voxelize(), build_ldi()) takes a tree, with every crossing (law 6): a depth
/// is inside where the tree is true after all crossings up to it. No tolerance is applied.
///
/// A result's crossing carries the number of a triangle of `soup`; solid_of() tells whose it is.
class SolidLists {
 public:
  /// The tree below `root`. Solids that it does not reach are left out of the soup.
  SolidLists(const Tree& tree, Tree::NodeId root);
  ~SolidLists();
  SolidLists(SolidLists&&) noexcept;
  SolidLists& operator=(SolidLists&&) noexcept;

  [[nodiscard]] const TriangleSoup& soup() const;
  /// Takes the soup away; the filter stays good.
  [[nodiscard]] TriangleSoup take_soup();
  [[nodiscard]] const TileListFilter& filter() const;
  /// The same, but never labelled.
  [[nodiscard]] const TileListFilter& unlabelled_filter() const;
  /// Cuts the soup off where it does not fit the lattice of `grid`, far outside of that: lists
  /// of the grid's rays are as of the whole soup. Not while the filter has workers.
  /// @param taken  the soup, when it was taken away
  /// @return kCancelled
  Result<void> fit(const VoxelGrid& grid, TriangleSoup* taken = nullptr,
                   const Execution& execution = {});
  /// From now on the filter's lists are labelled: what lies behind a crossing is the label of the
  /// solid that strata/csg/solid_labels.h says. @param labels of each solid of the tree, in [1,
  /// 2^31). Not while the filter has workers.
  void set_labels(const std::vector<std::uint32_t>& labels);
  /// Whether a triangle's solid is subtracted, so that the triangle faces into the result.
  [[nodiscard]] bool is_subtracted(std::uint32_t triangle) const;
  /// Index into Tree::solids().
  [[nodiscard]] std::uint32_t solid_of(std::uint32_t triangle) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace strata::csg
