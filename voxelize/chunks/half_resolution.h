#pragma once

#include <cstdint>
#include <vector>

#include "strata/voxelize/intervals.h"

namespace strata {

/// What a voxel of half the resolution is of the eight that it has. (Internal to voxelize/.)
enum class HalfRule {
  kAny,   ///< solid if one of them is: thin walls stay
  kMost,  ///< the label that most of the solid ones have, of equals the least: ids, colours
  kSum    ///< the sum of the labels: shares, of which eight times as many are a full voxel
};

/// Voxels of twice the size, of slabs along x that come in increasing z. Sides are halved, upwards.
class HalfResolution {
 public:
  /// @param full  label of voxels without one
  HalfResolution(const VoxelGrid& grid, HalfRule rule, std::uint32_t full);

  /// @pre slab.axis() is kX; the slabs follow one another
  void add(const VoxelIntervals& slab);
  /// All that came, as labelled intervals; without labels for kAny.
  [[nodiscard]] const VoxelIntervals& set() const { return set_; }
  [[nodiscard]] static VoxelGrid grid_of(VoxelGrid grid);

 private:
  struct Rows {  // of a tile, whose rows come from two tiles of the slab
    std::vector<std::uint32_t> offsets;
    std::vector<Interval> items;
    std::vector<std::uint32_t> labels;
  };
  void add_row(const VoxelIntervals& slab, int v, int first_u, int last_u, Rows& rows) const;
  void merge(const VoxelIntervals& slab, int u, int v, Rows& rows) const;
  [[nodiscard]] std::uint32_t combine(std::uint32_t (&labels)[8]) const;

  HalfRule rule_;
  std::uint32_t full_;
  VoxelIntervals set_;
  std::vector<Rows> pending_;  // of the row of tiles that is not complete, by tile along u
};

}  // namespace strata
