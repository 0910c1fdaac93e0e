// The lists of `pixels` pixels from `first_pixel` on, side by side, as items of strata/core/depth_list.h. begins[first_begin + i] counts
// from `first_item`.
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer begins_block { uint begins[]; };
layout(std430, binding = 1) writeonly buffer items_block { uvec2 items[]; };
uniform uint first_pixel, pixels, first_begin, first_item;

void main() {
  uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (i >= pixels) return;
  StrataCursor cursor = strata_list(first_pixel + i);
  uint place = begins[first_begin + i] - first_item;
  uint depth, payload;
  while (strata_next(cursor, depth, payload)) {
    items[place] = uvec2(payload, depth);
    ++place;
  }
}
