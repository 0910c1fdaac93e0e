// The pixels [first_pixel, first_pixel + pixels) of a store's lists, blended front to back as transparency/stream does.
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer faces_block { vec4 faces[]; };  // premultiplied, by [triangle << 1 | exit]
layout(std430, binding = 1) writeonly buffer image_block { vec4 image[]; };  // colour, transmittance
uniform uint first_pixel, pixels;

void main() {
  uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (i >= pixels) return;
  uint pixel = first_pixel + i;
  StrataCursor cursor = strata_list(pixel);
  precise vec3 colour = vec3(0.0);
  precise float seen = 1.0;
  uint depth, payload;
  while (strata_next(cursor, depth, payload)) {
    vec4 face = faces[(payload & 0x7fffffffu) << 1 | payload >> 31];
    colour += seen * face.rgb;
    seen *= 1.0 - face.a;
#ifdef LEAST_TRANSMITTANCE
    if (seen < LEAST_TRANSMITTANCE) break;
#endif
  }
  image[pixel] = vec4(colour, seen);
}
