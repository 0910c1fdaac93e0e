// Depth peeling by atomic minima: the next layer of a pixel is the first fragment behind the last one, by depth, then
// payload, so that coplanar fragments are not lost. C. Everitt, "Interactive order-independent transparency" (2001).
// With PEEL_DUAL also from the back: L. Bavoil, K. Myers, "Order independent transparency with dual depth peeling"
// (2008). A first pass (PEEL_DEPTHS) finds the depths, a second one the payloads.
// Depths are stored plus 1; 0 and 0xffffffff are no fragment.
layout(std430, binding = 8) readonly buffer peel_near_block { uvec2 peel_near[]; };  // the last layer: payload, depth
layout(std430, binding = 9) buffer peel_next_block { uvec2 peel_next[]; };           // the layer that is looked for
#ifdef PEEL_DUAL
layout(std430, binding = 10) readonly buffer peel_far_block { uvec2 peel_far[]; };
layout(std430, binding = 11) buffer peel_next_far_block { uvec2 peel_next_far[]; };
#endif

bool peel_before(uint depth, uint payload, uvec2 other) {
  return depth < other.y || (depth == other.y && payload < other.x);
}

void strata_insert(uint pixel, uint depth, uint payload) {
  if (!store_takes(pixel)) return;
  depth = min(depth, 0xffffffu) + 1u;
  uvec2 near = peel_near[pixel];
  if (peel_before(depth, payload, near) || (depth == near.y && payload == near.x)) return;
#ifdef PEEL_DUAL
  uvec2 far = peel_far[pixel];
  if (!peel_before(depth, payload, far)) return;
#endif
#ifdef PEEL_DEPTHS
  atomicMin(peel_next[pixel].y, depth);
#ifdef PEEL_DUAL
  atomicMax(peel_next_far[pixel].y, depth);
#endif
#else
  if (depth == peel_next[pixel].y) atomicMin(peel_next[pixel].x, payload);
#ifdef PEEL_DUAL
  if (depth == peel_next_far[pixel].y) atomicMax(peel_next_far[pixel].x, payload);
#endif
#endif
}
