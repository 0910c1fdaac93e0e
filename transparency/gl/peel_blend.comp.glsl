// Blends the layer that was peeled and gets ready for the next one.
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer faces_block { vec4 faces[]; };
layout(std430, binding = 1) buffer image_block { vec4 image[]; };
layout(std430, binding = 2) buffer found_block { uint found; };
layout(std430, binding = 8) buffer peel_near_block { uvec2 peel_near[]; };
layout(std430, binding = 9) buffer peel_next_block { uvec2 peel_next[]; };
#ifdef PEEL_DUAL
layout(std430, binding = 10) buffer peel_far_block { uvec2 peel_far[]; };
layout(std430, binding = 11) buffer peel_next_far_block { uvec2 peel_next_far[]; };
layout(std430, binding = 3) buffer back_block { vec4 back[]; };  // what lies behind: colour, transmittance
#endif
uniform uint pixels;

vec4 face_of(uint payload) { return faces[(payload & 0x7fffffffu) << 1 | payload >> 31]; }

void main() {
  uint pixel = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (pixel >= pixels) return;
  uvec2 near = peel_next[pixel];
  if (near.y == 0xffffffffu) return;
  precise vec4 front = image[pixel];
  vec4 face = face_of(near.x);
  front.rgb += front.a * face.rgb;
  front.a *= 1.0 - face.a;
  image[pixel] = front;
  peel_near[pixel] = near;
  peel_next[pixel] = uvec2(0xffffffffu);
  found = 1u;
#ifdef PEEL_DUAL
  uvec2 far = peel_next_far[pixel];
  peel_next_far[pixel] = uvec2(0u);
  if (far == near) return;  // the middle layer counts once
  peel_far[pixel] = far;
  precise vec4 behind = back[pixel];
  face = face_of(far.x);
  behind.rgb = face.rgb + (1.0 - face.a) * behind.rgb;
  behind.a *= 1.0 - face.a;
  back[pixel] = behind;
#endif
}
