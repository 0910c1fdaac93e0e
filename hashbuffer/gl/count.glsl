// First pass of the count/scan store: how many fragments each pixel has. After Maule, Comba, Torchelsen, Bastos,
// "Memory-Optimized Order-Independent Transparency with Dynamic Fragment Buffer", 2012/2014.
layout(std430, binding = 8) buffer store_ends_block { uint store_ends[]; };
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
  if (pixel < store_pixels) atomicAdd(store_ends[pixel], 1u);
}
