// Puts what was peeled from the back behind what was peeled from the front.
layout(local_size_x = 64) in;
layout(std430, binding = 1) buffer image_block { vec4 image[]; };
layout(std430, binding = 3) readonly buffer back_block { vec4 back[]; };
uniform uint pixels;

void main() {
  uint pixel = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (pixel >= pixels) return;
  precise vec4 front = image[pixel];
  front.rgb += front.a * back[pixel].rgb;
  front.a *= back[pixel].a;
  image[pixel] = front;
}
