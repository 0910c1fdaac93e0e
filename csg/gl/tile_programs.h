#pragma once

#include <cstdint>
#include <vector>

#include "csg/surface_source.h"
#include "csg/tile_surface.h"

// The tree as the walk of the GPU wants it. Private to csg/gl/.

namespace strata::csg {

/// A tile's program: struct WalkTile of walk.comp.glsl, which says what the numbers mean.
struct WalkTile {
  std::uint32_t slot_count = 0, node_count = 0, nodes = 0, slots = 0;
  std::uint32_t first_solid = 0, solid_count = 0, root = 0, inverted = 0;
};

/// The programs of all tiles of a frame, each simplified for the solids that may be met there.
class TilePrograms {
 public:
  /// Most words of bits (solids and nodes) of a tile.
  static constexpr std::uint32_t kMostWords = 32;

  /// Tiles that the walk cannot do are appended to `left`. @param binding_bytes of the largest
  /// table
  void make(const FrameInput& frame, std::uint64_t binding_bytes, std::vector<std::uint32_t>& left);
  /// After all none is done: those that were not left yet are.
  void leave_all(std::vector<std::uint32_t>& left) const;

  std::vector<WalkTile> tiles;
  std::vector<std::uint32_t> slots, nodes;
  std::vector<std::uint8_t> used;  ///< of each solid: some tile's program asks for it
  std::uint32_t bit_words = 1;     ///< words of bits of the largest tile, rounded to a power of two
  bool any = false;                ///< some tile has a program

 private:
  struct Edge {
    std::uint32_t bit;
    bool inverted;
  };
  struct Node {
    std::uint32_t first, count;  ///< into edges_
  };
  bool add(const FrameInput& frame, std::uint32_t tile, Simplifier& simplifier);

  std::vector<LeafLayers> leaves_;
  std::vector<std::uint32_t> present_, bit_of_leaf_, node_of_;
  TileProgram program_;
  std::vector<Edge> edges_;
  std::vector<Node> tile_nodes_;  ///< of all tiles, in their order
};

}  // namespace strata::csg
