// The picture of the rows of ordered_rows.glsl.
layout(local_size_x = 64) in;
uniform uint pixels, width;
layout(std430, binding = 1) writeonly buffer image_block { vec4 image[]; };
#ifdef STRATA_INTERLOCK
layout(std430, binding = 8) readonly buffer rows_block { vec4 rows_of_all[]; };
vec4 rows_at(uint pixel, int i) { return rows_of_all[pixel * uint(ROWS + 1) + uint(i)]; }
#else
layout(binding = 0) uniform sampler2DArray rows_texture;
vec4 rows_at(uint pixel, int i) { return texelFetch(rows_texture, ivec3(pixel % width, pixel / width, i), 0); }
#endif

void main() {
  uint pixel = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (pixel >= pixels) return;
  precise vec3 colour = vec3(0.0);
  precise float seen = 1.0;
#ifdef ROWS_KBUFFER
  vec4 done = rows_at(pixel, ROWS - 1);
  colour = done.rgb;
  seen = done.a;
#endif
#ifdef ROWS_MLAB
  const int count = ROWS;
#else
  const int count = ROWS - 1;
#endif
  for (int i = 0; i < count; ++i) {
    vec4 row = rows_at(pixel, i);
    colour += seen * row.rgb;
    seen *= row.a;
  }
#ifdef ROWS_HYBRID
  vec4 tail = rows_at(pixel, ROWS - 1);
  float tail_count = rows_at(pixel, ROWS).w;
  if (tail_count > 0.0 && tail.a > 0.0) {
    float through = pow(max(1.0 - tail.a / tail_count, 0.0), tail_count);
    colour += seen * (tail.rgb / tail.a) * (1.0 - through);
    seen *= through;
  }
#endif
  image[pixel] = vec4(colour, seen);
}
