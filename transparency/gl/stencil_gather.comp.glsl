// Appends the samples of a pixel to its slots, in the layout of fixed_arrays.glsl, and notes whether the last sample was
// reached: then there may be more fragments.
layout(local_size_x = 64) in;
layout(binding = 0) uniform usampler2DMS samples;
layout(std430, binding = 8) buffer store_counts_block { uint store_counts[]; };
layout(std430, binding = 9) writeonly buffer store_slots_block { uvec2 store_slots[]; };
layout(std430, binding = 2) buffer found_block { uint found; };
uniform uint pixels, width, sample_count, slots;

void main() {
  uint pixel = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (pixel >= pixels) return;
  uint count = store_counts[pixel];
  for (uint i = 0u; i < sample_count; ++i) {
    uvec2 fragment = texelFetch(samples, ivec2(pixel % width, pixel / width), int(i)).xy;
    if (fragment.y == 0xffffffffu) break;
    if (count < slots) store_slots[pixel * slots + count] = fragment;
    ++count;
    if (i + 1u == sample_count) found = 1u;
  }
  store_counts[pixel] = count;
}
