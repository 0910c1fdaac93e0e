#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "csg/geometry.h"
#include "exact/lattice_plane.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"

namespace strata::csg {

/// Lattice points p lie at world origin + step * p. The step is a power of two and the origin a
/// multiple of it, so that neither adds a rounding.
struct Lattice {
  glm::dvec3 origin{0.0};
  double step = 1.0;
};

/// The bits that the longest side of the result's box has at most, unless the caller asks for
/// others: 6 nm in a part of 0.4 m.
inline constexpr int kBoundaryBits = 26;

/// The solids of a tree on one lattice, snapped once: what every exact answer is about.
struct LatticeSolids {
  Lattice lattice;
  /// Bits of the lattice that were given up so that cutters far outside of the result fit, 0 in
  /// most scenes. A user is told.
  int coarsened = 0;
  std::vector<exact::LatticePoint> vertices;  ///< |coordinate| <= 2^28
  std::vector<glm::uvec3> triangles;          ///< counter-clockwise from outside, solid by solid
  /// Solid s has the triangles [first_triangle[s], first_triangle[s + 1]); none when it is not
  /// below the root.
  std::vector<std::uint32_t> first_triangle{0};
  /// Of each triangle, what its faces are labelled with; empty: solids have labels.
  std::vector<std::uint32_t> labels;

  std::size_t solid_count() const { return first_triangle.size() - 1; }
};

/// Snaps the solids below `root` to nearest, ties up. The step is such that the longest side of
/// bounds(tree, root) spans more than 2^(bits - 1) and at most 2^bits steps.
/// @param geometry  of `tree`
/// @pre the tree passes check_tree(); 1 <= bits <= 28
/// @return kLimit for more vertices or triangles than 2^32 - 1 or than the memory limit allows;
/// kCancelled. A result whose box is empty or a point has no triangles.
Result<LatticeSolids> snap_solids(const Tree& tree, Tree::NodeId root, const Geometry& geometry,
                                  int bits = kBoundaryBits, const Execution& execution = {});

}  // namespace strata::csg
