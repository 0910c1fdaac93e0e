#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "csg/surface/frame_input.h"
#include "csg/surface/tile_surface.h"

// The tree as the walk of the GPU wants it. Private to csg/gl/.

namespace strata::csg {

/// A tile's program: struct WalkTile of walk_common.glsl, which says what the numbers mean.
struct WalkTile {
  static constexpr std::uint32_t kRoot = 0xfffffffeu;        ///< an edge above the root
  static constexpr std::uint32_t kHandedOver = 0xffffffffu;  ///< slot_count of result.comp.glsl
  std::uint32_t slot_count = 0, node_count = 0, nodes = 0, slots = 0;
  std::uint32_t first_solid = 0, solid_count = 0, outside = 0, unused = 0;
};

/// The programs of tiles, each simplified for the solids that may be met there.
class TilePrograms {
 public:
  /// Most solids of a tile, and most nodes.
  static constexpr std::uint32_t kMost = 1024;

  /// For the surfaces of a frame. Tiles that the walk cannot do are appended to `left`.
  /// @param binding_bytes of the largest table
  void make(const FrameInput& frame, std::uint64_t binding_bytes, std::vector<std::uint32_t>& left);
  /// For whole lists: solids_of[tile] are the solids, increasing, that may be met in a tile; all
  /// of them get a bit. Tiles that the walk cannot do are handed over.
  void make(const Program& program, std::span<const std::vector<std::uint32_t>> solids_of,
            std::uint64_t binding_bytes);
  /// After all none is done: those that were not left yet are.
  void leave_all(std::vector<std::uint32_t>& left) const;

  std::vector<WalkTile> tiles;
  std::vector<std::uint32_t> slots, nodes;
  std::vector<std::uint8_t> used;                ///< of each solid: some tile's program asks for it
  std::uint32_t most_slots = 0, most_nodes = 0;  ///< of a tile
  bool any = false;                              ///< some tile has a program

 private:
  void begin(std::size_t tile_count, std::size_t solid_count);
  bool add(const FrameInput& frame, std::uint32_t tile, Simplifier& simplifier);
  bool add(std::uint32_t tile, std::size_t leaf_count, bool all, Simplifier& simplifier);
  void add_nodes(WalkTile& out);

  std::vector<LeafLayers> leaves_;  ///< those of the tile come first
  std::vector<std::uint32_t> present_, slot_of_leaf_, node_of_;
  TileProgram program_;
};

}  // namespace strata::csg
