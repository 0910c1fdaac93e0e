// Counts the fragments of each pixel in the table's own words, to say which pixel has too many.
layout(std430, binding = 8) buffer store_table_block { uint store_table[]; };

void strata_insert(uint pixel, uint depth, uint payload) {
  if (store_takes(pixel)) atomicAdd(store_table[pixel], 1u);
}
