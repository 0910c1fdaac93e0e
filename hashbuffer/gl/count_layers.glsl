// Counts the fragments of each pixel in the table's own words, to say which pixel has too many.
layout(std430, binding = 8) buffer store_table_block { uint store_table[]; };
layout(std140, binding = 8) uniform store_block {
  uint store_first_pixel;
  uint store_pixels;
  uint store_cells;
  uint store_age_limit;
  uint store_band;
};

void strata_insert(uint pixel, uint depth, uint payload) {
#ifdef STRATA_FRAGMENT_STAGE
  if (gl_HelperInvocation) return;
#endif
  pixel -= store_first_pixel;
  if (pixel < store_pixels) atomicAdd(store_table[pixel], 1u);
}
