// Walks the lists of a tree's solids, a thread a pixel: a crossing toggles the bit of its solid, and
// after all crossings of a depth the tree is evaluated. The first depth where the tree is true is the
// visible surface, if no other crossing may coincide with it (law 5) and every solid is entered and
// left in turn. All other pixels are doubtful: their lists are handed over.

layout(local_size_x = 8, local_size_y = 8) in;

const uint kWalkDoubtful = 0xfffffffeu;
const uint kWalkLongest = 255u;  // doubtful lists that are longer are not handed over

layout(std430, binding = 0) readonly buffer WalkTriangles {
  uvec2 walk_triangles[];
};  // solid, extra depth steps of a steep triangle
layout(std430, binding = 4) writeonly buffer WalkSurfaces { uvec2 walk_surfaces[]; };
// Of each doubtful pixel: its number, its list's length n (kWalkNone: too long), n depths and
// payloads.
layout(std430, binding = 5) buffer WalkDoubts {
  uint walk_doubt_words;
  uint walk_doubt_unused[3];
  uint walk_doubts[];
};
uniform uint walk_width;      // pixels of a row
uniform uint walk_row_begin;  // of the screen
uniform uint walk_row_end;
uniform uint walk_first_row;  // of the picture, where the screen begins
uniform uint walk_tiles_u;
uniform uint walk_doubt_capacity;
uniform float walk_range_intercept, walk_range_slope, walk_range_constant, walk_range_quadratic;
uniform float walk_depth_limit;

// A little more than the bounds of two faces near a depth, if neither is steep.
int walk_reach(uint depth) {
  float nearness = walk_range_intercept - walk_range_slope * float(depth);
  float reach = walk_range_constant + walk_range_quadratic * nearness * nearness;
  return int(min(reach, walk_depth_limit)) + 1;
}

// Appends a doubtful pixel and its list of `count` crossings to walk_doubts.
void walk_hand_over(uint pixel, uint count) {
  walk_surfaces[pixel] = uvec2(kWalkDoubtful, 0u);
  bool too_long = count > kWalkLongest;
  uint words = too_long ? 2u : 2u + 2u * count;
  uint at = atomicAdd(walk_doubt_words, words);
  if (at + words > walk_doubt_capacity) return;
  walk_doubts[at] = pixel;
  walk_doubts[at + 1u] = too_long ? kWalkNone : count;
  if (too_long) return;
  StrataCursor cursor = strata_list(pixel);
  at += 2u;
  for (uint i = 0u; i < count; ++i) {
    uint depth, payload;
    if (!strata_next(cursor, depth, payload)) break;
    walk_doubts[at] = depth;
    walk_doubts[at + 1u] = payload;
    at += 2u;
  }
}

void main() {
  uint u = gl_GlobalInvocationID.x, v = gl_GlobalInvocationID.y + walk_row_begin;
  if (u >= walk_width || v >= walk_row_end) return;
  uint pixel = v * walk_width + u;
  WalkTile tile = walk_tiles[((v + walk_first_row) >> 6) * walk_tiles_u + (u >> 6)];
  if (tile.slot_count == 0u) {
    walk_surfaces[pixel] = uvec2(kWalkNone, 0u);
    return;
  }
  walk_begin(tile);

  bool doubt = false, found = false;
  uvec2 surface = uvec2(kWalkNone, 0u);
  int near_until = 0;     // crossings up to there may coincide with what is seen
  int latest_before = -1;  // how near_until back crossings before the group may be
  uint group_count = 0u, group_depth = 0u, group_payload = 0u;
  bool group_enters = false;  // a solid is entered in the group
  int group_extra = 0;
  uint count = 0u;
  StrataCursor cursor = strata_list(pixel);
  for (;;) {
    uint depth, payload;
    bool present = strata_next(cursor, depth, payload);
    uint slot = kWalkNone;
    int extra_steps = 0;
    if (present) {
      ++count;
      uvec2 triangle = walk_triangles[payload & 0x7fffffffu];
      uint solid = triangle.x - tile.first_solid;
      if (solid < tile.solid_count) slot = walk_slots[tile.slots + solid];
      if (slot == kWalkNone) continue;
      extra_steps = int(triangle.y);
    }
    if (!found && group_count > 0u && (!present || depth != group_depth)) {
      if (walk_rounds > WALK_MOST_ROUNDS) {  // a driver may not walk that long
        found = true;
        doubt = true;
      } else if (walk_value) {
        found = true;
        surface = uvec2(group_depth, group_payload);
        int reach = walk_reach(group_depth) + 2 * group_extra;
        near_until = int(group_depth) + reach;
        doubt = doubt || group_count > 1u || latest_before >= int(group_depth) - reach;
      } else {
        latest_before = max(latest_before, int(group_depth) + group_extra);
      }
      group_count = 0u;
      group_extra = 0;
      group_enters = false;
    }
    if (!present) break;
    bool leaves = payload >> 31 != 0u;
    doubt = doubt || walk_inside(slot) != leaves;
    // It may be left where it is entered: whether that is something depends on the solid.
    doubt = doubt || (leaves && group_enters && depth == group_depth);
    if (walk_rounds <= WALK_MOST_ROUNDS) walk_toggle(tile, slot);
    if (found) {
      doubt = doubt || int(depth) - extra_steps <= near_until;
    } else {
      ++group_count;
      group_enters = group_enters || !leaves;
      group_depth = depth;
      group_payload = payload;
      group_extra = max(group_extra, extra_steps);
    }
  }
  doubt = doubt || walk_inside_any(tile);
  if (!doubt) {
    walk_surfaces[pixel] = surface;
    return;
  }
  walk_hand_over(pixel, count);
}
