// What the walks of lists share: a tile's part of the tree, and its state along a ray.

// A tile's program: solids have slots, nodes are unions of edges as in csg/program.h. At walk_nodes
// + nodes lie the edges above the slots, then those above the nodes, then of each node how many of
// its edges are true while the ray is outside of all solids.
struct WalkTile {
  uint slot_count;  // 0: nothing is to be found in the tile
  uint node_count;
  uint nodes;
  uint slots;  // where the tile's solids begin in walk_slots: solid s is at slots + s - first
  uint first_solid;
  uint solid_count;
  uint outside;  // 1: the tree is true outside of all solids
  uint unused;
};

const uint kWalkNone = 0xffffffffu;
const uint kWalkRoot = 0xfffffffeu;  // an edge to nothing: the value of the tree changes

layout(std430, binding = 1) readonly buffer WalkTiles { WalkTile walk_tiles[]; };
layout(std430, binding = 2) readonly buffer WalkSlots { uint walk_slots[]; };
layout(std430, binding = 3) readonly buffer WalkNodes { uint walk_nodes[]; };

uint walk_bits[WALK_WORDS];    // a bit a slot: the ray is inside
uint walk_counts[WALK_NODES];  // of each node: its edges that are true
bool walk_value;               // of the tree
uint walk_rounds;              // of loops

void walk_begin(WalkTile tile) {
  for (int word = 0; word < WALK_WORDS; ++word) walk_bits[word] = 0u;
  uint counts = tile.nodes + tile.slot_count + tile.node_count;
  for (uint node = 0u; node < tile.node_count; ++node) {
    walk_counts[node] = walk_nodes[counts + node];
  }
  walk_value = tile.outside != 0u;
  walk_rounds = tile.node_count;
}

bool walk_inside(uint slot) { return (walk_bits[slot >> 5] >> (slot & 31u) & 1u) != 0u; }

// Enters or leaves a solid. That climbs while nodes change.
void walk_toggle(WalkTile tile, uint slot) {
  uint bits = walk_bits[slot >> 5] ^ 1u << (slot & 31u);
  walk_bits[slot >> 5] = bits;
  bool value = (bits >> (slot & 31u) & 1u) != 0u;
  uint edge = walk_nodes[tile.nodes + slot];  // [node | inverted:1]
  while (edge < kWalkRoot) {
    uint node = edge >> 1;
    uint before = walk_counts[node];
    uint after = value != ((edge & 1u) != 0u) ? before + 1u : before - 1u;
    walk_counts[node] = after;
    if ((before == 0u) == (after == 0u)) return;
    value = after != 0u;
    edge = walk_nodes[tile.nodes + tile.slot_count + node];
    ++walk_rounds;
  }
  if (edge == kWalkRoot) walk_value = !walk_value;
}

// Whether the ray is inside any solid.
bool walk_inside_any(WalkTile tile) {
  uint any = 0u;
  for (uint word = 0u; word * 32u < tile.slot_count; ++word) any |= walk_bits[word];
  return any != 0u;
}
