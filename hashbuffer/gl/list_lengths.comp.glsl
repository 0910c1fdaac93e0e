// The length of the list of each of `pixels` pixels from `first_pixel` on.
layout(local_size_x = 64) in;
layout(std430, binding = 0) writeonly buffer lengths_block { uint lengths[]; };
uniform uint first_pixel, pixels;

void main() {
  uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (i >= pixels) return;
  StrataCursor cursor = strata_list(first_pixel + i);
  uint length = 0u, depth, payload;
  while (strata_next(cursor, depth, payload)) ++length;
  lengths[i] = length;
}
