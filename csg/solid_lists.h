#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "core/execution.h"
#include "core/result.h"
#include "csg/tree.h"
#include "hashbuffer/list_filter.h"
#include "mesh/triangle_soup.h"

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
  /// From now on the filter's lists are labelled: what lies behind a crossing is the label of the
  /// solid that csg/solid_labels.h says. @param labels of each solid of the tree, in [1, 2^31).
  /// Not while the filter has workers.
  void set_labels(const std::vector<std::uint32_t>& labels);
  /// Index into Tree::solids().
  [[nodiscard]] std::uint32_t solid_of(std::uint32_t triangle) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Sizes of a tree's result, from lists along three axes.
struct Measures {
  double volume = 0;        ///< cubic world units
  double volume_error = 0;  ///< bound: what is seen of the surface along each axis, times the
                            ///< voxel's side (invariant I18), or the spread of the three axes
  double area = 0;          ///< square world units
  double area_error = 0;    ///< estimate: cells at outlines, or three times the spread between
                            ///< interleaved half grids
  glm::dvec3 centre{0};     ///< centre of mass, world space
  glm::dvec3 low{0},
      high{0};              ///< bounds of the crossings, world space; within a voxel of the truth
  double bounds_error = 0;  ///< longest side of a voxel
  std::uint64_t result_crossings = 0;      ///< all axes
  std::uint64_t max_depth_complexity = 0;  ///< of the result
  bool empty = true;  ///< no ray met anything: the result is empty, or smaller than a voxel
};

/// Measures the result on a grid of `resolution` voxels along each side of its box.
/// @return kUsage (resolution not in [1, 32768]), kGeometry, kLimit, kCancelled
Result<Measures> measure(const Tree& tree, Tree::NodeId root, int resolution,
                         const Execution& execution = {});

}  // namespace strata::csg
