// Makes the lists of a tree's result of the lists of its solids, a thread a pixel: a crossing toggles
// the bit of its solid, and where the tree's value is another one after all crossings of a depth,
// the result has a crossing there, that of the last of them (law 6). A pixel where a solid is not
// entered and left in turn hands its list over, and so do all pixels of a tile without a program.

layout(local_size_x = 8, local_size_y = 8) in;

const uint kResultKept = 16u;  // crossings that a thread keeps; longer results are walked twice
const uint kResultParity = 0x80000000u;
const uint kResultHandedOver = 0x80000000u;

// Of each triangle its solid, and kResultParity where any crossing enters or leaves the solid.
layout(std430, binding = 0) readonly buffer ResultTriangles { uint result_triangles[]; };
// Of each pixel: where its items begin; [handed over:1 | crossings:15 | items:16].
layout(std430, binding = 4) writeonly buffer ResultPlaces { uvec2 result_places[]; };
layout(std430, binding = 5) buffer ResultItems {
  uint result_used;      // items, also those that found no room
  uint result_too_long;  // a list that must not be walked here was met
  uint result_unused[2];
  uvec2 result_items[];  // of strata/core/depth_list.h
};
uniform uint walk_width;      // pixels of a row
uniform uint walk_row_begin;  // of the screen
uniform uint walk_row_end;
uniform uint walk_first_row;  // of the first tile, where the screen begins
uniform uint walk_tiles_u;
uniform uint walk_capacity;  // items
uniform uint walk_longest;   // crossings of a list, 32767 at most

uvec2 result_kept[kResultKept];

// Walks a list whose crossings go where the items from `at` on are, or are kept, as many as that is
// (kWalkNone). False: the list must be handed over. `count` becomes the list's length.
bool result_walk(WalkTile tile, uint pixel, uint at, out uint count, out uint found) {
  bool walks = tile.slot_count != 0u && tile.slot_count != kWalkNone;
  bool handed_over = tile.slot_count == kWalkNone;
  if (walks) walk_begin(tile);
  bool value = tile.outside != 0u, group = false;
  uint group_depth = 0u, triangle = 0u;
  count = 0u;
  found = 0u;
  StrataCursor cursor = strata_list(pixel);
  for (;;) {
    uint depth, payload;
    bool present = strata_next(cursor, depth, payload);
    if (walks && group && (!present || depth != group_depth)) {
      if (walk_rounds > WALK_MOST_ROUNDS) {  // a driver may not walk that long
        handed_over = true;
        walks = false;
      } else if (walk_value != value) {
        value = !value;
        uvec2 item = uvec2(triangle | (value ? 0u : 0x80000000u), group_depth);
        if (at != kWalkNone) {
          result_items[at + found] = item;
        } else if (found < kResultKept) {
          result_kept[found] = item;
        }
        ++found;
      }
      group = false;
    }
    if (!present || count == walk_longest) {
      if (present) ++count;
      break;
    }
    ++count;
    if (!walks) continue;
    triangle = payload & 0x7fffffffu;
    uint solid = result_triangles[triangle];
    uint slot = walk_slots[tile.slots + (solid & ~kResultParity) - tile.first_solid];
    if ((solid & kResultParity) == 0u && walk_inside(slot) != (payload >> 31 != 0u)) {
      handed_over = true;
      walks = false;
      continue;
    }
    walk_toggle(tile, slot);
    group = true;
    group_depth = depth;
  }
  return !handed_over && !(walks && walk_inside_any(tile));
}

void main() {
  uint u = gl_GlobalInvocationID.x, v = gl_GlobalInvocationID.y + walk_row_begin;
  if (u >= walk_width || v >= walk_row_end) return;
  uint pixel = v * walk_width + u, place = pixel - walk_row_begin * walk_width;
  WalkTile tile = walk_tiles[((v + walk_first_row) >> 6) * walk_tiles_u + (u >> 6)];
  uint count, found;
  bool walked = result_walk(tile, pixel, kWalkNone, count, found);
  if (count > walk_longest) {
    result_too_long = 1u;
    return;
  }
  uint items = walked ? found : count, at = 0u;
  if (items > 0u) at = atomicAdd(result_used, items);
  result_places[place] = uvec2(at, (walked ? 0u : kResultHandedOver) | count << 16 | items);
  if (items == 0u || at + items > walk_capacity) return;
  if (!walked) {
    StrataCursor cursor = strata_list(pixel);
    for (uint i = 0u; i < count; ++i) {
      uint depth, payload;
      if (!strata_next(cursor, depth, payload)) break;
      result_items[at + i] = uvec2(payload, depth);
    }
  } else if (found <= kResultKept) {
    for (uint i = 0u; i < found; ++i) result_items[at + i] = result_kept[i];
  } else {
    result_walk(tile, pixel, at, count, found);
  }
}
