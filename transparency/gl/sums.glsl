// Sums over the fragments of a pixel, in no order: of premultiplied colours, of opacities, and their number. In fixed
// point, 1 / 2^18, so that the order changes no bit; a sum holds more than 16,000 layers.
layout(std430, binding = 8) buffer sums_block { uint sums[]; };  // 5 a pixel
layout(std430, binding = 9) readonly buffer sums_faces_block { vec4 sums_faces[]; };

void strata_insert(uint pixel, uint depth, uint payload) {
  if (!store_takes(pixel)) return;
  uvec4 add = uvec4(sums_faces[(payload & 0x7fffffffu) << 1 | payload >> 31] * 262144.0 + 0.5);
  uint at = 5u * pixel;
  atomicAdd(sums[at], add.r);
  atomicAdd(sums[at + 1u], add.g);
  atomicAdd(sums[at + 2u], add.b);
  atomicAdd(sums[at + 3u], add.a);
  atomicAdd(sums[at + 4u], 1u);
}
