#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "raster/tile_bins.h"
#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/inside_rule.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/tile_lists.h"
#include "voxelize/open/winding_field.h"

// Depth lists along x, y and z -> where the edges between voxel centres are cut. Private to
// contour/.

namespace strata::contouring {

/// A number of things as a size. @pre value >= 0
inline std::size_t size(int value) { return static_cast<std::size_t>(value); }

/// Voxels along the side of a block. Edge k of a column joins voxels k - 1 and k, and belongs to
/// the block of k; voxels outside the grid are outside.
inline constexpr int kBlockSide = 32;

/// A cut edge in its block. [v:5 | u:5 | k:5 | offset:8 | triangle:31] in AxisFrame, local voxels
struct CutEdge {
  std::uint64_t bits = 0;

  static constexpr std::uint32_t kNoTriangle = 0x7fffffffu;  ///< no plane is known
  static constexpr std::uint32_t kGridFace = 0x7ffffffeu;    ///< cut off at a face of the grid
  static constexpr int kMiddle = 128;

  CutEdge() = default;
  CutEdge(int u, int v, int k, int offset, std::uint32_t triangle)
      : bits(static_cast<std::uint64_t>((v * kBlockSide + u) * kBlockSide + k) << 39 |
             static_cast<std::uint64_t>(offset) << 31 | triangle) {}
  [[nodiscard]] int u() const { return static_cast<int>(bits >> 44 & 31); }
  [[nodiscard]] int v() const { return static_cast<int>(bits >> 49 & 31); }
  [[nodiscard]] int k() const { return static_cast<int>(bits >> 39 & 31); }
  /// Lattice steps beyond the lower centre, 1 to 255.
  [[nodiscard]] int offset() const { return static_cast<int>(bits >> 31 & 255); }
  [[nodiscard]] std::uint32_t triangle() const {
    return static_cast<std::uint32_t>(bits & 0x7fffffffu);
  }
};

/// All edges of a grid whose ends differ, by blocks. Of several crossings of an edge the first one
/// that changes the inside counts.
class GridCrossings {
 public:
  struct Settings {
    InsideRule rule = InsideRule::kWinding;
    const TileListFilter* filter = nullptr;
    const WindingField* field = nullptr;  ///< changes the inside without crossings
  };
  static Result<GridCrossings> collect(const LatticeMesh& mesh, const VoxelGrid& grid,
                                       const Settings& settings, const Execution& execution);

  /// Blocks along each axis, one more than voxels need where edges reach beyond them.
  [[nodiscard]] const glm::ivec3& blocks() const { return blocks_; }
  /// The cut edges along `axis` of a block, by v, u and k.
  [[nodiscard]] std::span<const CutEdge> block(int axis, const glm::ivec3& block) const;
  /// Calls visit(block) for each block and axis with cut edges.
  template <class Visit>
  void for_each_block(Visit&& visit) const;
  /// Edges with crossings whose ends do not differ.
  [[nodiscard]] std::uint64_t lost() const { return lost_; }
  [[nodiscard]] std::uint64_t memory_bytes() const { return bytes_; }

 private:
  struct Tile {
    std::vector<CutEdge> edges;  ///< by block along the rays, quarter of the tile, v, u and k
    std::vector<std::uint32_t>
        offsets;  ///< 4 for each block, and one; none where there are no edges
  };
  struct Side {
    int tiles_u = 0, tiles_v = 0, depth_blocks = 0;
    std::vector<Tile> tiles;
  };
  class Collector;

  glm::ivec3 blocks_{0};
  std::array<Side, 3> sides_;
  std::uint64_t lost_ = 0, bytes_ = 0;
};

template <class Visit>
void GridCrossings::for_each_block(Visit&& visit) const {
  for (int axis = 0; axis < 3; ++axis) {
    const AxisFrame frame(static_cast<Axis>(axis));
    const Side& side = sides_[static_cast<std::size_t>(axis)];
    for (std::size_t t = 0; t < side.tiles.size(); ++t) {
      const auto& offsets = side.tiles[t].offsets;
      for (std::size_t i = 0; i + 1 < offsets.size(); ++i) {
        if (offsets[i] == offsets[i + 1]) continue;
        glm::ivec3 block;
        block[frame.u] = static_cast<int>(t) % side.tiles_u * 2 + static_cast<int>(i % 2);
        block[frame.v] = static_cast<int>(t) / side.tiles_u * 2 + static_cast<int>(i / 2 % 2);
        block[frame.w] = static_cast<int>(i / 4);
        visit(block);
      }
    }
  }
}

}  // namespace strata::contouring
