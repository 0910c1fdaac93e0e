#include "csg/gl/tile_programs.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace strata::csg {

void TilePrograms::make(const FrameInput& frame, std::uint64_t binding_bytes,
                        std::vector<std::uint32_t>& left) {
  const auto count = static_cast<std::uint32_t>(frame.tiles_u * frame.tiles_v);
  tiles.assign(count, {});
  slots.clear();
  nodes.clear();
  edges_.clear();
  tile_nodes_.clear();
  used.assign(frame.view_parts.size(), 0);
  any = false;
  Simplifier simplifier(frame.program);
  // A tree that is true outside of everything begins where nothing is; the CPU knows.
  const bool odd = frame.program.nodes.empty() || frame.program.idle_value();
  std::uint32_t most_bits = 1;
  for (std::uint32_t tile = 0; tile < count; ++tile) {
    if (odd || slots.size() * sizeof(std::uint32_t) > binding_bytes / 2 ||
        !add(frame, tile, simplifier)) {
      left.push_back(tile);
      continue;
    }
    any = any || tiles[tile].slot_count > 0;
    most_bits = std::max(most_bits, tiles[tile].slot_count + tiles[tile].node_count);
  }
  bit_words = std::bit_ceil((most_bits + 31) / 32);

  // Masks, now that it is known how long they are.
  std::size_t next_node = 0;
  for (WalkTile& tile : tiles) {
    tile.nodes = static_cast<std::uint32_t>(nodes.size());
    for (std::uint32_t i = 0; i < tile.node_count; ++i) {
      const Node& node = tile_nodes_[next_node++];
      const std::size_t first = nodes.size();
      nodes.resize(first + 2 * std::size_t{bit_words}, 0);
      for (std::uint32_t e = node.first; e < node.first + node.count; ++e) {
        const Edge& edge = edges_[e];
        nodes[first + 2 * std::size_t{edge.bit / 32} + (edge.inverted ? 1 : 0)] |=
            std::uint32_t{1} << (edge.bit % 32);
      }
    }
  }
  if (nodes.size() * sizeof(std::uint32_t) > binding_bytes) leave_all(left), any = false;
}

void TilePrograms::leave_all(std::vector<std::uint32_t>& left) const {
  left.resize(tiles.size());
  std::iota(left.begin(), left.end(), 0u);
}

/// Adds a tile's program; false: it cannot be walked.
bool TilePrograms::add(const FrameInput& frame, std::uint32_t tile, Simplifier& simplifier) {
  const auto solids = frame.solids(tile);
  const int tile_u = static_cast<int>(tile) % frame.tiles_u;
  const int tile_v = static_cast<int>(tile) / frame.tiles_u;
  leaves_.resize(std::max(leaves_.size(), solids.size()));
  std::size_t count = 0;
  for (const std::uint32_t solid : solids) {
    const ViewPart& part = frame.view_parts[solid];
    if (part.binned && part.bins.tile(tile_u, tile_v).empty()) continue;
    if (part.cut) return false;
    leaves_[count].solid = solid;
    leaves_[count].nearest = part.nearest;
    ++count;
  }
  if (count == 0) return true;
  present_.resize(count);
  std::iota(present_.begin(), present_.end(), 0u);
  simplifier.simplify(std::span(leaves_).first(count), present_, program_);
  if (program_.constant) return true;

  // Bits: the leaves that occur, then the nodes that the root reaches, children first.
  WalkTile& out = tiles[tile];
  bit_of_leaf_.assign(count, Program::kNone);
  std::uint32_t bits = 0, low = Program::kNone, high = 0;
  for (const std::uint32_t leaf : program_.leaves) {
    bit_of_leaf_[leaf] = bits++;
    low = std::min(low, leaves_[leaf].solid);
    high = std::max(high, leaves_[leaf].solid);
  }
  node_of_.assign(program_.nodes.size(), Program::kNone);
  node_of_[program_.root] = 0;
  for (std::size_t n = program_.nodes.size(); n-- > 0;) {
    if (node_of_[n] == Program::kNone) continue;
    const TileProgram::Node& node = program_.nodes[n];
    for (std::uint32_t e = node.first; e < node.first + node.count; ++e) {
      if (!program_.edges[e].leaf()) node_of_[program_.edges[e].child()] = 0;
    }
  }
  const std::uint32_t slot_count = bits;
  for (std::uint32_t& node : node_of_) {
    if (node != Program::kNone) node = bits++;
  }
  if (bits > 32 * kMostWords) return false;
  out.slot_count = slot_count;
  out.node_count = bits - slot_count;
  out.root = node_of_[program_.root];
  out.inverted = program_.root_inverted ? 1 : 0;
  out.first_solid = low;
  out.solid_count = high - low + 1;
  out.slots = static_cast<std::uint32_t>(slots.size());
  slots.resize(slots.size() + out.solid_count, Program::kNone);
  for (const std::uint32_t leaf : program_.leaves) {
    slots[out.slots + leaves_[leaf].solid - low] = bit_of_leaf_[leaf];
    used[leaves_[leaf].solid] = 1;
  }
  for (std::size_t n = 0; n < program_.nodes.size(); ++n) {
    if (node_of_[n] == Program::kNone) continue;
    const TileProgram::Node& node = program_.nodes[n];
    tile_nodes_.push_back({static_cast<std::uint32_t>(edges_.size()), node.count});
    for (std::uint32_t e = node.first; e < node.first + node.count; ++e) {
      const Program::Edge edge = program_.edges[e];
      edges_.push_back(
          {edge.leaf() ? bit_of_leaf_[edge.child()] : node_of_[edge.child()], edge.inverted()});
    }
  }
  return true;
}

}  // namespace strata::csg
