// Second pass of the count/scan store: each fragment to its place. An entry of store_ends moves from the begin of its
// list to the end, which is the begin of the next.
layout(std430, binding = 8) buffer store_ends_block { uint store_ends[]; };
#ifdef STORE_PAYLOADS
layout(std430, binding = 9) writeonly buffer store_items_block { uvec2 store_items[]; };
#else
layout(std430, binding = 9) writeonly buffer store_items_block { uint store_items[]; };
#endif

void strata_insert(uint pixel, uint depth, uint payload) {
  if (!store_takes(pixel)) return;
  uint slot = atomicAdd(store_ends[pixel], 1u);
  if (slot >= store_room) return;  // only geometry that differs from that of the first pass
#ifdef STORE_PAYLOADS
  store_items[slot] = uvec2(payload, min(depth, 0xffffffu));
#else
  store_items[slot] = min(depth, 0xffffffu);
#endif
}
