// Second pass of the count/scan store: each fragment to its place. An entry of store_ends moves from the begin of its
// list to the end, which is the begin of the next.
layout(std430, binding = 8) buffer store_ends_block { uint store_ends[]; };
#ifdef STORE_PAYLOADS
layout(std430, binding = 9) writeonly buffer store_items_block { uvec2 store_items[]; };
#else
layout(std430, binding = 9) writeonly buffer store_items_block { uint store_items[]; };
#endif
layout(std140, binding = 8) uniform store_block {
  uint store_first_pixel;
  uint store_pixels;
  uint store_items_room;
  uint store_band;
};

void strata_insert(uint pixel, uint depth, uint payload) {
#ifdef STRATA_FRAGMENT_STAGE
  if (gl_HelperInvocation) return;
#endif
  pixel -= store_first_pixel;
  if (pixel >= store_pixels) return;
  uint slot = atomicAdd(store_ends[pixel], 1u);
  if (slot >= store_items_room) return;  // only geometry that differs from that of the first pass
#ifdef STORE_PAYLOADS
  store_items[slot] = uvec2(payload, min(depth, 0xffffffu));
#else
  store_items[slot] = min(depth, 0xffffffu);
#endif
}
