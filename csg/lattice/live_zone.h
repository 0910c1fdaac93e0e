#pragma once

#include <cstdint>
#include <glm/common.hpp>
#include <vector>

#include "csg/lattice/solid_voxels.h"
#include "exact/cut_points.h"

namespace strata::csg {

/// The box of whole steps around two points.
inline LatticeBox box_around(const exact::FilePoint& a, const exact::FilePoint& b) {
  constexpr exact::FilePoint kShift(exact::kFileBits);
  return {glm::ivec3(glm::min(a, b) >> kShift), glm::ivec3(glm::max(a, b) >> kShift) + 1};
}

/// The part of space where the boundary of a tree's result may be: voxels in which the tree's value
/// depends on the solids whose faces are there. All other space is dead: there the value is known
/// without them. A piece of a triangle that reaches into dead space is no face of the result, since
/// its two sides differ nowhere or everywhere. So cuts in dead space may be missed: the pieces that
/// lie in the zone are right, and no others matter.
///
/// Triangles are told from dead ones with a margin of two steps, edges with one, so that doubles
/// suffice for all edges.
class LiveZone {
 public:
  /// All space.
  LiveZone() = default;
  /// @param solids  of `tree`, closed
  /// @param rules  of each solid
  /// @param most_rows  of voxels in the boxes of triangles, about: more take more time than they
  /// save
  /// @return all space where too little is dead
  static LiveZone find(const LatticeSolids& solids, const Tree& tree, Tree::NodeId root,
                       const std::vector<InsideRule>& rules, std::uint64_t most_rows,
                       const Execution& execution);
  /// As many rows as pay off.
  static std::uint64_t usual_rows(const LatticeSolids& solids) {
    return 16 * std::uint64_t{solids.triangles.size()};
  }

  bool everywhere() const { return counts_.empty(); }
  /// Whether points of the box may be in the zone, or within two steps of it.
  bool touches(const LatticeBox& box) const {
    return everywhere() || count(grid_.voxels_of(box, CoarseGrid::kMargin)) > 0;
  }
  /// Whether all points between two are in the zone, or within about a step of it.
  bool contains(const exact::FilePoint& a, const exact::FilePoint& b) const;

 private:
  void count_voxels();
  bool worthwhile(const LatticeSolids& solids) const;
  // Live voxels.
  std::uint32_t count(const LatticeBox& voxels) const {
    const glm::ivec3 &a = voxels.low, b = voxels.high + 1;
    if (a.x >= b.x || a.y >= b.y || a.z >= b.z) return 0;
    const auto at = [this](int x, int y, int z) { return counts_[corner(x, y, z)]; };
    return at(b.x, b.y, b.z) - at(a.x, b.y, b.z) - at(b.x, a.y, b.z) - at(b.x, b.y, a.z) +
           at(a.x, a.y, b.z) + at(a.x, b.y, a.z) + at(b.x, a.y, a.z) - at(a.x, a.y, a.z);
  }
  std::size_t corner(int x, int y, int z) const {
    return static_cast<std::size_t>((z * (grid_.dims.y + 1) + y) * (grid_.dims.x + 1) + x);
  }
  bool is_live(const glm::ivec3& voxel) const {
    return live_[static_cast<std::size_t>(voxel.z * grid_.dims.y + voxel.y)] >> voxel.x & 1;
  }
  bool surely_dead(const exact::FilePoint& p) const;
  bool contains_along(const glm::dvec3& a, const glm::dvec3& b) const;

  CoarseGrid grid_;
  std::vector<std::uint64_t> live_;    // bits along x, of rows
  std::vector<std::uint32_t> counts_;  // live voxels below a corner of voxels along all axes
};

}  // namespace strata::csg
