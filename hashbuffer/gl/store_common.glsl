// What the texts of all stores begin with.
layout(std140, binding = 8) uniform store_block {
  uint store_first_pixel;  // of the band
  uint store_pixels;       // of the band
  uint store_room;         // cells of a table, or items
  uint store_age_limit;    // of a hash table
  uint store_band;
};

// Whether the band keeps fragments of `pixel`, which becomes the number within the band.
bool store_takes(inout uint pixel) {
#ifdef STRATA_FRAGMENT_STAGE
  if (gl_HelperInvocation) return false;  // its atomics return nonsense
#endif
  pixel -= store_first_pixel;
  return pixel < store_pixels;
}

