// Fills an image with copies of a few rows: element i becomes row i % count.
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer rows_block { vec4 rows[]; };
layout(std430, binding = 1) writeonly buffer image_block { vec4 image[]; };
uniform uint pixels, count;

void main() {
  uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (i < pixels) image[i] = rows[i % count];
}
