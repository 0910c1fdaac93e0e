#include "csg/gl/tile_programs.h"

#include <algorithm>
#include <numeric>

namespace strata::csg {

void TilePrograms::begin(std::size_t tile_count, std::size_t solid_count) {
  tiles.assign(tile_count, {});
  slots.clear();
  nodes.clear();
  used.assign(solid_count, 0);
  most_slots = most_nodes = 0;
  any = false;
}

void TilePrograms::make(const FrameInput& frame, std::uint64_t binding_bytes,
                        std::vector<std::uint32_t>& left) {
  const auto count = static_cast<std::uint32_t>(frame.tiles_u * frame.tiles_v);
  begin(count, frame.view_parts.size());
  Simplifier simplifier(frame.program);
  // A tree that is true outside of everything begins where nothing is; the CPU knows.
  const bool odd = frame.program.nodes.empty() || frame.program.value_when_outside();
  for (std::uint32_t tile = 0; tile < count; ++tile) {
    if (odd || slots.size() * sizeof(std::uint32_t) > binding_bytes / 2 ||
        !add(frame, tile, simplifier)) {
      left.push_back(tile);
    }
    any = any || tiles[tile].slot_count > 0;
  }
  if (nodes.size() * sizeof(std::uint32_t) > binding_bytes) leave_all(left), any = false;
}

void TilePrograms::make(const Program& program,
                        std::span<const std::vector<std::uint32_t>> solids_of,
                        std::uint64_t binding_bytes) {
  begin(solids_of.size(), program.leaves.size());
  Simplifier simplifier(program);
  for (std::uint32_t tile = 0; tile < solids_of.size(); ++tile) {
    const std::vector<std::uint32_t>& solids = solids_of[tile];
    leaves_.resize(std::max(leaves_.size(), solids.size()));
    for (std::size_t i = 0; i < solids.size(); ++i) {
      leaves_[i].solid = solids[i];
      leaves_[i].nearest = 0;
    }
    if (slots.size() * sizeof(std::uint32_t) > binding_bytes / 2 ||
        !add(tile, solids.size(), true, simplifier)) {
      tiles[tile].slot_count = WalkTile::kHandedOver;
    }
  }
  if (nodes.size() * sizeof(std::uint32_t) <= binding_bytes) return;
  for (WalkTile& tile : tiles) tile.slot_count = WalkTile::kHandedOver;
  nodes.clear();
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
  return add(tile, count, false, simplifier);
}

/// The same for the first `count` leaves. @param all also those that do not matter get a bit
bool TilePrograms::add(std::uint32_t tile, std::size_t count, bool all, Simplifier& simplifier) {
  if (count == 0) return true;
  present_.resize(count);
  std::iota(present_.begin(), present_.end(), 0u);
  simplifier.simplify(std::span(leaves_).first(count), present_, program_);
  if (program_.constant) return true;

  const auto& bearers = all ? present_ : program_.leaves;
  slot_of_leaf_.assign(count, Program::kNone);
  std::uint32_t slot_count = 0, low = Program::kNone, high = 0;
  for (const std::uint32_t leaf : bearers) {
    slot_of_leaf_[leaf] = slot_count++;
    low = std::min(low, leaves_[leaf].solid);
    high = std::max(high, leaves_[leaf].solid);
  }
  // The nodes that the root reaches; children come before parents.
  node_of_.assign(program_.nodes.size(), Program::kNone);
  node_of_[program_.root] = 0;
  for (std::size_t n = program_.nodes.size(); n-- > 0;) {
    if (node_of_[n] == Program::kNone) continue;
    const TileProgram::Node& node = program_.nodes[n];
    for (std::uint32_t e = node.first; e < node.first + node.count; ++e) {
      if (!program_.edges[e].leaf()) node_of_[program_.edges[e].child()] = 0;
    }
  }
  std::uint32_t node_count = 0;
  for (std::uint32_t& node : node_of_) {
    if (node != Program::kNone) node = node_count++;
  }
  if (slot_count > kMost || node_count > kMost) return false;
  most_slots = std::max(most_slots, slot_count);
  most_nodes = std::max(most_nodes, node_count);
  WalkTile& out = tiles[tile];
  out.slot_count = slot_count;
  out.node_count = node_count;
  out.first_solid = low;
  out.solid_count = high - low + 1;
  out.slots = static_cast<std::uint32_t>(slots.size());
  slots.resize(slots.size() + out.solid_count, Program::kNone);
  for (const std::uint32_t leaf : bearers) {
    slots[out.slots + leaves_[leaf].solid - low] = slot_of_leaf_[leaf];
    used[leaves_[leaf].solid] = 1;
  }
  add_nodes(out);
  return true;
}

/// The edges above slots and nodes, and what the nodes are while nothing is inside.
void TilePrograms::add_nodes(WalkTile& out) {
  out.nodes = static_cast<std::uint32_t>(nodes.size());
  nodes.resize(nodes.size() + out.slot_count + 2 * std::size_t{out.node_count}, Program::kNone);
  const std::span<std::uint32_t> above = std::span(nodes).subspan(out.nodes);
  const std::span<std::uint32_t> counts = above.subspan(out.slot_count + out.node_count);
  for (std::size_t n = 0; n < program_.nodes.size(); ++n) {
    const std::uint32_t number = node_of_[n];
    if (number == Program::kNone) continue;
    const TileProgram::Node& node = program_.nodes[n];
    counts[number] = 0;
    for (std::uint32_t e = node.first; e < node.first + node.count; ++e) {
      const Program::Edge edge = program_.edges[e];
      const std::uint32_t word = number << 1 | (edge.inverted() ? 1u : 0u);
      if (edge.leaf()) {
        above[slot_of_leaf_[edge.child()]] = word;
        counts[number] += edge.inverted() ? 1 : 0;
      } else {
        const std::uint32_t child = node_of_[edge.child()];
        above[out.slot_count + child] = word;
        counts[number] += (counts[child] > 0) != edge.inverted() ? 1 : 0;
      }
    }
  }
  const std::uint32_t root = node_of_[program_.root];
  above[out.slot_count + root] = WalkTile::kRoot;
  out.outside = (counts[root] > 0) != program_.root_inverted ? 1 : 0;
}

}  // namespace strata::csg
