// First pass of the count/scan store: how many fragments each pixel has. After Maule, Comba, Torchelsen, Bastos,
// "Memory-Optimized Order-Independent Transparency with Dynamic Fragment Buffer", 2012/2014.
layout(std430, binding = 8) buffer store_ends_block { uint store_ends[]; };

void strata_insert(uint pixel, uint depth, uint payload) {
  if (store_takes(pixel)) atomicAdd(store_ends[pixel], 1u);
}
